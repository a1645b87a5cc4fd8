//! In: a calibrated value and what its solver knows about it. Out: the record that is kept on disk.
//! Frame and unit: stated in the record; covariances in the units of their parameters squared.

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
    /// What the work needs, with room to spare.
    Good,
    /// It can be worked with; the reasons say what limits it.
    Usable,
    /// The data says too little for the work; better pictures are needed.
    BadlyDetermined,
    /// It is of no use and is not loaded.
    Refused,
}

impl Verdict {
    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Good => "good",
            Verdict::Usable => "usable",
            Verdict::BadlyDetermined => "badly determined",
            Verdict::Refused => "refused",
        }
    }
}

/// What a solver says about its result, for people and for later error budgets.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
    /// How far the result can be trusted.
    pub verdict: Verdict,
    /// Why, in words; one sentence each.
    pub reasons: Vec<String>,
    /// The next best picture to take, in words; empty when nothing is missing.
    pub advice: Vec<String>,
    /// Named figures with their unit in the name, e.g. `rms_px`, `holdout_rms_px`,
    /// `expected_error_at_working_distance_mm`.
    pub figures: BTreeMap<String, f64>,
    /// One entry a picture or pose: name and rms residual with its unit in the key of `figures`.
    pub per_picture: Vec<(String, f64)>,
}

/// Hand-eye transform: the camera on the flange. Covariance parameters, in this order:
/// `tx_mm ty_mm tz_mm rx_rad ry_rad rz_rad`, the rotation as a left perturbation in the flange
/// frame: R = exp([rx ry rz]) R̂.
pub type HandEye = Rigid<Flange, Camera>;

/// Figures of a hand-eye's quality that ranges are worked out with: the robot's sigma per axis.
pub const ROBOT_SIGMA_MM: &str = "robot_sigma_mm";
/// Of its orientation, degrees; the one above is of its position, mm.
pub const ROBOT_SIGMA_DEG: &str = "robot_sigma_deg";

/// A calibrated value with its origin. `T` is `Intrinsics`, `Plane<Camera>`, `Ray<Camera>` or `HandEye`.
///
/// Covariance parameters by kind: [`Kind::parameters`]; a laser plane's has rank 3, along the tangent of the unit
/// normal, a pointer's beam rank 4; hand-eye see [`HandEye`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration<T> {
    /// Version of the file's format; 2 is written.
    pub format: u32,
    /// What the value is.
    pub kind: Kind,
    /// RFC 3339.
    pub created: String,
    /// Program and version.
    pub program: String,
    /// Of value and covariance.
    pub units: Units,
    /// The frame, or the transform between two, that the value is in.
    pub frame: Place,
    /// File name to SHA-256 of everything that went in.
    pub inputs: BTreeMap<String, String>,
    /// The calibrations that it was made with and is of no use without: kind to [`Calibration::content`].
    pub rests_on: BTreeMap<Kind, String>,
    /// Of a camera: how its pictures were read from the sensor, where they said so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readout: Option<Readout>,
    /// Of a camera and of a laser plane: pixels that shine by themselves in all pictures that were used (column, row),
    /// px. They tell whether later pictures are read from the sensor in the same way.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hot_pixels: Vec<[u32; 2]>,
    /// What was found.
    pub value: T,
    /// Of the value's parameters.
    pub covariance: Covariance,
    /// What the solver says of it.
    pub quality: Quality,
    /// What a person has vouched for, and when, and which sigmas an import assumed; every report shows it.
    pub remarks: Vec<String>,
}

/// Of the files that this version writes.
pub(super) const FORMAT: u32 = 2;

impl<T: Serialize> Calibration<T> {
    /// `with`: the camera that it was measured with, where it was measured with one.
    pub fn new(
        kind: Kind,
        value: T,
        with: Option<&Calibration<Intrinsics>>,
        covariance: Covariance,
        mut quality: Quality,
    ) -> Calibration<T> {
        // JSON has no number for what is not finite: a figure that could not be worked out is not there.
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
    /// SHA-256 of what is calculated with: the value and its covariance. Others name it in `rests_on`.
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
    /// Refuses a record of another kind, frame or format, a value or covariance that is none, and what its own solver
    /// refused.
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

/// Figures of an axis' quality that points are judged by: what it scatters by from stop to stop.
pub const AXIS_SIGMA_MM: &str = "axis_sigma_mm";
/// Of its turn, degrees; the one above is of its place, mm.
pub const AXIS_SIGMA_DEG: &str = "axis_sigma_deg";

/// What an axis scatters by from stop to stop, mm and rad; `None` where the values come from elsewhere.
pub fn axis_sigma(quality: &Quality) -> Option<[f64; 2]> {
    let of = |name: &str| quality.figures.get(name).copied();
    Some([of(AXIS_SIGMA_MM)?, of(AXIS_SIGMA_DEG)?.to_radians()])
}

impl Calibration<HandEye> {
    /// Sigma of the robot per axis, mm and degrees, that the calibration found; `None` where the values come from
    /// elsewhere and nothing is known of it.
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
