//! In: a height map's values, missing cells among them. Out: the same without spikes, small gaps filled. A spike makes
//! a ring of strong edges, and a gap on an edge hides it: both are the sensor's and not the part's.
//! Frame and unit: cells, row by row; mm.

use rayon::prelude::*;

/// The neighbours of a cell; the fourth after one lies opposite it.
const RING: [(isize, isize); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];
/// Neighbours that must be there before a cell is called a spike. At a corner of the map there are three, and on a
/// slope the corner is the highest or lowest of all.
const FEWEST: usize = 5;
/// A spike lies outside the quartiles of its neighbours by more than this many times the quartiles' distance. On a
/// level with normal noise that is 4.7 sigma. On a step the quartiles are as far apart as the step is high.
const FENCE: f32 = 3.0;
/// A cell is no spike if this many neighbours are like it: it then belongs to a narrow line.
const LIKE_ITSELF: usize = 2;
/// A missing cell is filled if it has this many measured neighbours. A cell at the rim of a wide gap has only three.
const ENOUGH: usize = 5;
/// Gaps up to this many cells wide are filled from both sides.
const ROUNDS: usize = 2;

/// Removes spikes, then fills small gaps.
pub(super) fn mended(values: &[f32], width: usize) -> Vec<f32> {
    let mut values = changed(values, width, |z, ring| if is_spike(z, ring) { f32::NAN } else { z });
    for _ in 0..ROUNDS {
        values = changed(&values, width, |z, ring| if z.is_nan() { between(ring) } else { z });
    }
    values
}

/// What `each` makes of every cell and its neighbours; beyond the map they are missing.
fn changed(values: &[f32], width: usize, each: impl Fn(f32, &[f32; 8]) -> f32 + Sync) -> Vec<f32> {
    let height = values.len() / width;
    let mut out = vec![0.0; values.len()];
    out.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let ring = RING.map(|(dx, dy)| match (x.checked_add_signed(dx), y.checked_add_signed(dy)) {
                (Some(x), Some(y)) if x < width && y < height => values[y * width + x],
                _ => f32::NAN,
            });
            *out = each(values[y * width + x], &ring);
        }
    });
    out
}

fn is_spike(z: f32, ring: &[f32; 8]) -> bool {
    let mut there = *ring;
    // Missing neighbours come last.
    there.sort_unstable_by(f32::total_cmp);
    let n = there.iter().filter(|v| !v.is_nan()).count();
    if z.is_nan() || n < FEWEST {
        return false;
    }
    let [low, middle, high] = [1, 2, 3].map(|quarter| there[quarter * (n - 1) / 4]);
    let fence = FENCE * (high - low);
    let alike = there[..n].iter().filter(|v| (*v - z).abs() < (*v - middle).abs()).count();
    !(low - fence..=high + fence).contains(&z) && alike < LIKE_ITSELF
}

/// The mean of the two opposite neighbours that differ least, so that a step stays a step; missing where too few are
/// there.
fn between(ring: &[f32; 8]) -> f32 {
    if ring.iter().filter(|v| !v.is_nan()).count() < ENOUGH {
        return f32::NAN;
    }
    let pairs = (0..4).map(|k| (ring[k], ring[k + 4])).filter(|(a, b)| !a.is_nan() && !b.is_nan());
    let best = pairs.min_by(|a, b| (a.0 - a.1).abs().total_cmp(&(b.0 - b.1).abs()));
    best.map_or(f32::NAN, |(a, b)| 0.5 * (a + b))
}

#[cfg(test)]
mod tests {
    use super::*;

    const W: usize = 20;

    fn map(f: impl Fn(usize, usize) -> f32) -> Vec<f32> {
        (0..W * W).map(|i| f(i % W, i / W)).collect()
    }

    /// A step along a slanted line, on a slope.
    fn step(x: usize, y: usize) -> f32 {
        0.01 * x as f32 + if 2 * x > y + 12 { 1.5 } else { 0.0 }
    }

    #[test]
    fn steps_and_lines_of_one_cell_stay_as_they_are() {
        let line = map(|x, y| step(x, y) + if y == 7 { 0.8 } else { 0.0 });
        let changed: Vec<usize> =
            mended(&line, W).iter().zip(&line).enumerate().filter(|(_, (a, b))| a != b).map(|c| c.0).collect();
        // Only the line's ends at the rim of the map: there a single neighbour is like them.
        assert_eq!(changed, [7 * W, 8 * W - 1]);
    }

    #[test]
    fn a_spike_goes_and_its_cell_gets_its_surfaces_height() {
        let spiked = map(|x, y| step(x, y) + if (x, y) == (4, 9) || (x, y) == (14, 3) { 0.6 } else { 0.0 });
        let (got, wanted) = (mended(&spiked, W), map(step));
        assert!(got.iter().zip(&wanted).all(|(a, b)| (a - b).abs() < 1e-5));
    }

    #[test]
    fn small_gaps_are_filled_on_a_step_too_and_wide_ones_stay() {
        let small = |x: usize, y: usize| (x * 3 + y * 5).is_multiple_of(11);
        let wide = |x: usize, y: usize| (12..18).contains(&x) && (10..16).contains(&y);
        let holed = map(|x, y| if small(x, y) || wide(x, y) { f32::NAN } else { step(x, y) });
        let got = mended(&holed, W);
        let mut filled = 0;
        for (i, (a, b)) in got.iter().zip(map(step)).enumerate() {
            let (x, y) = (i % W, i / W);
            let rim = x == 0 || y == 0 || x == W - 1 || y == W - 1;
            if (13..17).contains(&x) && (11..15).contains(&y) {
                assert!(a.is_nan(), "the middle of the wide gap at {x} {y} is {a}");
            } else if small(x, y) && !rim && !(11..19).contains(&x) {
                // Beside a step a filled cell is on one of its sides, or between them.
                let near = (0.01 * x as f32 - 0.02..=0.01 * x as f32 + 1.52).contains(a);
                assert!(near, "{a} at {x} {y}");
                filled += usize::from((a - b).abs() < 1e-4);
            }
        }
        assert!(filled > 10, "{filled} cells got their height");
    }
}
