//! In: a hand-eye fit. Out: how far off a measured point will be, the camera's own error with it.
//! Frame and unit: the camera's carrier, mm (docs/math.md, Hand-eye (12)).

use super::hand_eye::HandEyeFit;
use super::projection::project;
use crate::geometry::{Mat3, Vec3, skew};
use nalgebra::{DMatrix, SMatrix};

/// Expected error of a point on the optical axis, mm rms over the three axes together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedError {
    pub whole: f64,
    /// The share of it that the camera makes: its viewing ray and, by way of the fit, the hand-eye transform.
    /// The two belong together. A camera whose principal point is off turns the fitted transform the other way,
    /// so that the point stays nearly where it is.
    pub from_camera: f64,
}

/// Of a point at a distance along the optical axis, known by its pixel and its depth.
pub fn expected_error(fit: &HandEyeFit, distance: f64) -> ExpectedError {
    let point = Vec3::new(0.0, 0.0, distance);
    let rotation = fit.chain.near_from_camera.rotation;
    let mut by_chain = SMatrix::<f64, 3, 12>::zeros();
    by_chain.fixed_view_mut::<3, 3>(0, 0).copy_from(&Mat3::identity());
    by_chain.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&(rotation * point)));
    let c = by_chain * fixed(&fit.covariance_camera_exact) * by_chain.transpose();
    let by_camera = by_chain * fit.by_camera + rotation * seen_by_camera(fit, &point);
    let from_camera = by_camera * fit.camera_covariance * by_camera.transpose();
    ExpectedError { whole: (c + from_camera).trace().max(0.0).sqrt(), from_camera: from_camera.trace().max(0.0).sqrt() }
}

/// How the point that a pixel and a depth stand for moves with the camera's parameters.
fn seen_by_camera(fit: &HandEyeFit, point: &Vec3) -> SMatrix<f64, 3, 9> {
    let mut out = SMatrix::<f64, 3, 9>::zeros();
    let Some(at) = project(&fit.camera, point) else { return out };
    let Some(back) = at.by_point.fixed_columns::<2>(0).try_inverse() else { return out };
    out.fixed_rows_mut::<2>(0).copy_from(&-(back * at.by_intrinsics.fixed_columns::<9>(0)));
    out
}

fn fixed(m: &DMatrix<f64>) -> SMatrix<f64, 12, 12> {
    SMatrix::from_fn(|i, j| m[(i, j)])
}
