//! In: a picture, a skeleton pixel, the direction across the stripe. Out: the stripe's profile there, averaged along it.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (2).

use super::PeakFrame;
use super::grey::Grey;
use super::params::SAMPLES;

/// Weights along the stripe are whole numbers up to this: sums are then exact, and four pixels of a word add up in two
/// multiplications.
const WEIGHT: f32 = 127.0;

/// The stripe's light over the offset across, sample k at `offset + k step`, k = -half..half. Pixels beside each other
/// along the stripe are added up along an image axis, a wide stripe's columns in groups of four, each shifted by whole
/// pixels to follow the line; what the shifts leave, and the rows of a sample, widens the profile by `blur2`, which is
/// known.
pub(super) struct Profile {
    /// Grey levels, and the shares of the weights of saturated pixels; sample k at k + half.
    levels: [f32; SAMPLES],
    clipped: [f32; SAMPLES],
    pub half: i32,
    /// First and last sample that lies in the picture.
    low: f32,
    high: f32,
    pub offset: f32,
    pub step: f32,
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

/// Samples from the middle to both sides, as the shader walks: upwards k = 0, 1, .. and downwards k = -1, -2, ..
pub(super) const SIDES: [fn(i32) -> i32; 2] = [|j| j, |j| -1 - j];

/// How much of sample k lies in a span: a sample that were in or out would hang on the last bit of the span's ends.
#[inline(always)]
pub(super) fn share(k: i32, (from, to): (f32, f32)) -> f32 {
    ((k as f32 - from).min(to - k as f32) + 0.5).clamp(0.0, 1.0)
}

impl Profile {
    #[inline(always)]
    pub fn level(&self, k: i32) -> f32 {
        self.levels[(k + self.half) as usize]
    }
    /// The share of a sample's weight that is saturated.
    #[inline(always)]
    pub fn clipped(&self, k: i32) -> f32 {
        self.clipped[(k + self.half) as usize]
    }
    /// Where the samples begin and end that lie within `reach` of m, in their numbers; not whole.
    #[inline(always)]
    pub fn span(&self, m: f32, reach: f32) -> (f32, f32) {
        let (a, b) = ((m - reach - self.offset) / self.step, (m + reach - self.offset) / self.step);
        (a.min(b).max(self.low - 0.5), a.max(b).min(self.high + 0.5))
    }

    #[inline(always)]
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
            if x0 + i <= end { (WEIGHT * (f * f) + 0.5) as i32 } else { 0 }
        };
        // Whole pixels by which a group follows the line. Not + 0.5: at 45 degrees rounding would decide.
        let shift = |a: i32| (-(((a - x0) as f32 + middle) * na) / nb + 0.47).floor() as i32;
        let (stride, tall) = (s.stride_across, s.stride_across * s.rows);
        let last = end & mask;
        // Samples whose rows all lie in the picture.
        let low = -(y0 + shift(begin).min(shift(last))).div_euclid(tall);
        let high = (height - 1 - shift(begin).max(shift(last)) - y0 - (tall - stride)).div_euclid(tall);
        let half = 2 * s.quads();
        let (mut sum, mut square, mut moment, mut second) = (0f32, 0f32, 0f32, 0f32);
        let (mut levels, mut clipped) = ([0f32; SAMPLES], [0f32; SAMPLES]);
        for row in (0..tall).step_by(stride as usize) {
            for a in (begin..=end).step_by(size) {
                let b = shift(a) + row;
                let c = b as f32 * nb + (a - x0) as f32 * na;
                let mut g = [0i32; 4];
                for q in 0..size {
                    g[q] = weight(a + q as i32 - x0);
                }
                let f = g.map(|g| g as f32);
                let all = (f[0] + f[1]) + (f[2] + f[3]);
                let run = na * (f[1] + (2.0 * f[2] + 3.0 * f[3]));
                let run2 = (na * na) * (f[1] + (4.0 * f[2] + 9.0 * f[3]));
                sum += all;
                square += (f[0] * f[0] + f[1] * f[1]) + (f[2] * f[2] + f[3] * f[3]);
                moment += c * all + run;
                second += c * (c * all + 2.0 * run) + run2;
                for k in (-half).max(low)..half.min(high + 1) {
                    let (mut light, mut full) = (0, 0);
                    for q in 0..size {
                        let level = at(a + q as i32, y0 + b + k * tall);
                        light += g[q] * level as i32;
                        full += if level >= s.full_scale { g[q] } else { 0 };
                    }
                    levels[(k + half) as usize] += light as f32;
                    clipped[(k + half) as usize] += full as f32;
                }
            }
        }
        let (mean, scale) = (moment / sum, 1.0 / sum);
        Profile {
            levels: levels.map(|v| v * scale),
            clipped: clipped.map(|v| v * scale),
            half,
            low: low as f32,
            high: high as f32,
            offset: mean,
            step: tall as f32 * nb,
            weight: sum / WEIGHT,
            square: square / (WEIGHT * WEIGHT),
            blur2: (second / sum - mean * mean).max(0.0),
        }
    }

    /// First guess of offset and amplitude: centre of gravity and sum above the background. A window of 1.5 widths:
    /// neighbours of the stripe shall not pull.
    #[inline(always)]
    pub fn guess(&self, background: f32, s: &PeakFrame) -> (f32, f32) {
        let near = self.span(0.0, 1.5 * s.s0 + 0.5);
        let (mut sum, mut moment) = ([0f32; 2], [0f32; 2]);
        for (side, sample) in SIDES.into_iter().enumerate() {
            for k in (0..self.half).map(sample) {
                let light = share(k, near) * (self.level(k) - background).max(0.0);
                sum[side] += light;
                moment[side] += light * k as f32;
            }
        }
        let (sum, moment) = (sum[0] + sum[1], moment[0] + moment[1]);
        let count = near.1 - near.0;
        let m = if sum > 0.0 { self.offset + self.step * (moment / sum) } else { 0.0 };
        (m, (1.25 * sum / count.max(1e-6)).max(1.0))
    }
}
