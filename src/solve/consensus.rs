//! In: a way to fit a model to a few samples and to measure its misfit, and a seed. Out: the model that most samples
//! agree with, and the indices of these samples.
//! Frame and unit: none; misfits in the unit of the threshold.

use crate::fault::{Fault, Result};
use rand::SeedableRng;

/// Settings of [`consensus`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConsensusOptions {
    /// Misfit below which a sample agrees with the model; positive.
    pub threshold: f64,
    /// Required probability that at least one clean set is drawn; 0.5..1.
    pub confidence: f64,
    /// Most draws; 1..=1_000_000.
    pub max_draws: usize,
    /// The same seed gives the same result.
    pub seed: u64,
}

impl Default for ConsensusOptions {
    fn default() -> Self {
        ConsensusOptions { threshold: 1.0, confidence: 0.9999, max_draws: 5000, seed: 1 }
    }
}

impl ConsensusOptions {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        if !(self.threshold > 0.0)
            || !(0.5..1.0).contains(&self.confidence)
            || !(1..=1_000_000).contains(&self.max_draws)
        {
            return Err(Fault::usage(format!(
                "consensus options out of range: threshold {} (above 0), confidence {} (0.5 to 1), max_draws {} (1 \
                 to 1000000)",
                self.threshold, self.confidence, self.max_draws
            ))
            .next("choose values in these ranges"));
        }
        Ok(())
    }
}

/// The winner of a [`consensus`].
#[derive(Clone, Debug)]
pub struct Consensus<M> {
    /// The model that `fit` made of the best draw; it is not fitted to the inliers.
    pub model: M,
    /// Indices of the samples that agree, ascending.
    pub inliers: Vec<usize>,
    /// Number of sets that were drawn, degenerate ones included.
    pub draws: usize,
}

/// RANSAC \[fischler81\] with truncated squared misfits as score (MSAC) and a number of draws that adapts to the share
/// of inliers. `fit` gets `size` different indices and returns `None` for degenerate ones.
pub fn consensus<M>(
    count: usize,
    size: usize,
    options: &ConsensusOptions,
    fit: impl Fn(&[usize]) -> Option<M>,
    misfit: impl Fn(&M, usize) -> f64,
) -> Option<Consensus<M>> {
    if count < size {
        return None;
    }
    let mut rng = rand_pcg::Pcg64::seed_from_u64(options.seed);
    let limit = options.threshold * options.threshold;
    let (mut best, mut best_score) = (None, f64::INFINITY);
    let (mut draws, mut needed) = (0, options.max_draws);
    while draws < needed.min(options.max_draws) {
        draws += 1;
        let chosen = rand::seq::index::sample(&mut rng, count, size).into_vec();
        let Some(model) = fit(&chosen) else { continue };
        let (mut score, mut agree) = (0.0, 0usize);
        for i in 0..count {
            let m = misfit(&model, i);
            // NaN counts as disagreement.
            if m * m < limit {
                agree += 1;
                score += m * m;
            } else {
                score += limit;
            }
        }
        if score < best_score {
            best_score = score;
            best = Some(model);
            needed = draws_needed((agree as f64 / count as f64).powi(size as i32), options.confidence);
        }
    }
    let model = best?;
    let inliers = (0..count).filter(|&i| misfit(&model, i).abs() < options.threshold).collect();
    Some(Consensus { model, inliers, draws })
}

/// Number of draws that give one clean set with this probability, if the share `clean` of all sets is clean. `ln_1p`
/// keeps the digits of a share that 1 - clean would round away: without it a share below 1e-16 would need no draw at
/// all.
fn draws_needed(clean: f64, confidence: f64) -> usize {
    if clean >= 1.0 - 1e-12 {
        return 0;
    }
    ((-confidence).ln_1p() / (-clean).ln_1p()).ceil().min(1e9) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::Rng;

    #[test]
    fn a_line_is_found_among_noise_and_the_seed_decides() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(9);
        let points: Vec<(f64, f64)> = (0..200)
            .map(|i| {
                let x = f64::from(i) * 0.1;
                if i % 5 < 2 { (x, rng.random::<f64>() * 20.0) } else { (x, 0.5 * x + 3.0) }
            })
            .collect();
        let run = |seed| {
            consensus(
                points.len(),
                2,
                &ConsensusOptions { threshold: 0.05, seed, ..Default::default() },
                |c| {
                    let (a, b) = (points[c[0]], points[c[1]]);
                    let slope = (b.1 - a.1) / (b.0 - a.0);
                    slope.is_finite().then_some((slope, a.1 - slope * a.0))
                },
                |m, i| m.0 * points[i].0 + m.1 - points[i].1,
            )
            .unwrap()
        };
        let found = run(4);
        assert!((found.model.0 - 0.5).abs() < 1e-9 && (found.model.1 - 3.0).abs() < 1e-9);
        assert!(found.inliers.len() >= 120 && found.inliers == run(4).inliers);
    }

    #[test]
    fn a_first_draw_with_which_nothing_agrees_does_not_end_the_search() {
        assert_eq!(draws_needed(1.0, 0.9999), 0);
        assert_eq!(draws_needed(0.5, 0.9999), 14);
        for rare in [1e-9, 1e-17, 1e-300, 0.0] {
            assert_eq!(draws_needed(rare, 0.9999), 1_000_000_000, "{rare}");
        }
        // Only the model 7 fits; one draw in forty gives it.
        let options = ConsensusOptions { threshold: 0.5, seed: 3, ..Default::default() };
        let misfit = |m: &usize, _: usize| if *m == 7 { 0.1 } else { 9.0 };
        let found = consensus(40, 1, &options, |c| Some(c[0]), misfit).unwrap();
        assert_eq!((found.model, found.inliers.len()), (7, 40));
    }
}
