//! In: a calibrated value and what its solver knows about it. Out: the record that is kept on disk.
//! Frame and unit: stated in the record; covariances in the units of their parameters squared.

use crate::fault::{Fault, Result};
use crate::geometry::{Camera, Flange, Rigid};
use std::collections::BTreeMap;
use std::path::Path;

/// How far a calibration can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    Good,
    Usable,
    BadlyDetermined,
    Refused,
}

impl Verdict {
    pub fn words(self) -> &'static str {
        match self {
            Verdict::Good => "good",
            Verdict::Usable => "usable",
            Verdict::BadlyDetermined => "badly determined",
            Verdict::Refused => "refused",
        }
    }
}

/// Covariance of named parameters; `matrix[i][j]` belongs to `parameters[i]`, `parameters[j]`.
/// Each name ends with its unit: `fx_px`, `tx_mm`, `rx_rad`.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    pub parameters: Vec<String>,
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    pub fn new(parameters: &[&str], matrix: &nalgebra::DMatrix<f64>) -> Covariance {
        assert_eq!((parameters.len(), parameters.len()), matrix.shape());
        Covariance {
            parameters: parameters.iter().map(|s| s.to_string()).collect(),
            matrix: matrix.row_iter().map(|r| r.iter().copied().collect()).collect(),
        }
    }
    /// Standard deviation of one parameter.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        let i = self.parameters.iter().position(|p| p == name)?;
        Some(self.matrix.get(i)?.get(i)?.max(0.0).sqrt())
    }
    pub fn to_matrix(&self) -> nalgebra::DMatrix<f64> {
        let n = self.parameters.len();
        nalgebra::DMatrix::from_fn(n, n, |i, j| self.matrix[i][j])
    }
}

/// What a solver says about its result, for people and for later error budgets.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Quality {
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

/// A calibrated value with its origin. `T` is `Intrinsics`, `Plane<Camera>`, `Ray<Camera>` or `HandEye`.
///
/// Covariance parameters by kind: camera `fx_px fy_px cx_px cy_px k1 k2 p1 p2 k3`; laser plane
/// `nx ny nz offset_mm` (rank 3, along the tangent of the unit normal); pointer
/// `ox_mm oy_mm oz_mm dx dy dz` (rank 4), then the camera's nine, because the beam was found with that
/// camera and a range needs both; hand-eye see [`HandEye`].
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calibration<T> {
    pub format: u32,
    /// camera, laser_plane, pointer or hand_eye.
    pub kind: String,
    /// RFC 3339.
    pub created: String,
    /// Program and version.
    pub program: String,
    pub units: String,
    pub frame: String,
    /// File name to SHA-256 of everything that went in, other calibrations included.
    pub inputs: BTreeMap<String, String>,
    pub value: T,
    pub covariance: Covariance,
    pub quality: Quality,
}

impl<T> Calibration<T> {
    pub fn new(kind: &str, frame: &str, value: T, covariance: Covariance, quality: Quality) -> Calibration<T> {
        Calibration {
            format: 1,
            kind: kind.into(),
            created: jiff::Timestamp::now().to_string(),
            program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
            units: "mm, rad, px".into(),
            frame: frame.into(),
            inputs: BTreeMap::new(),
            value,
            covariance,
            quality,
        }
    }
    /// Records a file that went into the result.
    pub fn with_input(mut self, path: &Path) -> Result<Self> {
        let name = path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned());
        self.inputs.insert(name, hash_file(path)?);
        Ok(self)
    }
    pub(super) fn check(&self, kind: &str) -> Result<()> {
        if self.format != 1 || self.kind != kind {
            return Err(Fault::input(format!(
                "holds a '{}' of format {}, expected a '{kind}' of format 1",
                self.kind, self.format
            ))
            .cause("calibration files were renamed or swapped")
            .next("calibrate again, or put the former file back"));
        }
        Ok(())
    }
}

/// SHA-256 of a file, hexadecimal.
pub fn hash_file(path: &Path) -> Result<String> {
    std::fs::read(path).map(|bytes| hash_text(&bytes)).map_err(|e| Fault::read(path, e))
}

/// SHA-256 of bytes, hexadecimal.
pub fn hash_text(bytes: &[u8]) -> String {
    use sha2::Digest;
    sha2::Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}
