//! In: pairs of an expected and an observed value, from comparisons of each line of a cloud with the lines before
//! and after it. Out: the ratio of observed to expected, unaffected by steps and edges of the part in some of the
//! pairs.
//! Frame and unit: the caller's; docs/math.md, Places that scatter (5).

use crate::solve::robust_scale;

/// A slope is significant from this many of its standard deviations on.
const SURE: f64 = 4.0;
/// Factor by which the slope's standard deviation exceeds that of as many independent comparisons: neighbouring
/// comparisons share two of three shots, and those of a line share their shot.
const SHARED: f64 = 2.0;
/// Residual at which a comparison's weight falls to zero, in deviations: Tukey's biweight.
const FAR: f64 = 4.7;
const ROUNDS: usize = 20;

/// Ratio of observed to expected.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    pub is: f64,
    /// Standard deviation of the ratio.
    pub sigma: f64,
}

impl Slope {
    /// Whether the expected effect was observed at all.
    pub fn sure(&self) -> bool {
        self.is > SURE * self.sigma
    }
}

/// Fits pairs (expected, observed); `None` if nothing was expected.
pub(super) fn slope(pairs: &[[f64; 2]]) -> Option<Slope> {
    let rest = |slope: f64| move |[expected, seen]: &[f64; 2]| seen - slope * expected;
    let mut slope = middle(pairs)?;
    let mut rests: Vec<f64> = pairs.iter().map(rest(slope)).map(f64::abs).collect();
    let width = FAR * robust_scale(&mut rests, 1);
    let weight = |rest: f64| if rest.abs() < width { (1.0 - (rest / width).powi(2)).powi(2) } else { 0.0 };
    let (mut square, mut left) = (0.0, 0.0);
    for _ in 0..ROUNDS {
        let mut across = 0.0;
        (square, left) = (0.0, 0.0);
        for pair in pairs {
            let r = rest(slope)(pair);
            let w = weight(r);
            square += w * pair[0] * pair[0];
            across += w * pair[0] * pair[1];
            left += (w * pair[0] * r).powi(2);
        }
        if square <= 0.0 {
            return None;
        }
        slope = across / square;
    }
    Some(Slope { is: slope, sigma: SHARED * left.sqrt() / square })
}

/// The slope with the least sum of absolute residuals: a median of the single slopes, each weighted by its expected
/// value.
fn middle(pairs: &[[f64; 2]]) -> Option<f64> {
    let mut all: Vec<(f64, f64)> =
        pairs.iter().filter(|p| p[0] != 0.0).map(|[expected, seen]| (seen / expected, expected.abs())).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * all.iter().map(|a| a.1).sum::<f64>();
    let mut sum = 0.0;
    all.into_iter()
        .find(|(_, weight)| {
            sum += weight;
            sum >= half
        })
        .map(|a| a.0)
}
