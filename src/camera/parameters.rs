//! In: a camera. Out: its parameters as one vector with names; calibration files, covariances and derivatives use
//! the same order.
//! Frame and unit: px, and the units of the lens's terms; each name ends with its unit.

use super::distortion::{Distortion, TERMS};
use super::intrinsics::Intrinsics;
use nalgebra::{SMatrix, SVector};

/// Number of parameters of a camera: fx fy cx cy, the lens's terms, skew.
pub const PARAMETERS: usize = 5 + TERMS;

/// Names of the parameters, in order.
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

/// Index of the lens's first term.
pub const LENS: usize = 4;
/// Index of the skew, the last parameter.
pub const SKEW: usize = PARAMETERS - 1;
/// Number of parameters that files always name; the others are named if they were free.
pub const ALWAYS_NAMED: usize = 9;

/// A camera's numbers in the order of [`NAMES`], each in the unit that its name ends with.
pub type Parameters = SVector<f64, PARAMETERS>;
/// A square matrix with rows and columns in the order of [`NAMES`]. A matrix that is known to be a covariance is a
/// [`super::CameraCovariance`].
pub type ParameterMatrix = SMatrix<f64, PARAMETERS, PARAMETERS>;

impl Intrinsics {
    /// The camera's numbers in the order of [`NAMES`].
    pub fn parameters(&self) -> Parameters {
        let mut v = Parameters::zeros();
        (v[0], v[1], v[2], v[3], v[SKEW]) = (self.fx, self.fy, self.cx, self.cy, self.skew);
        v.rows_mut(LENS, TERMS).copy_from_slice(&self.distortion.0);
        v
    }

    /// A camera with the same sensor and these parameters.
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

/// Step for derivatives by differences: 0.05 px, and 1e-4 for the lens's terms.
pub fn difference_step(parameter: usize) -> f64 {
    if (LENS..SKEW).contains(&parameter) { 1e-4 } else { 0.05 }
}
