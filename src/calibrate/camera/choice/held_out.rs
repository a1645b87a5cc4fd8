//! In: two models of a camera and its boards. Out: whether held-out pictures fit better with the second.
//! Frame and unit: squares of the corners' sigmas. docs/math.md, Camera calibration (10).

use crate::calibrate::camera::bundle::{Corner, State};
use crate::calibrate::camera::fit::Fit;
use crate::solve::Solution;

/// Number of parts in which pictures are held out.
const PARTS: usize = 4;
/// The held-out pictures must fit better by this many standard errors.
const SURE: f64 = 3.0;
/// The same for a model that does no harm if it is added without need.
const LIKELY: f64 = 2.0;
/// Smallest decrease of the squared residuals, as a share. A smaller decrease, however significant, is attributed to
/// the corners. In photographs taken with a plain lens, rational terms explain 0.5 to 2 % at three standard errors.
pub(super) const WORTH: f64 = 0.02;
/// Residuals are cut off at this many sigmas.
const FAR: f64 = 3.0;

/// Mean squared residual of each picture, in squares of the corners' sigmas, with the camera and shape solved from
/// other pictures and its own pose. `sigma0` is the plainest model's, so that all models have the same cut-off.
pub(super) fn held_out(fit: &Fit<'_>, solution: &Solution<State>, held: &[usize], sigma0: f64) -> Vec<f64> {
    let far = (FAR * sigma0).powi(2);
    let mut scores = vec![0.0; fit.corners.len()];
    for part in 0..PARTS {
        let of = |out: bool| -> (Vec<usize>, Vec<Vec<Corner>>, Vec<_>) {
            let those: Vec<usize> = (0..fit.corners.len()).filter(|i| (i % PARTS == part) == out).collect();
            let corners = those.iter().map(|&i| fit.corners[i].clone()).collect();
            let poses = those.iter().map(|&i| solution.state.poses[i]).collect();
            (those, corners, poses)
        };
        let (_, corners, poses) = of(false);
        let others = Fit { corners: &corners, ..*fit }.rough(held, State { poses, ..solution.state.clone() });
        let (those, corners, poses) = of(true);
        let placed = others.and_then(|o| Fit { corners: &corners, ..*fit }.placed(State { poses, ..o.state }));
        let Some(placed) = placed else { continue };
        let mut lengths = placed.lengths.iter();
        for (i, corners) in those.into_iter().zip(&corners) {
            let sum: f64 = lengths.by_ref().take(corners.len()).map(|r| (r * r).min(far)).sum();
            scores[i] = sum / corners.len() as f64;
        }
    }
    scores
}

/// Share by which the second scores are lower; `None` if, compared picture by picture, the decrease is not
/// significant or too small.
pub(super) fn gain(plain: &[f64], more: &[f64]) -> Option<f64> {
    let n = plain.len() as f64;
    let lower: Vec<f64> = plain.iter().zip(more).map(|(a, b)| a - b).collect();
    let mean = lower.iter().sum::<f64>() / n;
    let error = (lower.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
    let all = plain.iter().sum::<f64>() / n;
    (mean > SURE * error && mean > WORTH * all).then(|| mean / all)
}

/// True if the second scores are significantly lower, compared picture by picture as ratios.
pub(super) fn surely_lower(plain: &[f64], more: &[f64]) -> bool {
    let n = plain.len() as f64;
    let factors: Vec<f64> = plain.iter().zip(more).map(|(a, b)| (a / b).ln()).collect();
    let mean = factors.iter().sum::<f64>() / n;
    let error = (factors.iter().map(|f| (f - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt();
    mean > LIKELY * error && mean > WORTH
}
