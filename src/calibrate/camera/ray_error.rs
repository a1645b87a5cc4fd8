//! In: a camera and its covariance. Out: the expected error of a viewing ray.
//! Frame and unit: px.

use crate::calibrate::projection::project;
use crate::camera::{Intrinsics, PARAMETERS, ParameterMatrix};
use crate::geometry::{Vec2, Vec3, skew};
use nalgebra::DMatrix;

/// Derivatives of the viewing rays by the intrinsics. Rows are displacements in px (u, v) on a 9 x 7 grid; the part
/// that a rotation of the entire camera explains is removed (docs/math.md, Camera calibration (8)).
fn ray_jacobian(k: &Intrinsics) -> DMatrix<f64> {
    let mut a = Vec::new();
    let mut b = Vec::new();
    for j in 0..7 {
        for i in 0..9 {
            let px = Vec2::new(
                (f64::from(i) + 0.5) / 9.0 * f64::from(k.width) - 0.5,
                (f64::from(j) + 0.5) / 7.0 * f64::from(k.height) - 0.5,
            );
            let Some(n) = k.normalised_from_pixel(&px) else { continue };
            let x = Vec3::new(n.x, n.y, 1.0);
            let Some(p) = project(k, &x) else { continue };
            a.push(p.by_intrinsics);
            b.push(p.by_point * -skew(&x));
        }
    }
    let rows = 2 * a.len();
    let a = DMatrix::from_fn(rows, PARAMETERS, |r, c| a[r / 2][(r % 2, c)]);
    let b = DMatrix::from_fn(rows, 3, |r, c| b[r / 2][(r % 2, c)]);
    let turn = (b.transpose() * &b).try_inverse().map(|inv| inv * b.transpose() * &a);
    turn.map_or(a.clone(), |t| a - b * t)
}

/// rms distance between the viewing rays of two cameras over the image, px, after the best rotation.
pub(super) fn rays_apart(a: &Intrinsics, b: &Intrinsics) -> f64 {
    let moved = ray_jacobian(a) * (b.parameters() - a.parameters());
    (moved.norm_squared() / (moved.len() as f64 / 2.0)).sqrt()
}

/// Expected rms displacement of the viewing rays over the image, px, after the best rotation, from the covariance of
/// the camera's parameters.
pub fn expected_ray_error(k: &Intrinsics, covariance: &ParameterMatrix) -> f64 {
    let j = ray_jacobian(k);
    let sum: f64 = (&j * covariance).component_mul(&j).sum();
    (sum / (j.nrows() as f64 / 2.0)).max(0.0).sqrt()
}
