//! In: pictures, skeleton pixels, the directions across the stripe. Out: the stripe's profiles at these pixels,
//! averaged along it, side by side. Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md,
//! Stripe peak (2).

use super::PeakFrame;
use super::grey::Grey;
use super::lanes::{LANES, Lanes};
use super::params::SAMPLES;
use super::windows::{Gathered, Seen, Still, WEIGHT, Windows, by_columns, lean};
use std::array::from_fn;

/// The stripe's light over the offset across it: one profile in each lane, independent of the others. Sample k lies at
/// `offset + k step`, k = -half..half. Neighbouring pixels along the stripe are added up along an image axis, a wide
/// stripe's columns in groups of four, each shifted by whole pixels to follow the line. The remaining offsets, and the
/// rows of a sample, widen the profile by `blur2`, which is known.
pub(super) struct Profiles {
    /// Grey levels from the middle to both sides, in the shader's order: k = 0, 1, .. and k = -1, -2, ..
    pub levels: [[Lanes; SAMPLES / 2]; 2],
    /// Shares of the samples' weights that belong to saturated pixels.
    pub clipped: [[Lanes; SAMPLES / 2]; 2],
    /// Offsets of the samples from their nominal places, and by how much the variance of their pixels about that place
    /// exceeds `blur2`.
    pub off: [[Lanes; SAMPLES / 2]; 2],
    pub more: [[Lanes; SAMPLES / 2]; 2],
    pub half: usize,
    /// First and last sample that lie in the picture.
    low: Lanes,
    high: Lanes,
    pub offset: Lanes,
    pub step: Lanes,
    /// Sum of the weights along the stripe, and of their squares.
    pub weight: Lanes,
    pub square: Lanes,
    /// Variance of the pixels' offsets within a sample, px^2.
    pub blur2: Lanes,
    /// Level beside the stripe, and the squared difference of the levels on its two sides, beyond their noise.
    pub base: Lanes,
    pub uneven2: Lanes,
    /// Memory reused from one profile to the next.
    still: Still,
}

/// Place in the picture of a centre that is `m` px across from a pixel: the middle of the window there. It is on the
/// line even if the direction has an error.
#[inline(always)]
pub(super) fn centre_at((x, y): (i32, i32), n: (f32, f32), m: f32) -> (f32, f32) {
    let columns = by_columns(n);
    let (na, nb) = if columns { n } else { (n.1, n.0) };
    let a = lean(na, nb) * (m / nb);
    let b = (m - a * na) / nb;
    let (du, dv) = if columns { (a, b) } else { (b, a) };
    (x as f32 + du, y as f32 + dv)
}

/// Number k of sample j of a side.
#[inline(always)]
pub(super) fn number(side: usize, j: usize) -> f32 {
    if side == 0 { j as f32 } else { -1.0 - j as f32 }
}

/// Share of sample k that lies in a span. If a sample were either in or out, the last bit of the span's ends would
/// decide.
#[inline(always)]
pub(super) fn share(k: f32, (from, to): (Lanes, Lanes)) -> Lanes {
    let k = Lanes::all(k);
    ((k - from).min(to - k) + Lanes::all(0.5)).clamp(Lanes::ZERO, Lanes::all(1.0))
}

/// The share of clipped pixels in a sample of which the share `inside` takes part; 0 if no part of it does.
#[inline(always)]
pub(super) fn clipped_within(lost: Lanes, inside: Lanes) -> Lanes {
    lost.with(inside, |lost, inside| if inside > 0.0 { lost } else { 0.0 })
}

/// A line through the average offsets of the samples' pixels. Pixels that follow a slanted line in whole steps lie a
/// little closer together, or farther apart, than the nominal steps. The remaining offsets are [`Profiles::off`].
struct Off {
    all: Lanes,
    k: Lanes,
    kk: Lanes,
    e: Lanes,
    ke: Lanes,
    /// Weighted sums of the samples' variance, weight and squared weight.
    blur2: Lanes,
    weight: Lanes,
    square: Lanes,
}

impl Off {
    const NONE: Off = {
        let zero = Lanes::ZERO;
        Off { all: zero, k: zero, kk: zero, e: zero, ke: zero, blur2: zero, weight: zero, square: zero }
    };

    /// Adds sample k; it counts less the farther it lies from the middle: `near` from 1 to 0.
    #[inline(always)]
    fn add(&mut self, k: f32, near: Lanes, sample: &Gathered) {
        let weight = sample.weight.float();
        let e = sample.moment / weight;
        let k = Lanes::all(k);
        self.all = self.all + near;
        self.k = self.k + near * k;
        self.kk = self.kk + near * (k * k);
        self.e = self.e + near * e;
        self.ke = self.ke + near * (k * e);
        self.blur2 = self.blur2 + near * (sample.second / weight - e * e);
        self.weight = self.weight + near * weight;
        self.square = self.square + near * sample.square.float();
    }

    /// Offset of the samples at k = 0, and its increase from one sample to the next.
    #[inline(always)]
    fn line(&self) -> (Lanes, Lanes) {
        let by = (self.all * self.ke - self.k * self.e) / (self.all * self.kk - self.k * self.k);
        ((self.e - by * self.k) / self.all, by)
    }
}

impl Profiles {
    pub fn new(s: &PeakFrame) -> Profiles {
        let none = [[Lanes::ZERO; SAMPLES / 2]; 2];
        let [zero, one] = [0.0, 1.0].map(Lanes::all);
        Profiles {
            levels: none,
            clipped: none,
            off: none,
            more: none,
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
            still: Still::default(),
        }
    }

    /// Stores the profiles of places side by side. With `INNER`, all of them lie in one picture, and so do all pixels
    /// that are read for them.
    #[inline(always)]
    pub fn put<G: Grey, const INNER: bool>(&mut self, images: [G; LANES], seen: &[Seen; LANES], s: &PeakFrame) {
        let windows = Windows::new(images, seen, s);
        let alike = windows.alike::<INNER>(&mut self.still);
        let step = windows.step();
        let mut off = Off::NONE;
        let (mut low, mut high) = (Lanes::ZERO, Lanes::ZERO);
        let half = self.half;
        for (side, j) in (0..2).flat_map(|side| (0..half).map(move |j| (side, j))) {
            let k = number(side, j);
            let sample = match &alike {
                Some(alike) => windows.still::<INNER>(k as i32, &self.still, alike),
                None => windows.sample::<INNER>(k as i32),
            };
            let scale = 1.0 / sample.weight.float();
            self.levels[side][j] = sample.levels.float() * scale;
            self.clipped[side][j] = sample.clipped.float() * scale;
            let e = sample.moment * scale;
            self.off[side][j] = e;
            self.more[side][j] = sample.second * scale - e * e;
            let far = (Lanes::all(k) * step).map(f32::abs) / Lanes::all(3.0 * s.s0);
            off.add(k, (Lanes::all(1.0) - far).max(Lanes::ZERO), &sample);
            let held = if INNER { Lanes::all(k) } else { windows.held(k as i32) };
            (low, high) = (low.min(held), high.max(held));
        }
        let (offset, by) = off.line();
        let blur2 = (off.blur2 / off.all).max(Lanes::ZERO);
        for (side, j) in (0..2).flat_map(|side| (0..half).map(move |j| (side, j))) {
            let stray = self.off[side][j] - (offset + by * Lanes::all(number(side, j)));
            self.off[side][j] = stray;
            self.more[side][j] = self.more[side][j] + (stray * stray - blur2);
        }
        (self.low, self.high) = (low, high);
        (self.offset, self.step) = (offset, step + by);
        self.weight = off.weight / (off.all * Lanes::all(WEIGHT));
        self.square = off.square / (off.all * Lanes::all(WEIGHT) * Lanes::all(WEIGHT));
        self.blur2 = blur2;
        self.base = Lanes(from_fn(|lane| seen[lane].base));
        self.uneven2 = Lanes(from_fn(|lane| seen[lane].uneven2));
    }

    /// The first and the last number of the samples that lie within `reach` of m; not whole numbers.
    #[inline(always)]
    pub fn span(&self, m: Lanes, reach: Lanes) -> (Lanes, Lanes) {
        let (a, b) = ((m - reach - self.offset) / self.step, (m + reach - self.offset) / self.step);
        (a.min(b).max(self.low - Lanes::all(0.5)), a.max(b).min(self.high + Lanes::all(0.5)))
    }

    /// First guess of offset and amplitude: centre of gravity and sum above the background. The window is only 1.5
    /// widths, so that neighbours of the stripe do not bias it.
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
