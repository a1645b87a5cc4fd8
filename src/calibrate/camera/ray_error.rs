//! In: a camera and its covariance. Out: the expected error of a viewing ray.
//! Frame and unit: px.

use crate::calibrate::projection::project;
use crate::camera::{Intrinsics, PARAMETERS, ParameterMatrix, Parameters};
use crate::geometry::{Vec2, Vec3, skew};
use nalgebra::DMatrix;

/// Middles of the cells of a raster over the image, px, row by row.
pub(super) fn raster(k: &Intrinsics, columns: usize, rows: usize) -> impl Iterator<Item = Vec2> {
    let at = |i: usize, of: usize, size: u32| (i as f64 + 0.5) / of as f64 * f64::from(size) - 0.5;
    let (width, height) = (k.width, k.height);
    (0..columns * rows).map(move |i| Vec2::new(at(i % columns, columns, width), at(i / columns, rows, height)))
}

/// How viewing rays at some pixels move when the intrinsics do: rows are the displacements in px (u, v), with the part
/// that a rotation of the whole camera would explain taken out (docs/math.md, Camera calibration (8)).
fn ray_jacobian(k: &Intrinsics, at: impl Iterator<Item = Vec2>) -> DMatrix<f64> {
    let mut a = Vec::new();
    let mut b = Vec::new();
    for px in at {
        let Some(n) = k.normalised_from_pixel(&px) else { continue };
        let x = Vec3::new(n.x, n.y, 1.0);
        let Some(p) = project(k, &x) else { continue };
        a.push(p.by_intrinsics);
        b.push(p.by_point * -skew(&x));
    }
    let rows = 2 * a.len();
    let a = DMatrix::from_fn(rows, PARAMETERS, |r, c| a[r / 2][(r % 2, c)]);
    let b = DMatrix::from_fn(rows, 3, |r, c| b[r / 2][(r % 2, c)]);
    let turn = (b.transpose() * &b).try_inverse().map(|inv| inv * b.transpose() * &a);
    turn.map_or(a.clone(), |t| a - b * t)
}

/// rms distance between the viewing rays of two cameras over the image, px, after the best rotation.
pub(super) fn rays_apart(a: &Intrinsics, b: &Intrinsics) -> f64 {
    let moved = ray_jacobian(a, raster(a, 9, 7)) * (b.parameters() - a.parameters());
    (moved.norm_squared() / (moved.len() as f64 / 2.0)).sqrt()
}

/// Change of the uncertain parameters that moves the viewing rays as the change `moved` of all parameters does. It is
/// the most likely one under `covariance`, with the rays known to `sigma_px`. `None` if the system cannot be solved.
pub(super) fn following(
    k: &Intrinsics,
    covariance: &ParameterMatrix,
    moved: &Parameters,
    sigma_px: f64,
) -> Option<Parameters> {
    let j = ray_jacobian(k, raster(k, 9, 7));
    let spread: nalgebra::OMatrix<f64, nalgebra::Const<PARAMETERS>, nalgebra::Dyn> = covariance * j.transpose();
    let own = &j * &spread + DMatrix::identity(j.nrows(), j.nrows()) * sigma_px.powi(2);
    Some(spread * own.cholesky()?.solve(&(&j * moved)))
}

/// Expected rms displacement of the viewing rays over the image, px, after the best rotation, from
/// the covariance of the camera's parameters.
pub fn expected_ray_error(k: &Intrinsics, covariance: &ParameterMatrix) -> f64 {
    expected_ray_error_at(k, covariance, raster(k, 9, 7))
}

/// The same at some pixels only, after the rotation that suits these best.
pub(in crate::calibrate::camera) fn expected_ray_error_at(
    k: &Intrinsics,
    covariance: &ParameterMatrix,
    at: impl Iterator<Item = Vec2>,
) -> f64 {
    let j = ray_jacobian(k, at);
    let sum: f64 = (&j * covariance).component_mul(&j).sum();
    (sum / (j.nrows() as f64 / 2.0)).max(0.0).sqrt()
}
