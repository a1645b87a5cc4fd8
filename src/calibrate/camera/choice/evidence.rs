//! In: a camera solved with all terms. Out: the terms that the pictures support; the others are held at zero.
//! Frame and unit: those of the lens.

use crate::calibrate::camera::bundle::State;
use crate::calibrate::camera::fit::Fit;
use crate::calibrate::camera::ray_error::expected_ray_error;
use crate::solve::Solution;
use nalgebra::DMatrix;
use nalgebra::DVector;

/// Holds lens terms at zero, from the highest down, if the pictures cannot distinguish them from zero and if
/// estimating them would cost accuracy (expected ray error over the image).
pub(in crate::calibrate::camera) fn by_evidence(fit: &Fit<'_>, solution: &mut Solution<State>, held: &mut Vec<usize>) {
    for block in [&[8][..], &[6, 7], &[5], &[4]] {
        if block.iter().all(|i| held.contains(i)) {
            continue;
        }
        if tells(fit, solution, block) > 4.0 * block.len() as f64 {
            return;
        }
        let fewer = [held, block].concat();
        let mut start = solution.state.clone();
        block.iter().for_each(|&i| start.camera[i] = 0.0);
        let Some(reduced) = fit.fine(&fewer, start).so_far() else { return };
        let cost =
            |s: &Solution<State>| fit.covariance(s).map_or(f64::INFINITY, |c| expected_ray_error(&fit.camera(s), &c));
        if cost(solution) < 1.25 * cost(&reduced) {
            return;
        }
        *solution = reduced;
        *held = fewer;
    }
}

/// Squared Mahalanobis distance of some parameters from zero; 0 if they are not determined.
fn tells(fit: &Fit<'_>, solution: &Solution<State>, block: &[usize]) -> f64 {
    let Some(c) = fit.covariance(solution) else { return 0.0 };
    let theta = DVector::from_iterator(block.len(), block.iter().map(|&i| solution.state.camera[i]));
    let sub = DMatrix::from_fn(block.len(), block.len(), |a, b| c[(block[a], block[b])]);
    sub.try_inverse().map_or(0.0, |inverse| (theta.transpose() * inverse * &theta)[0])
}
