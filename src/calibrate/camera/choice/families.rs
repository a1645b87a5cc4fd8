//! In: a camera solved with the plain lens (k1 k2 p1 p2 k3). Out: the same with one more family of terms (the
//! sensor's tilt, thin prism, rational) if held-out pictures support it.
//! Frame and unit: those of the lens; px. docs/math.md, Camera calibration (10), (11).

use super::held_out::{WORTH, gain, held_out};
use crate::calibrate::camera::bundle::State;
use crate::calibrate::camera::fit::Fit;
use crate::calibrate::camera::lens::Lens;
use crate::calibrate::camera::ray_error::{expected_ray_error, rays_apart};
use crate::camera::SKEW;
use crate::solve::Solution;

/// Families of terms beyond the plain lens, added one at a time: together they can hardly be separated. The user may
/// request any of them.
const FAMILIES: [Lens; 3] = [Lens::Scheimpflug, Lens::Prism, Lens::Rational];
/// Fewer pictures cannot be held out against each other.
const MIN_PICTURES: usize = 8;

/// Adds the family with the largest gain, if any is supported.
pub(in crate::calibrate::camera) fn by_families(fit: &Fit<'_>, solution: &mut Solution<State>, held: &mut Vec<usize>) {
    if fit.corners.len() < MIN_PICTURES {
        return;
    }
    let skew = held.contains(&SKEW);
    let mut plain = None;
    let mut best: Option<(f64, Solution<State>, Vec<usize>)> = None;
    for family in FAMILIES {
        let with: Vec<usize> = family.held().into_iter().chain(skew.then_some(SKEW)).collect();
        let Some(more) = fit.fine(&with, without(&solution.state, &with)).so_far() else { continue };
        // Only a model that fits its own pictures better can fit others better.
        if !(more.sigma0.powi(2) < (1.0 - WORTH) * solution.sigma0.powi(2)) || !worth_its_noise(fit, solution, &more) {
            continue;
        }
        let plain = plain.get_or_insert_with(|| held_out(fit, solution, held, solution.sigma0));
        let Some(gain) = gain(plain, &held_out(fit, &more, &with, solution.sigma0)) else { continue };
        if best.as_ref().is_none_or(|b| gain > b.0) {
            best = Some((gain, more, with));
        }
    }
    if let Some((_, more, with)) = best {
        (*solution, *held) = (more, with);
    }
}

/// A state with these parameters at zero.
fn without(state: &State, held: &[usize]) -> State {
    let mut state = state.clone();
    held.iter().for_each(|&i| state.camera[i] = 0.0);
    state
}

/// True if the change of the rays exceeds the uncertainty that the additional terms add to them.
fn worth_its_noise(fit: &Fit<'_>, plain: &Solution<State>, more: &Solution<State>) -> bool {
    let error = |s| fit.covariance(s).map(|c| expected_ray_error(&fit.camera(s), &c).powi(2));
    let (Some(less), Some(noise)) = (error(plain), error(more)) else { return false };
    rays_apart(&fit.camera(plain), &fit.camera(more)).powi(2) > 2.0 * (noise - less)
}
