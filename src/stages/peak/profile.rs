//! In: a picture, a skeleton pixel, the direction across the stripe. Out: the stripe's profile there, averaged along it.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (2).

use super::{Grey, PeakFrame};

/// Most samples of a profile: three widths and a pixel to both sides of a stripe at 45 degrees, at the finest step.
pub(super) const SAMPLES: usize = 96;

/// Weights along the stripe are whole numbers up to this: sums are then exact, and four pixels of a word add up in two
/// multiplications.
const WEIGHT: f32 = 127.0;

/// The stripe's light over the offset across, sample k at `offset + k step`, k = 0..count. Pixels beside each other along
/// the stripe are added up along an image axis, a wide stripe's columns in groups of four, each shifted by whole pixels
/// to follow the line; what the shifts leave widens the profile by `blur2`, which is known.
pub(super) struct Profile {
    /// Weighted sums of grey levels, and of the weights of saturated pixels.
    sums: [f32; SAMPLES],
    clipped: [f32; SAMPLES],
    pub count: i32,
    offset: f32,
    step: f32,
    /// Grey level of a unit of `sums`.
    scale: f32,
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
    /// Offset across and grey level.
    #[inline(always)]
    pub fn sample(&self, k: i32) -> (f32, f32) {
        (self.offset + k as f32 * self.step, self.sums[k as usize] * self.scale)
    }
    /// The share of a sample's weight that is not saturated.
    #[inline(always)]
    pub fn clear(&self, k: i32) -> f32 {
        1.0 - self.clipped[k as usize] * self.scale
    }
    /// The samples whose offsets may lie within `reach` of m, and some beyond.
    pub fn within(&self, m: f32, reach: f32) -> std::ops::Range<i32> {
        let (a, b) = ((m - reach - self.offset) / self.step, (m + reach - self.offset) / self.step);
        let top = self.count as f32;
        (a.min(b).floor().clamp(0.0, top) as i32)..((a.max(b).ceil() + 1.0).clamp(0.0, top) as i32)
    }

    pub fn new<G: Grey>(image: G, (x, y): (i32, i32), (nx, ny): (f32, f32), s: &PeakFrame) -> Profile {
        let columns = by_columns((nx, ny));
        let (na, nb) = if columns { (nx, ny) } else { (ny, nx) };
        let (x0, y0, width, height) = if columns { (x, y, s.width, s.height) } else { (y, x, s.height, s.width) };
        let at = |a: i32, b: i32| if columns { image.at(a, b) } else { image.at(b, a) };
        // A wide stripe's columns go in groups of four, as they lie in memory; all else goes one by one.
        let fours = columns && s.fours > 0;
        let (mask, size, middle) = if fours { (!3, 4, 1.5f32) } else { (!0, 1, 0.0) };
        let left = if fours { (x0 - 2 * s.fours + 2) & !3 } else { x0 - s.reach_along };
        let right = if fours { left + 4 * s.fours - 1 } else { x0 + s.reach_along };
        let (begin, end) = (left.max(0), right.min(width - 1));
        let fade = s.along_factor / (nb * nb);
        let weight = |i: i32| {
            let f = (1.0 - fade * (i * i) as f32).max(0.0);
            let inside = i.abs() <= s.reach_along && x0 + i <= end;
            if inside { (WEIGHT * (f * f) + 0.5) as i32 } else { 0 }
        };
        // Whole pixels by which a group follows the line. Not + 0.5: at 45 degrees rounding would decide.
        let shift = |a: i32| ((-((a - x0) as f32 + middle) * na) / nb + 0.47).floor() as i32;
        let (mut sum, mut square, mut moment, mut second) = (0f32, 0f32, 0f32, 0f32);
        for a in (begin..=end).step_by(size) {
            let c = shift(a) as f32 * nb + (a - x0) as f32 * na;
            for q in 0..size as i32 {
                let (g, e) = (weight(a + q - x0) as f32, c + q as f32 * na);
                sum += g;
                square += g * g;
                moment += g * e;
                second += (g * e) * e;
            }
        }
        let mean = moment / sum;
        // Samples whose rows all lie in the picture.
        let last = end & mask;
        let (low, high) = (shift(begin).min(shift(last)), shift(begin).max(shift(last)));
        let half = (s.half_across / nb.abs()).ceil() as i32;
        let first = (-half).max(-((y0 + low).div_euclid(s.stride_across)));
        let final_ = half.min((height - 1 - high - y0).div_euclid(s.stride_across));
        let count = (final_ - first + 1).clamp(0, SAMPLES as i32);
        let (mut sums, mut clipped) = ([0f32; SAMPLES], [0f32; SAMPLES]);
        for a in (begin..=end).step_by(size) {
            let shifted = y0 + shift(a);
            for q in 0..size as i32 {
                let g = weight(a + q - x0);
                for k in 0..if g > 0 { count } else { 0 } {
                    let level = at(a + q, shifted + (first + k) * s.stride_across);
                    sums[k as usize] += (g * level as i32) as f32;
                    clipped[k as usize] += if level >= s.full_scale { g as f32 } else { 0.0 };
                }
            }
        }
        let step = s.stride_across as f32 * nb;
        Profile {
            sums,
            clipped,
            count,
            offset: mean + first as f32 * step,
            step,
            scale: 1.0 / sum,
            weight: sum / WEIGHT,
            square: square / (WEIGHT * WEIGHT),
            blur2: (second / sum - mean * mean).max(0.0),
        }
    }

    /// First guess of offset and amplitude: centre of gravity and sum above the background.
    pub fn guess(&self, background: f32, s: &PeakFrame) -> (f32, f32) {
        let (mut sum, mut moment, mut square) = (0f32, 0f32, 0f32);
        for k in self.within(0.0, 1.5 * s.s0 + 0.5) {
            let (d, level) = self.sample(k);
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
