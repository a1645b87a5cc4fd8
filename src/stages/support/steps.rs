//! In: a shot's line of peaks. Out: how far each may lie from the surface, where it lies between two.
//! Frame and unit: pixels of the shot; docs/math.md, Stripe peak (11).
//!
//! A fit adds up light along the stripe. Over a small step of the surface the stripe goes on without a gap, and the
//! centres there lie between both sides, on neither. A straight line through the points of each side, a little away,
//! says where its surface would be. On slopes and round parts both say the same, or the point does not lie between.

use super::line::Line;
use crate::stages::peak::found::Peak;

/// A side's points lie at this distance and farther, in the stripe's sigmas, and at least this many px: nearer ones
/// contain the other side's light.
const FROM: f32 = 2.0;
const FROM_PX: f32 = 1.5;
/// The side's points lie over this length, in the stripe's sigmas, and at least this many px.
const OVER: f32 = 2.0;
const OVER_PX: f32 = 3.0;
/// A side's points are off their straight line by this share of the step at most, rms: farther steps of narrow parts
/// are no surface.
const STRAIGHT: f32 = 0.1;
/// Times its variance that a squared distance has to exceed before the rest of it counts: noise alone seldom does.
const SURE: f32 = 2.0;
/// Least sum of squared distances from their middle, px²: two points a pixel apart.
const SPREAD: f32 = 0.499;

/// Distance of each peak of a line from the nearer side's surface, px, without what noise makes of it; 0 where it does
/// not lie between two. `width_px` is the stripe's Gaussian sigma.
pub(super) fn shifts(peaks: &[Peak], line: &Line, width_px: f32) -> impl Iterator<Item = f32> {
    let from = (FROM * width_px).max(FROM_PX);
    let to = from + (OVER * width_px).max(OVER_PX);
    (0..line.len()).map(move |i| {
        let [Some(left), Some(right)] = [-1, 1].map(|step| surface(peaks, line, i, step, [from, to])) else {
            return 0.0;
        };
        let bent = (STRAIGHT * (left.off - right.off)).powi(2);
        if left.off * right.off >= 0.0 || left.bent.max(right.bent) > bent {
            return 0.0;
        }
        let nearer = if left.off.abs() < right.off.abs() { left } else { right };
        let noise = nearer.variance + peaks[line.peak(i)].sigma_px.powi(2);
        (nearer.off * nearer.off - SURE * noise).max(0.0).sqrt()
    })
}

/// Where one side's surface would be.
struct Surface {
    /// Distance from the peak across the stripe, px.
    off: f32,
    /// Its variance, px².
    variance: f32,
    /// Mean square of its points' distances from it, less their noise, px².
    bent: f32,
}

/// The straight line through the points of one side, at the `i`-th peak; none where too few are there.
fn surface(peaks: &[Peak], line: &Line, i: usize, step: isize, [from, to]: [f32; 2]) -> Option<Surface> {
    let entry = |j: usize| [line.way(i, j).abs(), line.off(i, j), peaks[line.peak(j)].sigma_px.powi(2)];
    let side: Vec<[f32; 3]> = line.along(i, step, to).map(entry).filter(|[x, ..]| *x >= from).collect();
    let n = side.len() as f32;
    let middle = side.iter().map(|[x, ..]| x).sum::<f32>() / n;
    let spread: f32 = side.iter().map(|[x, ..]| (x - middle).powi(2)).sum();
    if side.len() < 2 || spread < SPREAD {
        return None;
    }
    let slope = side.iter().map(|[x, y, _]| (x - middle) * y).sum::<f32>() / spread;
    let off = side.iter().map(|[_, y, _]| y).sum::<f32>() / n - slope * middle;
    // Weight of each point in the line's value at distance 0.
    let weight = |x: f32| 1.0 / n - middle * (x - middle) / spread;
    let variance = side.iter().map(|[x, _, v]| weight(*x).powi(2) * v).sum();
    let bent = side.iter().map(|[x, y, v]| (y - off - slope * x).powi(2) - v * (n - 2.0) / n).sum::<f32>() / n;
    Some(Surface { off, variance, bent })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    const STRIPE: f32 = 0.7;
    const SIGMA: f32 = 0.02;

    /// A line of peaks a pixel apart along a direction, this far across it.
    fn shifts_of(along: Vec2, offs: &[f32], width_px: f32) -> Vec<f32> {
        let peak = |(i, off): (usize, &f32)| {
            let at = Vec2::new(200.0, 300.0) + along * i as f32 + along.perp() * *off;
            Peak { u: at.x, v: at.y, width_px, sigma_px: SIGMA, ..Peak::default() }
        };
        let peaks: Vec<Peak> = offs.iter().enumerate().map(peak).collect();
        // The line's order is that of the peaks.
        shifts(&peaks, &Line::new(&peaks, -along.perp()), width_px).collect()
    }

    /// A step of 0.5 px that is smoothed over three pixels, on a surface that is itself inclined.
    #[test]
    fn what_lies_on_a_small_step_may_be_off_by_its_distance_from_the_nearer_side() {
        let step = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.25, 0.45, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5];
        for (degrees, slope) in [(0.0f32, 0.0), (42.0, 0.3), (90.0, -0.2), (135.0, 0.1)] {
            let along = Vec2::from_angle(degrees.to_radians());
            let offs: Vec<f32> = step.iter().enumerate().map(|(i, s)| s + slope * i as f32).collect();
            let found = shifts_of(along, &offs, STRIPE);
            for (i, want) in [(6, 0.1f32), (7, 0.25), (8, 0.05)] {
                // Three points 2, 3 and 4 px away: the line's variance at the peak is 29/6 of a point's.
                let noise = SURE * SIGMA * SIGMA * (1.0 + 29.0 / 6.0);
                let want = (want * want - noise).max(0.0).sqrt();
                assert!((found[i] - want).abs() < 2e-3, "{degrees} degrees: {i} is {} for {want}", found[i]);
            }
            assert!(found[..4].iter().chain(&found[12..]).all(|s| *s == 0.0), "{degrees}: {found:?}");
        }
    }

    /// Slopes, kinks, round and narrow parts, and the ends of a line: nothing lies between two surfaces there.
    #[test]
    fn shapes_are_no_steps() {
        let shapes: [fn(f32) -> f32; 5] = [
            |x| 0.8 * x,
            |x| 0.3 * x.abs(),
            |x| 0.05 * x * x,
            |x| if x.abs() < 1.5 { 2.0 } else { 0.0 },
            |x| (16.0 - x * x * 0.1).sqrt(),
        ];
        for (n, shape) in shapes.iter().enumerate() {
            let offs: Vec<f32> = (-10..=10).map(|i| shape(i as f32)).collect();
            let found = shifts_of(Vec2::X, &offs, STRIPE);
            assert!(found.iter().all(|s| *s == 0.0), "shape {n}: {found:?}");
        }
        assert_eq!(shifts_of(Vec2::X, &[0.0, 0.3], STRIPE), [0.0; 2]);
    }

    /// Of a wide stripe the fit adds up light over more pixels, so its sides begin farther away.
    #[test]
    fn a_wide_stripe_smooths_a_step_over_more_pixels() {
        let offs: Vec<f32> = (-30..=30).map(|i| 2.0 / (1.0 + (-i as f32 / 1.8).exp())).collect();
        let found = shifts_of(Vec2::X, &offs, 4.0);
        assert!((found[30] - 1.0).abs() < 0.08, "{}", found[30]);
        assert!(found[..8].iter().chain(&found[53..]).all(|s| *s == 0.0), "{found:?}");
    }

    /// Noise alone adds a fortieth to the square of a sigma.
    #[test]
    fn noise_is_no_step() {
        let mut seed = 7u32;
        let mut uniform = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        let offs: Vec<f32> = (0..4000).map(|_| SIGMA * ((0..12).map(|_| uniform()).sum::<f32>() - 6.0)).collect();
        let found = shifts_of(Vec2::X, &offs, STRIPE);
        let square = found.iter().map(|s| (s / SIGMA).powi(2)).sum::<f32>() / 4000.0;
        assert!(square < 0.06, "{square}");
    }
}
