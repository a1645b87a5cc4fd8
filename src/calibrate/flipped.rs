//! Whether pictures of boards were turned or mirrored against those that their camera was calibrated with.

use super::measured_pose::{MeasuredPose, pooled_factor};
use crate::camera::{CameraCovariance, Flip, Intrinsics, ParameterMatrix, Parameters};

/// What a flipped camera must take off the sum of squared residuals, in squares of the corners' sigmas: ten sigmas,
/// because the corners of one picture err together. Only a camera that is wrong by half of what a flip moves its
/// principal point comes near.
const SURE: f64 = 100.0;

/// Pictures that fit the camera only if it is flipped: which, and how.
pub fn flipped(poses: &[&MeasuredPose], camera: &Intrinsics, belief: &CameraCovariance) -> Option<(Vec<usize>, Flip)> {
    let variance = pooled_factor(poses.iter().copied())?.powi(2);
    let root = root(belief);
    let of = |flip: Flip| {
        let change = camera.flipped(flip).parameters() - camera.parameters();
        let gain = |which: &[usize]| {
            let mut information = ParameterMatrix::zeros();
            let mut pull = Parameters::zeros();
            for &i in which {
                information += poses[i].about_camera.information / variance;
                pull += poses[i].about_camera.gradient / variance;
            }
            Some(least(&information, &pull, &Parameters::zeros(), &root)? - least(&information, &pull, &change, &root)?)
        };
        let which: Vec<usize> = (0..poses.len()).filter(|&i| gain(&[i]).is_some_and(|g| g > 0.0)).collect();
        let sure = gain(&which).filter(|g| *g > SURE)?;
        Some((sure, which, flip))
    };
    let best = Flip::ALL.into_iter().filter_map(of).max_by(|a, b| a.0.total_cmp(&b.0))?;
    Some((best.1, best.2))
}

/// A square root of the camera's covariance, in which what is known exactly stays zero.
fn root(belief: &CameraCovariance) -> ParameterMatrix {
    let parts = belief.matrix().symmetric_eigen();
    parts.eigenvectors * ParameterMatrix::from_diagonal(&parts.eigenvalues.map(|v| v.max(0.0).sqrt()))
}

/// The least sum of squares, over what it is with the calibrated camera, that a camera about `change` reaches within
/// what is believed of it.
fn least(information: &ParameterMatrix, pull: &Parameters, change: &Parameters, root: &ParameterMatrix) -> Option<f64> {
    let there = 2.0 * pull.dot(change) + change.dot(&(information * change));
    let slope = root.transpose() * (pull + information * change);
    let curve = root.transpose() * information * root + ParameterMatrix::identity();
    Some(there - slope.dot(&curve.cholesky()?.solve(&slope)))
}
