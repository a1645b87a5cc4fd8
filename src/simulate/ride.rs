//! In: a station, the axis that moves the parts past it, a scene. Out: the true axis, the counts of a scan, the
//! camera's pose over the scene at a count, and a board that rides along.
//! Frame and unit: camera, axis (docs/conventions.md), scene, board; mm, counts.

use super::light::InScene;
use super::plan;
use super::scene::Scene;
use super::station::Station;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, AxisKind, Base, Board, Camera, CountUnit, Mat3, Riding, Rigid, Vec3, exp};
use crate::recording::{BoardSpec, Carries, Motion, MotionKind};
use rand::Rng;

/// A part's motion past a fixed sensor.
#[derive(Clone, Debug)]
pub struct Ride {
    /// The true axis, camera frame.
    pub axis: Axis,
    /// Pose of the scene at count 0.
    camera_from_scene: Rigid<Camera, InScene>,
    /// Counts of a scan's shots.
    pub counts: Vec<f64>,
    camera_from_board: Rigid<Camera, Board>,
}

/// Number of the board's stops that the axis is calibrated from.
const STOPS: usize = 14;
/// Largest misalignment of an axis, degrees.
const ASKEW_DEG: f64 = 1.5;
/// Encoder steps of a linear axis in a pixel footprint.
const STEPS: f64 = 40.0;
/// Encoder counts per turn of a turntable.
const TURN: f64 = 36_000.0;

impl Ride {
    /// One pass of an axis over the scene's region in `shots`, or one turn about the scene's origin. Every seed
    /// gives another axis.
    pub fn new(kind: AxisKind, station: &Station, scene: &Scene, board: &BoardSpec, shots: usize) -> Ride {
        let mut rng = station.rng("ride", kind as u64);
        let mut within = |by: f64| if station.seed == 0 { 0.0 } else { rng.random_range(-by..=by) };
        let askew = ASKEW_DEG.to_radians();
        let scale = station.rig.scale();
        let cameras = plan::scan(station, scene, if kind == AxisKind::Linear { shots } else { 3 });
        // A turntable's sheet passes through its axis.
        let first = if kind == AxisKind::Linear { cameras[0] } else { cameras[1] };
        let camera_from_scene = first.inverse();
        let (unit, steps) = (CountUnit::Count, (shots.max(2) - 1) as f64);
        let (riding, counts): (Riding, Vec<f64>) = match kind {
            AxisKind::Linear => {
                let pitch = station.rig.footprint_mm() / STEPS * (1.0 + within(0.05));
                let length = (cameras[shots.max(2) - 1].translation - first.translation).norm();
                let direction = exp(&Vec3::new(within(askew), 0.0, within(askew))) * -Vec3::y();
                let direction = camera_from_scene.direction(&direction);
                let count = |i: usize| (length / pitch * i as f64 / steps).round();
                (Riding { kind, unit, direction, point: Vec3::zeros(), pitch }, (0..shots).map(count).collect())
            }
            AxisKind::Turntable => {
                let pitch = std::f64::consts::TAU / TURN;
                let direction = exp(&Vec3::new(within(askew), within(askew), 0.0)) * Vec3::z();
                let point = Vec3::new(within(1.5 * scale), within(1.5 * scale), 0.0);
                let (direction, point) = (camera_from_scene.direction(&direction), camera_from_scene.point(&point));
                let count = |i: usize| (TURN * i as f64 / shots as f64).round();
                (Riding { kind, unit, direction, point, pitch }, (0..shots).map(count).collect())
            }
        };
        let camera_from_board =
            lying(station, board, &riding, &camera_from_scene, [within(0.2), within(0.2), within(0.3)]);
        let axis = Axis::from_board(&riding, &camera_from_board);
        Ride { axis, camera_from_scene, counts, camera_from_board }
    }

    /// Pose of the camera over the scene at a count.
    pub fn scene_from_camera(&self, count: f64) -> Rigid<InScene, Camera> {
        (self.axis.moved(count) * self.camera_from_scene).inverse()
    }

    /// Pose of the camera over the riding board at a count.
    pub fn board_from_camera(&self, count: f64) -> Rigid<Board, Camera> {
        (self.axis.moved(count) * self.camera_from_board).inverse()
    }

    /// The scene in the cloud's frame.
    pub fn cloud_from_scene(&self) -> Rigid<Base, InScene> {
        let axis_from_scene = self.axis.camera_from_axis.inverse() * self.camera_from_scene;
        Rigid::new(axis_from_scene.rotation, axis_from_scene.translation)
    }

    /// The motion as meta.json states it.
    pub fn motion(&self) -> Motion {
        let kind = match self.axis.kind {
            AxisKind::Linear => MotionKind::Linear,
            AxisKind::Turntable => MotionKind::Turntable,
        };
        Motion { kind, carries: Carries::Part, unit: Some(self.axis.unit), ..Motion::default() }
    }

    /// Unevenly spaced stops at which the whole board is in the picture, with the board's pose at each.
    ///
    /// # Errors
    /// A board that is in view at fewer than half of the intended stops.
    pub fn stops(&self, station: &Station, board: &BoardSpec) -> Result<Vec<(f64, Rigid<Camera, Board>)>> {
        let features = board.features();
        let (w, h) = (f64::from(station.camera.width), f64::from(station.camera.height));
        let edge = 0.02 * w;
        let seen = |pose: &Rigid<Camera, Board>| {
            features.iter().all(|p| {
                let q = station.camera.pixel_from_point(&pose.point(p));
                q.is_some_and(|q| q.x > edge && q.y > edge && q.x < w - edge && q.y < h - edge)
            })
        };
        let at = |count: f64| self.axis.moved(count) * self.camera_from_board;
        let step = match self.axis.kind {
            AxisKind::Linear => station.rig.footprint_mm() / self.axis.pitch,
            AxisKind::Turntable => TURN / 720.0,
        };
        // Half a turn, or as many steps as the picture is wide.
        let farthest =
            if self.axis.kind == AxisKind::Linear { station.camera.width.max(station.camera.height) } else { 360 };
        let reach = |sign: f64| {
            (0..farthest).take_while(|i| seen(&at(sign * step * f64::from(*i)))).count() as f64 * sign * step
        };
        let (low, high) = (reach(-1.0), reach(1.0));
        let mut rng = station.rng("stops", self.axis.kind as u64);
        let mut counts: Vec<f64> = (0..STOPS)
            .map(|i| (low + (high - low) * (i as f64 + rng.random_range(0.1..0.9)) / STOPS as f64).round())
            .collect();
        counts.dedup();
        let found: Vec<_> = counts.into_iter().map(|c| (c, at(c))).filter(|(_, pose)| seen(pose)).collect();
        if found.len() * 2 < STOPS {
            return Err(Fault::usage(format!(
                "the board is in the picture at {} of {STOPS} stops of the axis",
                found.len()
            ))
            .cause("it is too large for this camera")
            .next("simulate a smaller board"));
        }
        Ok(found)
    }
}

/// Pose of the board at count 0: on the table where the camera looks, on a turntable at its axis; slightly tilted,
/// as on a wedge.
fn lying(
    station: &Station,
    board: &BoardSpec,
    riding: &Riding,
    camera_from_scene: &Rigid<Camera, InScene>,
    [tilt_x, tilt_y, turn]: [f64; 3],
) -> Rigid<Camera, Board> {
    let features = board.features();
    let middle = features.iter().sum::<Vec3>() / features.len() as f64;
    // The board's z points into the board, the scene's z points up.
    let level = camera_from_scene.rotation * Mat3::from_diagonal(&Vec3::new(1.0, -1.0, -1.0));
    let tilt = exp(&Vec3::new(0.15 + 0.5 * tilt_x, -0.1 + 0.5 * tilt_y, 0.0));
    let rotation = level * exp(&Vec3::new(0.0, 0.0, turn)) * tilt;
    let view = Vec3::new(0.0, 0.0, station.working_distance);
    let place = match riding.kind {
        AxisKind::Linear => view,
        AxisKind::Turntable => riding.point + riding.direction * riding.direction.dot(&(view - riding.point)),
    };
    Rigid::new(rotation, place - rotation * middle)
}
