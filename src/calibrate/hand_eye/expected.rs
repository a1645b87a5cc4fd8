//! In: a hand-eye fit. Out: the expected error of a measured point, with the camera's own error.
//! Frame and unit: the camera's carrier, mm (docs/math.md, Hand-eye (12)).

use super::fit::HandEyeFit;
use super::terms::UNKNOWNS;
use crate::calibrate::projection::project;
use crate::camera::PARAMETERS;
use crate::geometry::{Mat3, Vec3, skew};
use nalgebra::{DMatrix, SMatrix};

/// Expected error of a point on the optical axis, rms over the length of its error vector, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExpectedError {
    /// For the point seen with the given camera: the errors of robot, pixels and that camera together.
    pub whole: f64,
    /// The given camera's share: by its viewing ray and, through the fit, by the hand-eye transform.
    pub from_camera: f64,
    /// The same point seen with the camera that was fitted jointly; its errors are correlated with the chain's.
    pub with_joint_camera: f64,
}

/// Expected error at a distance along the optical axis, for a point known by its pixel and its depth.
pub fn expected_error(fit: &HandEyeFit, distance: f64) -> ExpectedError {
    let point = Vec3::new(0.0, 0.0, distance);
    let rotation = fit.chain.near_from_camera.rotation;
    let mut by_chain = SMatrix::<f64, 3, 12>::zeros();
    by_chain.fixed_view_mut::<3, 3>(0, 0).copy_from(&Mat3::identity());
    by_chain.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&(rotation * point)));
    let by_ray = rotation * seen_by_camera(fit, &point);
    // Contribution of the given camera's error, and of pixels and robot besides it.
    let follows = fit.by_camera * fit.by_camera.transpose();
    let rest = by_chain * (fixed(&fit.covariance) - follows) * by_chain.transpose();
    let by_given = by_chain * fit.by_camera + by_ray * fit.given.root;
    let from_camera = (by_given * by_given.transpose()).trace();
    let mut by_all = DMatrix::<f64>::zeros(3, UNKNOWNS);
    by_all.view_mut((0, 0), (3, 12)).copy_from(&by_chain);
    by_all.view_mut((0, 12), (3, PARAMETERS)).copy_from(&by_ray);
    let joint = (&by_all * &fit.joint_covariance * by_all.transpose()).trace();
    let root = |x: f64| x.max(0.0).sqrt();
    ExpectedError {
        whole: root(rest.trace() + from_camera),
        from_camera: root(from_camera),
        with_joint_camera: root(joint),
    }
}

/// Derivatives of the point with a given pixel and depth by the camera's parameters.
fn seen_by_camera(fit: &HandEyeFit, point: &Vec3) -> SMatrix<f64, 3, PARAMETERS> {
    let mut out = SMatrix::<f64, 3, PARAMETERS>::zeros();
    let Some(at) = project(&fit.camera, point) else { return out };
    let Some(back) = at.by_point.fixed_columns::<2>(0).try_inverse() else { return out };
    out.fixed_rows_mut::<2>(0).copy_from(&-(back * at.by_intrinsics));
    out
}

fn fixed(m: &DMatrix<f64>) -> SMatrix<f64, 12, 12> {
    SMatrix::from_fn(|i, j| m[(i, j)])
}
