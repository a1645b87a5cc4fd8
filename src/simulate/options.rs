//! In: nothing. Out: the options of a simulation with their limits: sets of recordings, a design, a scene, noise.
//! Frame and unit: px, mm, degrees; stated at each field.

use super::rig::RigSpec;
use super::sensor::Sensor;
use super::station::Station;
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, Base, Flange, Rigid};
use crate::recording::BoardSpec;
use std::path::PathBuf;

/// One kind of recording.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, strum::EnumString, strum::IntoStaticStr, strum::VariantArray,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Set {
    /// The sheet of light passes over the scene.
    Scan,
    /// A chessboard in many poses, for the camera.
    Intrinsics,
    /// A chessboard fixed in the base frame, seen from many robot poses.
    Handeye,
    /// The stripe on two chessboards in many poses.
    Laserplane,
    /// The pointer's spot on a chessboard in many poses.
    PointerCal,
    /// The pointer's spot on a plate across the optical axis, throughout the pointer's range.
    Pointer,
    /// The pointer's spot on the scene from several robot poses, for the surface normal.
    Surface,
    /// A chessboard that rides on the axis, at several of the axis' stops.
    Axis,
}

impl Set {
    /// The sets of a robot's station; a station with an axis has [`Set::Axis`] in addition.
    pub const ALL: [Set; 7] =
        [Set::Scan, Set::Intrinsics, Set::Handeye, Set::Laserplane, Set::PointerCal, Set::Pointer, Set::Surface];
    /// The name used in options, folders and files.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

fn unknown(word: &str) -> String {
    format!("{}, all", crate::fault::unknown::<Set>("set", word))
}

/// The scene that is simulated when no other is named: a circuit board with parts.
pub const DEFAULT_SCENE: &str = include_str!("../../data/scenes/board.toml");

/// What to simulate.
#[derive(Clone, Debug)]
pub struct SimulateOptions {
    /// Sets to record, 1..=100 of them.
    pub sets: Vec<Set>,
    /// The design that stations are built to; the paper's if not given.
    pub rig: Option<RigSpec>,
    /// A scene file. If not given, the built-in board with parts, or for a named rig a scene that fits into its
    /// field.
    pub scene: Option<PathBuf>,
    /// The calibration board of all sets that show one; built-in chessboards if not given.
    pub board: Option<BoardSpec>,
    /// 0 is the design itself; every other number gives another specimen, scene pose and noise.
    pub seed: u64,
    /// Columns of the sensor, px, 64..=8192.
    pub width: u32,
    /// Rows of the sensor, px, 64..=8192.
    pub height: u32,
    /// Conversion of light into grey levels.
    pub sensor: Sensor,
    /// Exposures of each pose of a scan, ascending, as peaks of the stripe on white (share of full scale, 0.002..=200).
    /// Empty: one picture a pose, with the sensor's own.
    pub exposures: Vec<f64>,
    /// Shots of a scan, 2..=100000.
    pub shots: usize,
    /// The axis that moves the parts past the fixed sensor; `None`: a robot moves the sensor.
    pub motion: Option<AxisKind>,
    /// Robot poses for the shots of a scan or of the pointer on the scene; chosen by the simulation if not given.
    pub poses: Option<Vec<Rigid<Base, Flange>>>,
    /// Position error of the reported robot poses, 1 sigma per axis, mm, 0..=10.
    pub pose_noise_mm: f64,
    /// Orientation error of the reported robot poses, 1 sigma per axis, degrees, 0..=5.
    pub pose_noise_deg: f64,
}

impl Default for SimulateOptions {
    fn default() -> Self {
        SimulateOptions { rig: None, shots: 200, ..SimulateOptions::of(RigSpec::paper()) }
    }
}

impl SimulateOptions {
    /// A scan by a rig exactly as designed.
    pub fn of(rig: RigSpec) -> SimulateOptions {
        SimulateOptions {
            sets: vec![Set::Scan],
            scene: None,
            board: None,
            seed: 1,
            width: rig.camera.width_px,
            height: rig.camera.height_px,
            sensor: rig.sensor,
            exposures: Vec::new(),
            shots: rig.shots(),
            motion: None,
            poses: None,
            rig: Some(rig),
            pose_noise_mm: 0.0,
            pose_noise_deg: 0.0,
        }
    }

    /// Refuses values outside the ranges that the fields state, and options that contradict each other.
    pub fn check(&self) -> Result<()> {
        self.sensor.check()?;
        let limits = [
            ("width", f64::from(self.width), 64.0, 8192.0),
            ("height", f64::from(self.height), 64.0, 8192.0),
            ("shots", self.poses.as_ref().map_or(self.shots, Vec::len) as f64, 2.0, 1e5),
            ("pose noise in mm", self.pose_noise_mm, 0.0, 10.0),
            ("pose noise in degrees", self.pose_noise_deg, 0.0, 5.0),
            ("the number of sets", self.sets.len() as f64, 1.0, 100.0),
        ];
        if let Some(odd) = self.exposures.iter().find(|e| !(0.002..=200.0).contains(*e)) {
            return Err(Fault::usage(format!("an exposure of {odd}, allowed 0.002..=200"))
                .next("give peaks of the stripe on white as shares of full scale"));
        }
        if !self.exposures.is_empty() {
            crate::raster::Bracket::new(&self.exposures_us(), self.sensor.bits, 0.0)
                .map_err(|e| e.at("--exposures"))?;
        }
        if self.motion.is_none() && self.sets.contains(&Set::Axis) {
            return Err(Fault::usage("the set axis shows a board on an axis, and no axis is simulated")
                .next("name one: --motion linear or --motion turntable"));
        }
        if self.poses.is_some() && !matches!(self.sets[..], [Set::Scan] | [Set::Surface]) {
            return Err(Fault::usage("poses were given for something else than one scan or one set surface")
                .next("simulate scan or surface alone, or leave the poses out"));
        }
        match limits.iter().find(|(_, v, low, high)| !(*low..=*high).contains(v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, allowed {low}..={high}")).next("correct the option"))
            }
            None => Ok(()),
        }
    }

    /// The exposure times of a pose's pictures, us: the sensor's own levels are those of a millisecond.
    pub fn exposures_us(&self) -> Vec<f64> {
        self.exposures.iter().map(|peak| 1000.0 * peak / self.sensor.laser_white).collect()
    }

    /// The design: the named rig, or the paper's.
    pub fn design(&self) -> RigSpec {
        self.rig.clone().unwrap_or_else(RigSpec::paper)
    }

    /// The specimen that these options describe.
    pub fn station(&self) -> Station {
        let mut station = Station::of(&self.design(), self.seed);
        station.sensor = self.sensor;
        station.with_size(self.width, self.height)
    }

    /// Scales every source of noise: 0 is a noiseless sensor, 1 the default, 2 twice the noise.
    pub fn with_noise(mut self, factor: f64) -> SimulateOptions {
        let s = &mut self.sensor;
        s.read_noise_e *= factor;
        s.speckle *= factor;
        s.hot_per_million *= factor;
        s.full_well_e = (s.full_well_e / (factor * factor).max(1e-6)).clamp(500.0, 1e6);
        self
    }
}
