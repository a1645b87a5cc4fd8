//! In: a calibrated value and what its solver reports about it. Out: the record that is stored on disk.
//! Frame and unit: stated in the record; covariances in products of their parameters' units.

use super::hash::{hash_text, hex};
use super::kind::{Place, Units};
use super::{Covariance, Kind, Measured};
use crate::camera::{Intrinsics, Readout};
use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Flange, Rigid};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// How far a calibration can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// More than the work needs.
    Good,
    /// Suitable for work; the reasons state what limits it.
    Usable,
    /// The data do not determine it well enough for the work; better pictures are needed.
    BadlyDetermined,
    /// Unusable; it is not loaded.
    Refused,
}

impl Verdict {
    /// The verdict as messages show it.
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Good => "good",
            Verdict::Usable => "usable",
            Verdict::BadlyDetermined => "badly determined",
            Verdict::Refused => "refused",
        }
    }
}

/// What a solver reports about its result, for the user and for later error budgets.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// How far the result can be trusted.
    pub verdict: Verdict,
    /// Reasons for the verdict, one sentence each.
    pub reasons: Vec<String>,
    /// The next best picture to take, in words; empty if nothing is missing.
    pub advice: Vec<String>,
    /// Named figures with their unit in the name, e.g. `rms_px`, `holdout_rms_px`,
    /// `expected_error_at_working_distance_mm`.
    pub figures: BTreeMap<String, f64>,
    /// One entry per picture or pose: name and rms residual, in the unit of the rms entry of `figures`.
    pub per_picture: Vec<(String, f64)>,
}

/// Hand-eye transform: the pose of the camera on the flange. Covariance parameters, in this order: `tx_mm ty_mm
/// tz_mm rx_rad ry_rad rz_rad`, the rotation as a left perturbation in the flange frame: R = exp([rx ry rz]) R̂.
pub type HandEye = Rigid<Flange, Camera>;

/// Figure of a hand-eye calibration's quality: the robot's position sigma per axis, mm. Ranges are computed with it.
pub const ROBOT_SIGMA_MM: &str = "robot_sigma_mm";
/// The same for the robot's orientation, degrees.
pub const ROBOT_SIGMA_DEG: &str = "robot_sigma_deg";

/// A calibrated value with its origin. `T` is `Intrinsics`, `Plane<Camera>`, `Ray<Camera>` or `HandEye`.
///
/// The covariance's parameters depend on the kind: [`Kind::parameters`]; for the hand-eye see [`HandEye`]. A laser
/// plane's covariance has rank 3, along the tangent of the unit normal, that of a pointer's beam has rank 4.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration<T> {
    /// Version of the file's format; 2 is written.
    pub format: u32,
    /// What the value is.
    pub kind: Kind,
    /// Time of the calibration, RFC 3339.
    pub created: String,
    /// Program and version that wrote it.
    pub program: String,
    /// Units of value and covariance.
    pub units: Units,
    /// The frame of the value, or the transform between two frames that it is.
    pub frame: Place,
    /// File name and SHA-256 of every input file.
    pub inputs: BTreeMap<String, String>,
    /// The calibrations that it was made with and is useless without: kind and [`Calibration::content`].
    pub rests_on: BTreeMap<Kind, String>,
    /// For a camera: how its pictures were read from the sensor, if they stated it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<Readout>,
    /// For a camera and for a laser plane: pixels (column, row) that are bright without light in all pictures used,
    /// px. They show whether later pictures are read from the sensor in the same way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hot_pixels: Vec<[u32; 2]>,
    /// The calibrated value.
    pub value: T,
    /// Covariance of the value's parameters.
    pub covariance: Covariance,
    /// The solver's assessment.
    pub quality: Quality,
    /// What a user has vouched for, and when, and which sigmas an import assumed; every report shows it.
    pub remarks: Vec<String>,
}

/// Format of the files that this version writes.
pub(super) const FORMAT: u32 = 2;

impl<T: Serialize> Calibration<T> {
    /// `with` is the camera that it was measured with, if any.
    pub fn new(
        kind: Kind,
        value: T,
        with: Option<&Calibration<Intrinsics>>,
        covariance: Covariance,
        mut quality: Quality,
    ) -> Calibration<T> {
        // JSON cannot hold numbers that are not finite: a figure that could not be computed is omitted.
        quality.figures.retain(|_, v| v.is_finite());
        quality.per_picture.retain(|(_, v)| v.is_finite());
        Calibration {
            format: FORMAT,
            kind,
            created: jiff::Timestamp::now().to_string(),
            program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
            units: Units::MmRadPx,
            frame: kind.place(),
            inputs: BTreeMap::new(),
            rests_on: with.map(|c| (Kind::Camera, c.content())).into_iter().collect(),
            readout: None,
            hot_pixels: Vec::new(),
            value,
            covariance,
            quality,
            remarks: Vec::new(),
        }
    }
    /// SHA-256 of the value and its covariance, which results are computed from. Other records name it in
    /// `rests_on`.
    pub fn content(&self) -> String {
        let held = (self.kind, self.units, self.frame, &self.value, &self.covariance);
        hash_text(serde_json::to_string(&held).expect("plain data").as_bytes())
    }
}

impl<T> Calibration<T> {
    /// Records a file that went into the result.
    pub fn with_input(mut self, path: &Path) -> Result<Self> {
        let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
        self.inputs.insert(name, hash_file(path)?);
        Ok(self)
    }
}

impl<T: Measured> Calibration<T> {
    /// Refuses a record of another kind, frame or format, an invalid value or covariance, and a result that its own
    /// solver refused.
    pub fn check(&self, kind: Kind) -> Result<()> {
        if self.format != FORMAT || self.kind != kind || self.frame != kind.place() {
            return Err(Fault::input(format!(
                "holds a '{}' of format {} in frame {:?}, expected a '{}' of format {FORMAT} in {:?}",
                self.kind.name(),
                self.format,
                self.frame,
                kind.name(),
                kind.place()
            ))
            .cause("calibration files were renamed or swapped")
            .next("restore the right file, or calibrate again"));
        }
        if self.quality.verdict == Verdict::Refused {
            return Err(Fault::input(format!("was refused when it was made: {}", self.quality.reasons.join("; ")))
                .cause("a result that determines nothing was copied there by hand")
                .next("calibrate again as its reasons advise"));
        }
        self.value.check()?;
        self.covariance.check(kind)
    }
}

/// Figure of an axis calibration's quality: the axis' position scatter from stop to stop, mm. Points are judged by
/// it.
pub const AXIS_SIGMA_MM: &str = "axis_sigma_mm";
/// The same for the axis' rotation, degrees.
pub const AXIS_SIGMA_DEG: &str = "axis_sigma_deg";

/// Scatter of an axis from stop to stop, mm and rad; `None` if the calibration was not computed here.
pub fn axis_sigma(quality: &Quality) -> Option<[f64; 2]> {
    let of = |name: &str| quality.figures.get(name).copied();
    Some([of(AXIS_SIGMA_MM)?, of(AXIS_SIGMA_DEG)?.to_radians()])
}

impl Calibration<HandEye> {
    /// Sigma of the robot per axis, mm and degrees, that the calibration found; `None` if the values come from
    /// elsewhere and nothing is known about the robot.
    pub fn robot_sigma(&self) -> Result<Option<[f64; 2]>> {
        let of = |name: &str| self.quality.figures.get(name).copied();
        match (of(ROBOT_SIGMA_MM), of(ROBOT_SIGMA_DEG)) {
            (Some(mm), Some(deg)) => Ok(Some([mm, deg])),
            (None, None) if self.covariance.matrix.iter().flatten().all(|x| *x == 0.0) => Ok(None),
            _ => Err(Fault::input(format!("the hand-eye calibration has no {ROBOT_SIGMA_MM} and {ROBOT_SIGMA_DEG}"))
                .cause("it was made by another version, and without them the robot would count as perfect")
                .next("run sheetlight calibrate hand-eye again")),
        }
    }
}

/// SHA-256 of a file, hexadecimal.
pub fn hash_file(path: &Path) -> Result<String> {
    use sha2::Digest;
    let mut hash = sha2::Sha256::new();
    crate::files::length(path)?;
    let copied = std::fs::File::open(path).and_then(|mut f| std::io::copy(&mut f, &mut hash));
    copied.map_err(|e| Fault::read(path, e))?;
    Ok(hex(&hash.finalize()))
}
