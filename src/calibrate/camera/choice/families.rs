//! In: a camera solved with the plain lens (k1 k2 p1 p2 k3). Out: the same with one more family of terms (the
//! sensor's tilt, thin prism, rational) if held-out pictures support it.
//! Frame and unit: those of the lens; px. docs/math.md, Camera calibration (10), (11).

use super::held_out::{WORTH, gain, held_out};
use crate::calibrate::camera::bundle::State;
use crate::calibrate::camera::fit::Fit;
use crate::calibrate::camera::lens::Lens;
use crate::calibrate::camera::ray_error::{expected_ray_error, expected_ray_error_at, following, rays_apart};
use crate::camera::{Intrinsics, ParameterMatrix, Parameters, SKEW};
use crate::solve::Solution;

/// Families of terms beyond the plain lens, added one at a time: together they can hardly be separated. The user may
/// request any of them.
const FAMILIES: [Lens; 3] = [Lens::Scheimpflug, Lens::Prism, Lens::Rational];
/// Fewer pictures cannot be held out against each other.
const MIN_PICTURES: usize = 8;
/// Error of features that all pictures share, rms px: print, blur and light move them alike, and pictures that are held
/// out do not show it. In twelve real photographs of one camera, terms without ground explained 0.015 and 0.017 px.
const SHARED_PX: f64 = 0.02;
/// Probability of a family that fits better by less than [`SHARED_PX`].
const ODDS: f64 = 0.25;

/// Uncertainty of the rays where boards were seen, as a multiple of what the plain lens gets wrong there, from which on
/// the pictures do not determine a family. In ten photographs k4, k5 and k6 explained little and left 4.6 px.
const UNKNOWN: f64 = 4.0;
/// Number of features at which that is evaluated.
const SEEN: usize = 400;

/// Lens terms that fit better and are not adopted.
#[derive(Clone, Debug)]
pub struct Doubt {
    /// The family.
    pub lens: Lens,
    /// Part of the features' residuals that it explains, rms px.
    pub explained_px: f64,
    /// How far it moves the viewing rays, rms px over the image.
    pub rays_px: f64,
    /// How it moves all parameters, its own too.
    pub(super) moved: Parameters,
    /// The lens would fold back inside the image. Otherwise the family explains no more than errors that all
    /// features share.
    pub folds: bool,
}

impl Doubt {
    /// The doubt about the second of two models, which has the terms of `lens`.
    pub(super) fn of(
        fit: &Fit<'_>,
        (plain, more): (&Solution<State>, &Solution<State>),
        lens: Lens,
        explained_px: f64,
    ) -> Doubt {
        let [plain, more] = [plain, more].map(|s| fit.camera(s));
        let moved = more.parameters() - plain.parameters();
        Doubt { lens, explained_px, rays_px: rays_apart(&plain, &more), moved, folds: false }
    }

    /// Covariance that the doubt about the family adds to a camera without it. The camera's own parameters move so that
    /// its viewing rays follow those of the family.
    pub(in crate::calibrate::camera) fn covariance(
        &self,
        k: &Intrinsics,
        covariance: &ParameterMatrix,
    ) -> Option<ParameterMatrix> {
        let moved = following(k, covariance, &self.moved, SHARED_PX)?;
        Some(moved * moved.transpose() * ODDS)
    }
}

/// Adds the family with the largest gain. If none is adopted, returns those that would be adopted if features had no
/// errors in common.
pub(in crate::calibrate::camera) fn by_families(
    fit: &Fit<'_>,
    solution: &mut Solution<State>,
    held: &mut Vec<usize>,
) -> Vec<Doubt> {
    if fit.corners.len() < MIN_PICTURES {
        return Vec::new();
    }
    let skew = held.contains(&SKEW);
    let mut plain = None;
    let mut best: Option<(f64, Solution<State>, Vec<usize>)> = None;
    let mut doubts = Vec::new();
    for family in FAMILIES {
        let with: Vec<usize> = family.held().into_iter().chain(skew.then_some(SKEW)).collect();
        let Some(more) = fit.fine(&with, without(&solution.state, &with)).so_far() else { continue };
        // Only a model that fits its own pictures better can fit others better.
        if !(more.sigma0.powi(2) < (1.0 - WORTH) * solution.sigma0.powi(2)) || !worth_its_noise(fit, solution, &more) {
            continue;
        }
        let plain = plain.get_or_insert_with(|| held_out(fit, solution, held, solution.sigma0));
        let Some(gain) = gain(plain, &held_out(fit, &more, &with, solution.sigma0)) else { continue };
        let explained_px = (squares(fit, solution) - squares(fit, &more)).max(0.0).sqrt();
        if explained_px < SHARED_PX {
            doubts.push(Doubt::of(fit, (solution, &more), family, explained_px));
        } else if best.as_ref().is_none_or(|b| gain > b.0) {
            best = Some((gain, more, with));
        }
    }
    let Some((_, more, with)) = best else { return doubts };
    (*solution, *held) = (more, with);
    Vec::new()
}

/// Mean squared residual of a feature, px²; features that the robust loss sets aside count less.
pub(super) fn squares(fit: &Fit<'_>, solution: &Solution<State>) -> f64 {
    let sigmas = fit.corners.iter().flatten().map(|c| c.2);
    let each = solution.lengths.iter().zip(&solution.weights).zip(sigmas);
    let (sum, weight) = each.fold((0.0, 0.0), |(s, w), ((r, own), sigma)| (s + own * (r * sigma).powi(2), w + own));
    sum / f64::max(weight, 1e-12)
}

/// A state with these parameters at zero.
pub(super) fn without(state: &State, held: &[usize]) -> State {
    let mut state = state.clone();
    held.iter().for_each(|&i| state.camera[i] = 0.0);
    state
}

/// True if the change of the rays exceeds the uncertainty that the additional terms add to them, and if the rays are
/// not known far worse, where boards were seen, than what the terms explain.
fn worth_its_noise(fit: &Fit<'_>, plain: &Solution<State>, more: &Solution<State>) -> bool {
    let (Some(of_plain), Some(of_more)) = (fit.covariance(plain), fit.covariance(more)) else { return false };
    let [a, b] = [plain, more].map(|s| fit.camera(s));
    let [less, noise] = [(&a, &of_plain), (&b, &of_more)].map(|(k, c)| expected_ray_error(k, c).powi(2));
    let step = (fit.corners.iter().map(Vec::len).sum::<usize>() / SEEN).max(1);
    let seen = || fit.corners.iter().flatten().map(|c| c.1).step_by(step);
    let [less_there, noise_there] = [(&a, &of_plain), (&b, &of_more)].map(|(k, c)| expected_ray_error_at(k, c, seen()));
    let explained = (squares(fit, plain) - squares(fit, more)).max(0.0).sqrt();
    rays_apart(&a, &b).powi(2) > 2.0 * (noise - less) && noise_there < UNKNOWN * less_there.hypot(explained)
}
