//! In: a picture, most of it dark or smooth. Out: the standard deviation of a dark pixel. Frame and unit: grey levels
//! of an 8-bit picture. docs/math.md, Stripe peak (6).

pub(super) mod grain;
pub(super) mod scatter;

use crate::raster::Image;

/// Approximate number of pixels used; the median of that many is accurate to 1 % of the scatter.
const SAMPLES: u32 = 40_000;
/// Median of |I - (left + right) / 2| over sigma: 0.6745 sqrt(1.5).
const MEDIAN: f32 = 0.826;
/// Variance that rounding adds, levels^2.
const ROUNDING: f32 = 1.0 / 12.0;

/// From second differences over two pixels, because neighbours may share a sensor's or a codec's smoothing. Their
/// median is used, because stripe, edges and specks are few. If black is cut off at 0, the pixels that are cut off
/// scatter on one side only. The share of zeros, up to a half, corrects that to a fifth; for a picture that is mostly
/// zeros the result is too small. A whole level stands for half a level to both sides: the median lies between them
/// (Sheppard 1898), and the variance that rounding adds is subtracted.
pub fn noise(image: &Image) -> f32 {
    let (w, h) = (image.width, image.height);
    let step = ((w * h / SAMPLES) as f32).sqrt().max(1.0) as u32;
    let mut twice = Vec::new();
    let mut zeros = 0;
    for y in (0..h).step_by(step as usize) {
        for x in (2..w.saturating_sub(2)).step_by(step as usize) {
            let here = image.get(x, y);
            zeros += usize::from(here == 0);
            twice.push(
                (2 * i32::from(here) - i32::from(image.get(x - 2, y)) - i32::from(image.get(x + 2, y))).unsigned_abs(),
            );
        }
    }
    if twice.is_empty() {
        return 0.0;
    }
    let cut = 1.0 + zeros as f32 / twice.len() as f32;
    let scatter = median(&mut twice) / 2.0 / MEDIAN;
    (scatter * scatter - ROUNDING).max(0.0).sqrt() * cut * 255.0 / f32::from(image.full_scale())
}

/// The median of numbers that were rounded to these.
fn median(numbers: &mut [u32]) -> f32 {
    let middle = numbers.len() / 2;
    let level = *numbers.select_nth_unstable(middle).1;
    let count = |of: std::cmp::Ordering| numbers.iter().filter(|n| n.cmp(&&level) == of).count() as f32;
    let (below, same) = (count(std::cmp::Ordering::Less), count(std::cmp::Ordering::Equal));
    let share = (0.5 * numbers.len() as f32 - below) / same;
    // The numbers have no sign: 0 stands for those up to a half.
    if level == 0 { 0.5 * share } else { level as f32 - 0.5 + share }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::cases::{drawn, stripe};
    use crate::stages::noise::Noise;

    fn noisy(bits: u8, black: f64, sigma: f64) -> f32 {
        let clean = stripe(640, 480, bits, 2.5, 6, 3);
        let mut random = Noise(17);
        let full = f64::from(clean.full_scale());
        noise(&drawn(640, 480, bits, |x, y| {
            // Only the stripe's light: the picture `clean` has its own noise.
            let light = f64::from(clean.get(x, y));
            let light = if light > 0.2 * full { light } else { 0.0 };
            (light + (black + sigma * random.normal()) * full / 255.0).round().clamp(0.0, full) as u32
        }))
    }

    #[test]
    fn the_scatter_of_dark_pixels_is_found_beside_a_stripe() {
        for (bits, black, sigma) in
            [(8, 30.0, 2.0), (8, 30.0, 8.0), (8, 0.0, 3.5), (8, 2.0, 3.5), (12, 30.0, 1.0), (12, 0.0, 1.0)]
        {
            let found = f64::from(noisy(bits, black, sigma));
            assert!((found / sigma - 1.0).abs() < 0.25, "{bits} bits, black {black}, {sigma}: {found}");
        }
    }

    /// The threshold is three of these sigmas above the dark level: with a tenth less, five times as many specks are
    /// lit.
    #[test]
    fn whole_grey_levels_leave_the_scatter_as_it_is() {
        for sigma in [0.7, 0.85, 1.0, 1.2, 1.5, 1.8, 2.0, 2.2, 3.1] {
            let found = f64::from(noisy(8, 30.0, sigma));
            // The stripe's pixels are few, but present.
            assert!((0.99..1.07).contains(&(found / sigma)), "{sigma}: {found}");
        }
    }

    #[test]
    fn a_quiet_picture_has_less_than_a_grey_level() {
        assert!(noisy(8, 0.0, 0.3) < 1.0 && noisy(8, 10.0, 0.5) < 1.0);
        assert_eq!(noise(&drawn(3, 4, 8, |_, _| 7)), 0.0);
    }
}
