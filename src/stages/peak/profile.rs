//! In: pictures, skeleton pixels, the directions across the stripe. Out: the stripe's profiles there, averaged along
//! it, side by side.
//! Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md, Stripe peak (2).

use super::PeakFrame;
use super::grey::{Grey, Place};
use super::lanes::Lanes;
use super::params::SAMPLES;

/// Weights along the stripe are whole numbers up to this: sums are then exact, and four pixels of a word add up in two
/// multiplications.
const WEIGHT: f32 = 127.0;

/// The stripe's light over the offset across, one profile a lane, which know nothing of each other: sample k at
/// `offset + k step`, k = -half..half. Pixels beside each other along the stripe are added up along an image axis, a
/// wide stripe's columns in groups of four, each shifted by whole pixels to follow the line; what the shifts leave,
/// and the rows of a sample, widens the profile by `blur2`, which is known.
pub(super) struct Profiles {
    /// Grey levels, from the middle to both sides, as the shader walks: k = 0, 1, .. and k = -1, -2, ..
    pub levels: [[Lanes; SAMPLES / 2]; 2],
    /// Shares of the weights of saturated pixels.
    pub clipped: [[Lanes; SAMPLES / 2]; 2],
    pub half: usize,
    /// First and last sample that lies in the picture.
    low: Lanes,
    high: Lanes,
    pub offset: Lanes,
    pub step: Lanes,
    /// Sum of the weights along the stripe, and of their squares.
    pub weight: Lanes,
    pub square: Lanes,
    /// Variance of the pixels' offsets within a sample, px^2.
    pub blur2: Lanes,
    /// Level beside the stripe, and the square of what it differs by from side to side.
    pub base: Lanes,
    pub uneven2: Lanes,
}

/// What is known of a place before its profile is fitted.
#[derive(Clone, Copy, Default)]
pub(super) struct Seen {
    /// The pixel that offsets are counted from.
    pub at: (i32, i32),
    /// Unit vector across the stripe.
    pub n: (f32, f32),
    /// Level beside the stripe.
    pub base: f32,
    /// Square of what it differs by from side to side.
    pub uneven2: f32,
}

/// Columns where the stripe is nearer to the horizontal, else rows; at 45 degrees rounding shall not decide.
pub(super) fn by_columns((nx, ny): (f32, f32)) -> bool {
    1.001 * ny >= nx.abs()
}

/// How far a window may reach to both sides along a: no farther than the picture on one of them, as an error of the
/// direction would move the centre of a window that reaches farther to one side; and no farther than the shifted
/// columns hold the skeleton's pixel, without whose sample a profile has no crest. At whole numbers rounding shall
/// not decide.
#[inline(always)]
fn room((a0, b0): (i32, i32), (na, nb): (f32, f32), (width, height): (i32, i32)) -> i32 {
    let across = b0.min(height - 1 - b0) as f32 * nb.abs() / na.abs().max(1e-6);
    a0.min(width - 1 - a0).min((across.min(8192.0) + 0.03).floor() as i32)
}

/// Number of sample j of a side.
#[inline(always)]
pub(super) fn number(side: usize, j: usize) -> f32 {
    if side == 0 { j as f32 } else { -1.0 - j as f32 }
}

/// How much of sample k lies in a span: a sample that were in or out would hang on the last bit of the span's ends.
#[inline(always)]
pub(super) fn share(k: f32, (from, to): (Lanes, Lanes)) -> Lanes {
    let k = Lanes::all(k);
    ((k - from).min(to - k) + Lanes::all(0.5)).clamp(Lanes::ZERO, Lanes::all(1.0))
}

/// The share of clipped pixels in a sample of which `inside` takes part; 0 in one of which nothing does.
#[inline(always)]
pub(super) fn clipped_within(lost: Lanes, inside: Lanes) -> Lanes {
    lost.with(inside, |lost, inside| if inside > 0.0 { lost } else { 0.0 })
}

/// The window of a profile: a counts along the image axis that the stripe is nearer to, b across it.
struct Window {
    columns: bool,
    a0: i32,
    b0: i32,
    /// The normal along a and b.
    na: f32,
    nb: f32,
    /// First and last a that lie in the picture; how far from the skeleton's pixel they may; a group's middle.
    begin: i32,
    end: i32,
    room: i32,
    middle: f32,
    /// 1 / R^2 along a.
    fade: f32,
    /// Samples that are read.
    from: i32,
    to: i32,
}

impl Window {
    /// Weight of the pixels i beside the skeleton's.
    #[inline(always)]
    fn weight(&self, i: i32) -> i32 {
        let f = (1.0 - self.fade * (i * i) as f32).max(0.0);
        if (-self.room..=self.end - self.a0).contains(&i) { (WEIGHT * (f * f) + 0.5) as i32 } else { 0 }
    }
    /// Whole pixels by which a group follows the line. Not + 0.5: at 45 degrees rounding would decide.
    #[inline(always)]
    fn shift(&self, a: i32) -> i32 {
        (-(((a - self.a0) as f32 + self.middle) * self.na) / self.nb + 0.47).floor() as i32
    }
}

/// Weighted sums over the pixels of a window; samples at k + half.
struct Gathered {
    levels: [f32; SAMPLES],
    clipped: [f32; SAMPLES],
    sum: f32,
    square: f32,
    moment: f32,
    second: f32,
}

impl Gathered {
    /// Weights of a group's pixels, whose first lies at this offset across.
    #[inline(always)]
    fn weigh(&mut self, c: f32, na: f32, f: [f32; 4]) {
        let all = (f[0] + f[1]) + (f[2] + f[3]);
        let run = na * (f[1] + (2.0 * f[2] + 3.0 * f[3]));
        let run2 = (na * na) * (f[1] + (4.0 * f[2] + 9.0 * f[3]));
        self.sum += all;
        self.square += (f[0] * f[0] + f[1] * f[1]) + (f[2] * f[2] + f[3] * f[3]);
        self.moment += c * all + run;
        self.second += c * (c * all + 2.0 * run) + run2;
    }

    /// One row of each sample, pixel by pixel along the window.
    #[inline(always)]
    fn singles<G: Grey>(&mut self, image: G, w: &Window, row: i32, tall: i32, half: i32, full_scale: i32) {
        for a in w.begin..=w.end {
            let b = w.shift(a) + row;
            let g = w.weight(a - w.a0);
            self.weigh(b as f32 * w.nb + (a - w.a0) as f32 * w.na, w.na, [g as f32, 0.0, 0.0, 0.0]);
            for k in w.from..w.to {
                let across = w.b0 + b + k * tall;
                let level = if w.columns { image.inside(a, across) } else { image.inside(across, a) };
                self.levels[(k + half) as usize] += (g * level) as f32;
                if level >= full_scale {
                    self.clipped[(k + half) as usize] += g as f32;
                }
            }
        }
    }

    /// The same of a wide stripe by columns, four at a time.
    #[inline(always)]
    fn fours<G: Grey>(&mut self, image: G, w: &Window, row: i32, tall: i32, half: i32, full_scale: i32) {
        for a in (w.begin..=w.end).step_by(4) {
            let b = w.shift(a) + row;
            let i = a - w.a0;
            let g = [w.weight(i), w.weight(i + 1), w.weight(i + 2), w.weight(i + 3)];
            let f = [g[0] as f32, g[1] as f32, g[2] as f32, g[3] as f32];
            self.weigh(b as f32 * w.nb + i as f32 * w.na, w.na, f);
            for k in w.from..w.to {
                let [p, q, r, s] = image.four(a, w.b0 + b + k * tall);
                self.levels[(k + half) as usize] += ((g[0] * p + g[1] * q) + (g[2] * r + g[3] * s)) as f32;
                if p.max(q).max(r.max(s)) >= full_scale {
                    let full = |level: i32, g: i32| if level >= full_scale { g } else { 0 };
                    let full = (full(p, g[0]) + full(q, g[1])) + (full(r, g[2]) + full(s, g[3]));
                    self.clipped[(k + half) as usize] += full as f32;
                }
            }
        }
    }
}

impl Profiles {
    pub fn new(s: &PeakFrame) -> Profiles {
        let none = [[Lanes::ZERO; SAMPLES / 2]; 2];
        let [zero, one] = [0.0, 1.0].map(Lanes::all);
        Profiles {
            levels: none,
            clipped: none,
            half: 2 * s.quads() as usize,
            low: zero,
            high: zero,
            offset: zero,
            step: one,
            weight: one,
            square: one,
            blur2: zero,
            base: zero,
            uneven2: zero,
        }
    }

    /// Puts the profile at a place into a lane.
    #[inline(always)]
    pub fn put<G: Grey>(&mut self, lane: usize, place: &Place<G>, seen: &Seen, s: &PeakFrame) {
        let Seen { at: (x, y), n: (nx, ny), base, uneven2 } = *seen;
        let columns = by_columns((nx, ny));
        let (na, nb) = if columns { (nx, ny) } else { (ny, nx) };
        let (a0, b0, width, height) = if columns { (x, y, s.width, s.height) } else { (y, x, s.height, s.width) };
        // A wide stripe's columns go in groups of four, as they lie in memory; all else goes one by one.
        let fours = columns && s.fours > 0;
        let (mask, middle) = if fours { (!3, 1.5f32) } else { (!0, 0.0) };
        let left = if fours { (a0 - 2 * s.fours + 2) & !3 } else { a0 - s.reach_along };
        let right = if fours { left + 4 * s.fours - 1 } else { a0 + s.reach_along };
        let room = room((a0, b0), (na, nb), (width, height));
        let (begin, end) = (left.max(0).max((a0 - room) & mask), right.min(width - 1).min(a0 + room));
        let fade = s.along_factor / (nb * nb);
        let mut window = Window { columns, a0, b0, na, nb, begin, end, room, middle, fade, from: 0, to: 0 };
        let tall = s.rows;
        let (first, last) = (window.shift(begin), window.shift(end & mask));
        // Samples whose rows all lie in the picture.
        let low = -(b0 + first.min(last)).div_euclid(tall);
        let high = (height - 1 - first.max(last) - b0 - (tall - 1)).div_euclid(tall);
        let half = self.half as i32;
        (window.from, window.to) = ((-half).max(low), half.min(high + 1));
        let none = [0.0; SAMPLES];
        let mut sums = Gathered { levels: none, clipped: none, sum: 0.0, square: 0.0, moment: 0.0, second: 0.0 };
        let full_scale = s.full_scale as i32;
        for row in 0..s.rows {
            if fours {
                sums.fours(place.image, &window, row, tall, half, full_scale);
            } else {
                sums.singles(place.image, &window, row, tall, half, full_scale);
            }
        }
        let (sum, mean, scale) = (sums.sum, sums.moment / sums.sum, 1.0 / sums.sum);
        for j in 0..self.half {
            for (side, at) in [(0, self.half + j), (1, self.half - 1 - j)] {
                self.levels[side][j].0[lane] = sums.levels[at] * scale;
                self.clipped[side][j].0[lane] = sums.clipped[at] * scale;
            }
        }
        self.low.0[lane] = low as f32;
        self.high.0[lane] = high as f32;
        self.offset.0[lane] = mean;
        self.step.0[lane] = tall as f32 * nb;
        self.weight.0[lane] = sum / WEIGHT;
        self.square.0[lane] = sums.square / (WEIGHT * WEIGHT);
        self.blur2.0[lane] = (sums.second / sum - mean * mean).max(0.0);
        self.base.0[lane] = base;
        self.uneven2.0[lane] = uneven2;
    }

    /// Where the samples begin and end that lie within `reach` of m, in their numbers; not whole.
    #[inline(always)]
    pub fn span(&self, m: Lanes, reach: Lanes) -> (Lanes, Lanes) {
        let (a, b) = ((m - reach - self.offset) / self.step, (m + reach - self.offset) / self.step);
        (a.min(b).max(self.low - Lanes::all(0.5)), a.max(b).min(self.high + Lanes::all(0.5)))
    }

    /// First guess of offset and amplitude: centre of gravity and sum above the background. A window of 1.5 widths:
    /// neighbours of the stripe shall not pull.
    #[inline(always)]
    pub fn guess(&self, s: &PeakFrame) -> (Lanes, Lanes) {
        let near = self.span(Lanes::ZERO, Lanes::all(1.5 * s.s0 + 0.5));
        let (mut sum, mut moment) = ([Lanes::ZERO; 2], [Lanes::ZERO; 2]);
        for side in 0..2 {
            for (j, &level) in self.levels[side][..self.half].iter().enumerate() {
                let k = number(side, j);
                let light = share(k, near) * (level - self.base).max(Lanes::ZERO);
                sum[side] = sum[side] + light;
                moment[side] = moment[side] + light * Lanes::all(k);
            }
        }
        let (sum, moment) = (sum[0] + sum[1], moment[0] + moment[1]);
        let count = near.1 - near.0;
        let centre = self.offset + self.step * (moment / sum);
        let m = centre.with(sum, |c, sum| if sum > 0.0 { c } else { 0.0 });
        (m, (1.25 * sum / count.max(Lanes::all(1e-6))).max(Lanes::all(1.0)))
    }
}
