//! In: a picture, a skeleton pixel, the direction across the stripe. Out: the stripe's profile there, averaged along it.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (2).

use super::{Grey, PeakFrame};

/// Most samples of a profile: four widths to both sides of a stripe at 45 degrees, at the finest step.
pub(super) const SAMPLES: usize = 96;

/// The stripe's light over the offset across, sample k at `offset + k step`, k = 0..count. Pixels beside each other along
/// the stripe are added up along an image axis, a wide stripe's columns in groups of four, each shifted by whole pixels
/// to follow the line; what the shifts leave widens the profile by `blur2`, which is known.
pub(super) struct Profile {
    /// Mean grey level, and the share of the weight whose pixels are not saturated.
    levels: [f32; SAMPLES],
    clear: [f32; SAMPLES],
    pub count: i32,
    offset: f32,
    step: f32,
    /// Sum of the weights along the stripe, and of their squares.
    pub weight: f32,
    pub square: f32,
    /// Variance of the pixels' offsets within a sample, px^2.
    pub blur2: f32,
}

/// Columns where the stripe is nearer to the horizontal, else rows; at 45 degrees rounding shall not decide.
pub(super) fn by_columns((nx, ny): (f32, f32)) -> bool {
    1.001 * ny >= nx.abs()
}

impl Profile {
    /// Offset across, grey level, and the share that is not saturated.
    #[inline(always)]
    pub fn sample(&self, k: i32) -> (f32, f32, f32) {
        (self.offset + k as f32 * self.step, self.levels[k as usize], self.clear[k as usize])
    }

    pub fn new<G: Grey>(image: G, (x, y): (i32, i32), (nx, ny): (f32, f32), s: &PeakFrame) -> Profile {
        let columns = by_columns((nx, ny));
        let (na, nb) = if columns { (nx, ny) } else { (ny, nx) };
        let (x0, y0, width, height) = if columns { (x, y, s.width, s.height) } else { (y, x, s.height, s.width) };
        let at = |a: i32, b: i32| if columns { image.at(a, b) } else { image.at(b, a) };
        // A wide stripe's columns go in groups of four, as they lie in memory; all else goes one by one.
        let (mask, size, middle) = if columns && s.reach_along >= 4 { (!3, 4, 1.5f32) } else { (!0, 1, 0.0) };
        let begin = (x0 - s.reach_along) & mask;
        let end = x0 + s.reach_along;
        let fade = s.along_factor / (nb * nb);
        let weight = |i: i32| {
            let f = (1.0 - fade * (i * i) as f32).max(0.0);
            let inside = i.abs() <= s.reach_along && x0 + i >= 0 && x0 + i < width;
            if inside { f * f } else { 0.0 }
        };
        // Whole pixels by which a group follows the line. Not + 0.5: at 45 degrees rounding would decide.
        let shift = |a: i32| ((-((a - x0) as f32 + middle) * na) / nb + 0.47).floor() as i32;
        let (mut sum, mut square, mut moment, mut second) = (0f32, 0f32, 0f32, 0f32);
        let mut a = begin;
        while a <= end {
            let c = shift(a) as f32 * nb;
            for q in 0..size {
                let i = a + q - x0;
                let (g, e) = (weight(i), c + i as f32 * na);
                sum += g;
                square += g * g;
                moment += g * e;
                second += g * (e * e);
            }
            a += size;
        }
        let mean = moment / sum;
        // Samples whose rows all lie in the picture.
        let last = end & mask;
        let (low, high) = (shift(begin).min(shift(last)), shift(begin).max(shift(last)));
        let half = ((4.0 * s.s0) / (nb.abs() * s.stride_across as f32)).ceil() as i32;
        let first = (-half).max(-((y0 + low).div_euclid(s.stride_across)));
        let final_ = half.min((height - 1 - high - y0).div_euclid(s.stride_across));
        let count = (final_ - first + 1).clamp(0, SAMPLES as i32);
        let (mut levels, mut clear) = ([0f32; SAMPLES], [1f32; SAMPLES]);
        for k in 0..count {
            let row = y0 + (first + k) * s.stride_across;
            let (mut light, mut clipped) = (0f32, 0f32);
            let mut a = begin;
            while a <= end {
                let b = row + shift(a);
                let mut part = 0f32;
                for q in 0..size {
                    let (g, level) = (weight(a + q - x0), at(a + q, b));
                    part += g * level;
                    clipped += if level >= s.full_scale { g } else { 0.0 };
                }
                light += part;
                a += size;
            }
            levels[k as usize] = light / sum;
            clear[k as usize] = 1.0 - clipped / sum;
        }
        Profile {
            levels,
            clear,
            count,
            offset: mean + first as f32 * (s.stride_across as f32 * nb),
            step: s.stride_across as f32 * nb,
            weight: sum,
            square,
            blur2: (second / sum - mean * mean).max(0.0),
        }
    }

    /// First guess of offset and amplitude: centre of gravity and sum above the background.
    pub fn guess(&self, background: f32, s: &PeakFrame) -> (f32, f32) {
        let (mut sum, mut moment, mut square) = (0f32, 0f32, 0f32);
        for k in 0..self.count {
            let (d, level, _) = self.sample(k);
            // A window of 1.5 widths: neighbours of the stripe shall not pull.
            let near = if d.abs() <= 1.5 * s.s0 + 0.5 { 1.0 } else { 0.0 };
            let light = near * (level - background).max(0.0);
            sum += light;
            moment += light * d;
            square += near;
        }
        let m = if sum > 0.0 { moment / sum } else { 0.0 };
        (m, (1.25 * sum / square.max(1e-6)).max(1.0))
    }
}
