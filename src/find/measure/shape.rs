//! In: nothing. Out: the sizes of a part against its drawing, and how an edge moves with them.
//! Frame and unit: the part's axes; shares (0.01: a hundredth longer), shear in rad. docs/math.md, Sizes.

use nalgebra::{Matrix3, Vector3};

/// Sizes relative to the drawing: lengths along the part's x and y and the shear between them.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// How much longer than drawn along x and y, as shares, and the shear between them, rad.
    pub strain: Vector3<f64>,
    /// Covariance of these three, 3 x 3 in the same order.
    pub covariance: Matrix3<f64>,
}

/// How far an edge at a place moves along its normal for each of the three sizes.
pub(in crate::find) fn shape_row(x: f64, y: f64, nx: f64, ny: f64) -> [f64; 3] {
    [x * nx, y * ny, 0.5 * (x * ny + y * nx)]
}
