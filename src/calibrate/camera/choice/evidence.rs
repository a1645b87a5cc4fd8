//! In: a camera solved with all terms. Out: the terms that the pictures support and that do not fold the lens back
//! inside the image; the others are held at zero.
//! Frame and unit: those of the lens.

use super::families::{Doubt, squares, without};
use crate::calibrate::camera::bundle::State;
use crate::calibrate::camera::fit::Fit;
use crate::calibrate::camera::lens::Lens;
use crate::calibrate::camera::ray_error::expected_ray_error;
use crate::camera::{LENS, SKEW};
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

/// Largest part of the features' residuals that the terms of a folding lens may explain, rms px and as a share of all
/// residuals, for fewer terms to replace it. In photographs of two cameras whose boards left the corners of the image
/// free, k3 explained 0.006 and 0.010 px.
const FOLDED_PX: f64 = 0.1;
const NEARLY: f64 = 0.5;
/// With fewer pictures the halves of one set fold in different terms. Those that are left scatter less than they state.
const MIN_PICTURES: usize = 8;

/// Replaces a lens that folds back inside the image by the lens of most terms that does not. What the terms explained
/// becomes a doubt. Nothing changes if no such lens fits nearly as well.
pub(in crate::calibrate::camera) fn by_folding(
    fit: &Fit<'_>,
    solution: &mut Solution<State>,
    held: &mut Vec<usize>,
) -> Option<Doubt> {
    if fit.corners.len() < MIN_PICTURES {
        return None;
    }
    // The choices before this one end near the optimum, and a lens may fold only there.
    *solution = fit.fine(held, solution.state.clone()).so_far()?;
    fit.camera(solution).fold()?;
    for lens in [Lens::Five, Lens::Four, Lens::One] {
        let fewer: Vec<usize> = lens.held().into_iter().chain(held.contains(&SKEW).then_some(SKEW)).collect();
        if fewer.len() <= held.len() {
            continue;
        }
        // What is left of a richer lens may be far from the optimum, and so may no lens at all. Twice, because a fit
        // that had to go far ends before it settles.
        let starts = [fewer.clone(), (LENS..SKEW).collect()].map(|zero| without(&solution.state, &zero));
        let fits = starts.into_iter().filter_map(|start| {
            let near = fit.fine(&fewer, start).so_far()?;
            fit.fine(&fewer, near.state).so_far()
        });
        let best = fits.min_by(|a, b| squares(fit, a).total_cmp(&squares(fit, b)));
        let Some(plain) = best else { continue };
        let explained_px = (squares(fit, &plain) - squares(fit, solution)).max(0.0).sqrt();
        let nearly = explained_px < FOLDED_PX.max(NEARLY * squares(fit, solution).sqrt());
        if fit.camera(&plain).fold().is_none() && nearly {
            let doubt = Doubt { folds: true, ..Doubt::of(fit, (&plain, solution), Lens::Five, explained_px) };
            (*solution, *held) = (plain, fewer);
            return Some(doubt);
        }
    }
    None
}

/// Squared Mahalanobis distance of some parameters from zero; 0 if they are not determined.
fn tells(fit: &Fit<'_>, solution: &Solution<State>, block: &[usize]) -> f64 {
    let Some(c) = fit.covariance(solution) else { return 0.0 };
    let theta = DVector::from_iterator(block.len(), block.iter().map(|&i| solution.state.camera[i]));
    let sub = DMatrix::from_fn(block.len(), block.len(), |a, b| c[(block[a], block[b])]);
    sub.try_inverse().map_or(0.0, |inverse| (theta.transpose() * inverse * &theta)[0])
}
