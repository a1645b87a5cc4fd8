//! In: a shot's line of peaks. Out: how far the brightness of the surface may have shifted each.
//! Frame and unit: pixels of the shot; docs/math.md, Stripe peak (9) and (10).
//!
//! The sheet is a bell of light. A surface that grows brighter across it moves the light's middle to its brighter side,
//! by the sheet's variance times the slope of the light's logarithm [curless95]. One shot shows this slope along the
//! stripe only. Print and edges have any direction, so across it is taken to be as large, of either sign.

use super::line::{Line, near_px};
use crate::stages::peak::found::Peak;

/// Variance of a picture's own blur, px²: a pixel's 1/12 and a lens that blurs by half a pixel. The rest of a stripe's
/// variance is the sheet's.
const BLUR: f32 = 0.35;
/// Variance of the light's logarithm over that of the centre in the stripe's sigmas, for the same fit. Fits of three
/// unknowns have 0.75 for read noise, 1.5 for shot noise and up to 4.6 for speckle. On even surfaces 2 to 2.8 was
/// measured, and twice as much is held to be noise, so that it seldom counts as a slope.
const NOISE: f32 = 5.6;
/// The slope is that over the stripe's sigma to both sides, and at least over this, px.
const LEAST_PX: f32 = 1.5;

/// Standard deviation of that shift for each peak of a line, px; `width_px` is the stripe's Gaussian sigma.
pub(super) fn shifts(peaks: &[Peak], line: &Line, width_px: f32) -> impl Iterator<Item = f32> {
    let sheet = (width_px * width_px - BLUR).max(0.0);
    // Light that ends beside the sheet's middle moves it by the sheet's sigma at most.
    (0..line.len()).map(move |i| sheet * slope(peaks, line, i, width_px).min(sheet.sqrt().recip()))
}

/// Size of the slope of the light's logarithm along the stripe at the `i`-th peak, 1/px, without what noise makes of
/// an even surface; 0 where a neighbour's fit states no finite sigma. A straight line is fitted by least squares, with
/// less weight for farther neighbours.
fn slope(peaks: &[Peak], line: &Line, i: usize, width_px: f32) -> f32 {
    let reach = width_px.max(LEAST_PX);
    let sides = [-1, 1].into_iter().flat_map(|step| line.beside(i, step, near_px(width_px)));
    let near = std::iter::once(i).chain(sides).filter(|&j| line.way(i, j).abs() <= reach);
    // Weight, distance, logarithm of the light and its variance.
    let entry = |j: usize| {
        let k = &peaks[line.peak(j)];
        let x = line.way(i, j);
        let noise = NOISE * (k.sigma_px / k.width_px).powi(2);
        [(-2.0 * (x / reach).powi(2)).exp(), x, k.amplitude.max(f32::MIN_POSITIVE).ln(), noise]
    };
    let near: Vec<[f32; 4]> = near.map(entry).collect();
    let sum = |of: &dyn Fn(&[f32; 4]) -> f32| near.iter().map(of).sum::<f32>();
    let all = sum(&|e| e[0]);
    let [middle, light] = [1, 2].map(|n| sum(&|e| e[0] * e[n]) / all);
    let spread = sum(&|[w, x, ..]| w * (x - middle).powi(2));
    if spread <= f32::EPSILON {
        return 0.0;
    }
    let slope = sum(&|[w, x, l, _]| w * (x - middle) * (l - light)) / spread;
    let noise = sum(&|[w, x, _, v]| (w * (x - middle)).powi(2) * v) / (spread * spread);
    (slope * slope - noise).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::peak::found::Reject;
    use glam::Vec2;

    const STRIPE: f32 = 2.0;
    const SIGMA: f32 = 0.01;

    /// Peaks a pixel apart along a direction with these amplitudes.
    fn peaks(along: Vec2, amplitudes: &[f32]) -> Vec<Peak> {
        let peak = |(i, &amplitude): (usize, &f32)| {
            let at = Vec2::new(200.0, 300.0) + along * i as f32;
            Peak { u: at.x, v: at.y, amplitude, width_px: STRIPE, sigma_px: SIGMA, ..Peak::default() }
        };
        amplitudes.iter().enumerate().map(peak).collect()
    }

    fn shifts_of(peaks: &[Peak], across: Vec2, width_px: f32) -> Vec<f32> {
        shifts(peaks, &Line::new(peaks, across), width_px).collect()
    }

    /// Light that grows by 5 % a pixel: the sheet's variance is 4 px² less the blur.
    #[test]
    fn a_slope_of_the_light_shifts_by_the_sheets_variance() {
        for degrees in [0.0f32, 42.0, 90.0, 135.0] {
            let along = Vec2::from_angle(degrees.to_radians());
            let amplitudes: Vec<f32> = (0..30).map(|i| 50.0 * (0.05 * i as f32).exp()).collect();
            let found = shifts_of(&peaks(along, &amplitudes), -along.perp(), STRIPE);
            for shift in &found[2..28] {
                assert!((shift / (3.65 * 0.05) - 1.0).abs() < 0.01, "{degrees} degrees: {shift}");
            }
        }
    }

    /// An even surface has none. Of Gaussian noise the slope's variance is 0.1675 of a light's here, and of its square
    /// stays what is above its expectation: half.
    #[test]
    fn noise_of_an_even_surface_is_no_slope() {
        assert!(shifts_of(&peaks(Vec2::X, &[80.0; 20]), -Vec2::Y, STRIPE).iter().all(|s| *s == 0.0));
        let mut seed = 1u32;
        let mut uniform = move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0
        };
        let noisy: Vec<f32> = (0..4000)
            .map(|_| 80.0 * (NOISE.sqrt() * SIGMA / STRIPE * ((0..12).map(|_| uniform()).sum::<f32>() - 6.0)).exp())
            .collect();
        let found = shifts_of(&peaks(Vec2::X, &noisy), -Vec2::Y, STRIPE);
        let square = found.iter().map(|s| (s / SIGMA).powi(2)).sum::<f32>() / 4000.0;
        let whole = 0.1675 * NOISE * (3.65 / STRIPE).powi(2);
        assert!((0.4..0.56).contains(&(square / whole)), "{}", square / whole);
    }

    /// Where print ends from one pixel to the next the shift is the sheet's sigma at most, a few sigmas away nothing.
    #[test]
    fn an_edge_of_print_shifts_only_beside_it_and_not_without_limit() {
        let amplitudes: Vec<f32> = (0..40).map(|i| if i < 20 { 2.0 } else { 200.0 }).collect();
        let found = shifts_of(&peaks(Vec2::X, &amplitudes), -Vec2::Y, STRIPE);
        assert!((found[20] / 3.65f32.sqrt() - 1.0).abs() < 0.01, "{}", found[20]);
        assert!(found.iter().enumerate().all(|(i, s)| (18..=21).contains(&i) || *s == 0.0));
    }

    /// Points a pixel apart show the slope of a narrow stripe too. A fit that states no finite sigma shows nothing.
    #[test]
    fn narrow_stripes_and_lost_fits() {
        let amplitudes: Vec<f32> = (0..9).map(|i| 50.0 * (0.3 * i as f32).exp()).collect();
        let mut line = peaks(Vec2::X, &amplitudes);
        line[4].sigma_px = f32::INFINITY;
        let found = shifts_of(&line, -Vec2::Y, 0.7);
        assert!((found[1] / (0.14 * 0.3) - 1.0).abs() < 0.03, "{}", found[1]);
        assert_eq!(found[4], 0.0);
    }

    /// What is rejected shows no light, and a point alone on its line shows no slope.
    #[test]
    fn rejected_peaks_are_no_neighbours() {
        let mut line = peaks(Vec2::X, &[80.0, 10.0, 80.0, 10.0, 80.0]);
        [1, 3].into_iter().for_each(|i| line[i].refuse(Reject::Wide));
        assert_eq!(shifts_of(&line, -Vec2::Y, STRIPE), [0.0; 3]);
        assert_eq!(shifts_of(&peaks(Vec2::X, &[80.0]), -Vec2::Y, STRIPE), [0.0]);
    }
}
