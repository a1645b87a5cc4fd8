//! In: a camera solved with the plain lens (k1 k2 p1 p2 k3). Out: the same with one more family of terms (the sensor's tilt, thin
//! prism, rational) where pictures that it was not solved from give reason for it.
//! Frame and unit: the lens's own; px. docs/math.md, Camera calibration (10), (11).

use super::bundle::{Corner, State};
use super::fit::Fit;
use super::lens::Lens;
use super::ray_error::{expected_ray_error, rays_apart};
use crate::camera::{PARAMETERS, SKEW};
use crate::solve::Solution;

/// What a lens may have beside the plain terms, one at a time: together they are hardly told apart, and a person may ask for them.
const FAMILIES: [Lens; 3] = [Lens::Scheimpflug, Lens::Prism, Lens::Rational];
/// Fewer pictures say nothing of one another.
const MIN_PICTURES: usize = 8;
/// Parts in which pictures are held out.
const PARTS: usize = 4;
/// Standard errors by which the held-out pictures must fit better.
const SURE: f64 = 3.0;
/// Least share of the squared residuals that goes: what is less is the board's and the corners', whatever its odds. Of photographs by a
/// plain lens rational terms explain between 0.5 and 2 %, three standard errors sure.
const WORTH: f64 = 0.02;
/// Residuals beyond this many sigmas say no more.
const FAR: f64 = 3.0;

/// Takes the family in that tells the most, if one does.
pub(in crate::calibrate) fn by_families(fit: &Fit<'_>, solution: &mut Solution<State>, held: &mut Vec<usize>) {
    if fit.corners.len() < MIN_PICTURES {
        return;
    }
    let skew = held.contains(&SKEW);
    let mut plain = None;
    let mut best: Option<(f64, Solution<State>, Vec<usize>)> = None;
    for family in FAMILIES {
        let with: Vec<usize> = family.held().into_iter().chain(skew.then_some(SKEW)).collect();
        let more = fit.fine(&with, without(&solution.state, &with));
        // Only what fits its own pictures better can fit others better.
        if !(more.sigma0.powi(2) < (1.0 - WORTH) * solution.sigma0.powi(2)) || !worth_its_noise(fit, solution, &more) {
            continue;
        }
        let plain = plain.get_or_insert_with(|| held_out(fit, solution, held));
        let Some(gain) = gain(plain, &held_out(fit, &more, &with)) else { continue };
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
    held.iter().for_each(|&i| state.0[i] = 0.0);
    state
}

/// True where the rays move by more than the further terms' own uncertainty adds to them.
fn worth_its_noise(fit: &Fit<'_>, plain: &Solution<State>, more: &Solution<State>) -> bool {
    let error = |s| fit.covariance(s).map(|c| expected_ray_error(&fit.camera(s), &c).powi(2));
    let (Some(less), Some(noise)) = (error(plain), error(more)) else { return false };
    rays_apart(&fit.camera(plain), &fit.camera(more)).powi(2) > 2.0 * (noise - less)
}

/// Mean squared residual of each picture, in squares of the corners' sigmas, with the camera of others and its own pose.
fn held_out(fit: &Fit<'_>, solution: &Solution<State>, held: &[usize]) -> Vec<f64> {
    let all: Vec<usize> = (0..PARAMETERS).collect();
    let far = (FAR * solution.sigma0).powi(2);
    let mut scores = vec![0.0; fit.corners.len()];
    for part in 0..PARTS {
        let of = |out: bool| -> (Vec<usize>, Vec<Vec<Corner>>, Vec<_>) {
            let those: Vec<usize> = (0..fit.corners.len()).filter(|i| (i % PARTS == part) == out).collect();
            let corners = those.iter().map(|&i| fit.corners[i].clone()).collect();
            let poses = those.iter().map(|&i| solution.state.1[i]).collect();
            (those, corners, poses)
        };
        let (_, corners, poses) = of(false);
        let camera = Fit { corners: &corners, ..*fit }.fine(held, (solution.state.0, poses)).state.0;
        let (those, corners, poses) = of(true);
        let placed = Fit { corners: &corners, ..*fit }.fine(&all, (camera, poses));
        let mut lengths = placed.lengths.iter();
        for (i, corners) in those.into_iter().zip(&corners) {
            let sum: f64 = lengths.by_ref().take(corners.len()).map(|r| (r * r).min(far)).sum();
            scores[i] = sum / corners.len() as f64;
        }
    }
    scores
}

/// Share by which the second scores are lower; `None` where picture against picture that is not sure or not worth it.
fn gain(plain: &[f64], more: &[f64]) -> Option<f64> {
    let n = plain.len() as f64;
    let lower: Vec<f64> = plain.iter().zip(more).map(|(a, b)| a - b).collect();
    let mean = lower.iter().sum::<f64>() / n;
    let error = (lower.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
    let all = plain.iter().sum::<f64>() / n;
    (mean > SURE * error && mean > WORTH * all).then(|| mean / all)
}
