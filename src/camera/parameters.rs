//! In: a camera. Out: its parameters as one vector under names, which calibration files, covariances and derivatives
//! share.
//! Frame and unit: px and the lens's own; each name ends with its unit.

use super::distortion::{Distortion, TERMS};
use super::intrinsics::Intrinsics;
use nalgebra::{SMatrix, SVector};

/// How many parameters a camera has: fx fy cx cy, the lens's terms, skew.
pub const PARAMETERS: usize = 5 + TERMS;

/// Their names, in order.
pub const NAMES: [&str; PARAMETERS] = [
    "fx_px",
    "fy_px",
    "cx_px",
    "cy_px",
    "k1",
    "k2",
    "p1",
    "p2",
    "k3",
    "k4",
    "k5",
    "k6",
    "s1",
    "s2",
    "s3",
    "s4",
    "tau_x_rad",
    "tau_y_rad",
    "skew_px",
];

/// Of the first term of the lens, and of the skew.
pub const LENS: usize = 4;
/// Of the skew, the last one.
pub const SKEW: usize = PARAMETERS - 1;
/// Files name these always, the others where they are free.
pub const ALWAYS_NAMED: usize = 9;

/// A camera's numbers in the order of [`NAMES`], each in the unit that its name ends with.
pub type Parameters = SVector<f64, PARAMETERS>;
/// A square of them: rows and columns in the order of [`NAMES`]. What is known to be a covariance is a
/// [`super::CameraCovariance`].
pub type ParameterMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

impl Intrinsics {
    /// Its numbers in the order of [`NAMES`].
    pub fn parameters(&self) -> Parameters {
        let mut v = Parameters::zeros();
        (v[0], v[1], v[2], v[3], v[SKEW]) = (self.fx, self.fy, self.cx, self.cy, self.skew);
        v.rows_mut(LENS, TERMS).copy_from_slice(&self.distortion.0);
        v
    }

    /// The same sensor with these parameters.
    pub fn with_parameters(&self, v: &Parameters) -> Intrinsics {
        Intrinsics {
            fx: v[0],
            fy: v[1],
            cx: v[2],
            cy: v[3],
            skew: v[SKEW],
            distortion: Distortion(std::array::from_fn(|i| v[LENS + i])),
            ..*self
        }
    }

    /// Adds a change of the parameters.
    pub fn changed(&self, by: &Parameters) -> Intrinsics {
        self.with_parameters(&(self.parameters() + by))
    }
}

/// Step for derivatives by differences: a thousandth of what matters.
pub fn difference_step(parameter: usize) -> f64 {
    if (LENS..SKEW).contains(&parameter) { 1e-4 } else { 0.05 }
}
