//! Fit of pairs of robot poses and pictures relative to random permutations of the poses.

use super::closed::{Pair, park_martin};
use rand::{SeedableRng, seq::SliceRandom};

/// Randomly permuted poses fit a chain too, badly. Pairs whose misfit is above this share of the best of `DEALS`
/// permutations count as fitting by chance. 1200 shuffled sets of 6 to 25 pairs give 0.56 and more. Robots that
/// scatter by 2 mm and 1 degree give 0.33 and less, and once in 1200 more sets 0.47
/// (tests/calibrate/hand_eye_judge.rs, its long form).
pub const BY_CHANCE: f64 = 0.5;
const DEALS: u64 = 20;

/// Misfit of the pairs as a share of the smallest misfit of random permutations of their poses.
pub fn chance(pairs: &[&Pair], seed: u64) -> f64 {
    let deal = |k: u64| {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.shuffle(&mut rand_pcg::Pcg64::seed_from_u64(seed.wrapping_add(k)));
        let dealt: Vec<Pair> = order.iter().zip(pairs).map(|(&i, p)| p.at(pairs[i].near_from_far)).collect();
        // A permutation that leaves more than a third of the poses in place is no sample of chance.
        let stayed = order.iter().enumerate().filter(|(i, k)| i == *k).count();
        if stayed * 3 > pairs.len() { None } else { misfit(&dealt.iter().collect::<Vec<_>>()) }
    };
    let best = (0..DEALS).filter_map(deal).fold(f64::INFINITY, f64::min);
    misfit(pairs).map_or(f64::INFINITY, |m| m / best)
}

/// Square root of the sum of squared misfits of the pairs to the closed form on all of them.
pub fn misfit(pairs: &[&Pair]) -> Option<f64> {
    let chain = park_martin(pairs)?;
    Some(pairs.iter().map(|p| chain.misfit(p).powi(2)).sum::<f64>().sqrt())
}
