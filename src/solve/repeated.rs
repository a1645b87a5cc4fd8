//! Finds numbers that too many measurements share to be measured values, so that they may stand for "not measured": 0,
//! -9999, 999.999.

use rayon::slice::ParallelSliceMut;

/// Fewer equal numbers can occur by chance.
const LEAST: usize = 8;
/// A file uses at most this many numbers for missing measurements.
const AT_MOST: usize = 3;
/// How many times as often as the most frequent number after the first `AT_MOST` a number must occur to be suspect.
const OFTEN: usize = 8;
/// Least share of all numbers, for a suspect number that lies among the others.
const SHARE: f64 = 0.002;
/// How many times as far away as the others reach a lone number on one side of them must lie to be suspect.
const APART: f64 = 3.0;

/// Numbers that may stand for a missing one, with their counts, the most frequent first. A flat surface that was
/// computed, not measured, looks the same: the result is a reason to ask, not to drop data.
pub fn repeated(values: impl Iterator<Item = f64>) -> Vec<(f64, usize)> {
    let mut sorted: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    sorted.par_sort_unstable_by(f64::total_cmp);
    let mut runs: Vec<(f64, usize)> = sorted.chunk_by(|a, b| a == b).map(|run| (run[0], run.len())).collect();
    // An end is alone if its gap to the next number exceeds `APART` times the range of the others.
    let (n, all) = (runs.len(), sorted.len());
    let alone = |end: usize, next: usize, other: usize| {
        let (gap, rest) = ((runs[end].0 - runs[next].0).abs(), (runs[next].0 - runs[other].0).abs());
        rest > 0.0 && gap > APART * rest && runs[end].1 > 1
    };
    let mut ends = vec![];
    if n > 2 {
        ends.extend(alone(0, 1, n - 1).then(|| runs[0]));
        ends.extend(alone(n - 1, n - 2, 0).then(|| runs[n - 1]));
    }
    runs.sort_unstable_by_key(|run| std::cmp::Reverse(run.1));
    if let Some(usual) = runs.get(AT_MOST) {
        let least = LEAST.max((SHARE * all as f64) as usize).max(OFTEN * usual.1);
        ends.extend(runs[..AT_MOST].iter().filter(|run| run.1 >= least));
        ends.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        ends.dedup();
    }
    ends.sort_by_key(|run| std::cmp::Reverse(run.1));
    ends
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn stand_ins_are_seen_and_measurements_are_not_suspected() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(5);
        let mut noise = |middle: f64, half: f64| middle + half * (2.0 * rng.random::<f64>() - 1.0);
        for (stand_in, count) in [(0.0, 60), (-9999.0, 24), (999.999, 960), (-99.9999, 2), (5.1, 30), (-32_768.0, 3)] {
            let values: Vec<f64> = (0..1200).map(|i| if i < count { stand_in } else { noise(5.0, 0.5) }).collect();
            assert_eq!(repeated(values.into_iter()), [(stand_in, count)], "{count} of {stand_in}");
        }
        // Two stand-ins at once; steps of a coarse sensor with a missing level far from them.
        let two = (0..1000).map(|i| [0.0, -9999.0, noise(300.0, 10.0)][(i % 10).min(2)]).collect::<Vec<_>>();
        assert_eq!(repeated(two.into_iter()), [(-9999.0, 100), (0.0, 100)]);
        let near = (0..1000).map(|i| [0.0, 1.0, noise(1.0, 3.0)][(i % 10).min(2)]).collect::<Vec<_>>();
        assert_eq!(repeated(near.into_iter()), [(0.0, 100), (1.0, 100)]);
        let coarse =
            (0..1000).map(|i| if i % 9 == 0 { -32_768.0 } else { noise(50.0, 5.0).round() }).collect::<Vec<_>>();
        assert_eq!(repeated(coarse.into_iter()), [(-32_768.0, 112)]);
        // Measured: noise, steps of a coarse sensor, a plate with two heights, one flat height.
        let fine = (0..1000).map(|_| noise(5.0, 0.5)).collect::<Vec<_>>();
        let steps = (0..1000).map(|_| noise(5.0, 40.0).round()).collect::<Vec<_>>();
        let plate = (0..1000).map(|i| f64::from(u8::from(i % 3 == 0))).collect::<Vec<_>>();
        for measured in [fine, steps, plate, vec![2.0; 1000], vec![], vec![1.0]] {
            assert_eq!(repeated(measured.into_iter()), []);
        }
    }
}
