//! In: pictures, skeleton pixels, the directions across the stripe. Out: the stripe's profiles at these pixels,
//! averaged along it, side by side. Frame and unit: offsets from the skeleton pixel, px; grey levels. docs/math.md,
//! Stripe peak (2).

use super::PeakFrame;
use super::grey::Grey;
use super::lanes::Lanes;
use super::params::SAMPLES;

/// Weights along the stripe are whole numbers up to this: sums are then exact.
const WEIGHT: f32 = 127.0;

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
    columns: Vec<Column>,
}

/// Properties of a place that are known before its profile is fitted.
#[derive(Clone, Copy, Default)]
pub(super) struct Seen {
    /// The pixel from which offsets are counted.
    pub at: (i32, i32),
    /// Unit vector across the stripe.
    pub n: (f32, f32),
    /// Level beside the stripe.
    pub base: f32,
    /// Squared difference of the levels on the stripe's two sides, beyond their noise.
    pub uneven2: f32,
}

/// True (columns) if the stripe is closer to the horizontal, else rows. The factor keeps rounding from deciding at 45
/// degrees.
pub(super) fn by_columns((nx, ny): (f32, f32)) -> bool {
    1.001 * ny >= nx.abs()
}

/// A window that would move by less than this from row to row, px, does not move. Its flanks then come from places up
/// to a sixth of a width beside its middle, and all its samples have the same columns.
pub(in crate::stages) const STILL: f32 = 0.05;

/// Shift of the middle of a window along the stripe from one row to the next, px along a.
#[inline(always)]
fn lean(na: f32, nb: f32) -> f32 {
    let lean = na * nb;
    if lean.abs() < STILL { 0.0 } else { lean }
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

/// How far a window may reach to both sides along a. It reaches no farther than the picture does on either side,
/// because an error of the direction would move the centre of an asymmetric window. It also reaches no farther than the
/// shifted columns of the skeleton pixel's own sample lie in the picture, because a profile without that sample has no
/// crest. The 0.03 keeps rounding from deciding at whole numbers.
#[inline(always)]
fn room((a0, b0): (i32, i32), (na, nb): (f32, f32), (width, height): (i32, i32)) -> i32 {
    let across = b0.min(height - 1 - b0) as f32 * nb.abs() / na.abs().max(1e-6);
    a0.min(width - 1 - a0).min((across.min(8192.0) + 0.03).floor() as i32)
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

/// The window of a profile: a counts along the image axis that the stripe is closer to, b across it. The window is a
/// rectangle along the stripe: on a slanted stripe its middle moves along a from row to row. Windows of whole columns
/// would have flanks from other places of the stripe, and at edges from another surface.
struct Window {
    columns: bool,
    a0: i32,
    b0: i32,
    /// The normal along a and b.
    na: f32,
    nb: f32,
    /// Shift of the window's middle along a from row to row.
    lean: f32,
    /// Pixels to both sides of the middle that may have weight, and to how many of them the picture limits the window.
    reach: i32,
    room: i32,
    /// 1 / R^2 along a.
    fade: f32,
    /// Rows of a sample.
    tall: i32,
    /// The picture's last pixel along a and b.
    last: (i32, i32),
    full_scale: i32,
}

/// One column of a window, or four neighbouring ones: offset of the first from the skeleton pixel, shift along the
/// line, weights.
struct Column {
    i: i32,
    shift: i32,
    weights: [i32; 4],
}

/// Weighted sums over the pixels of a sample.
#[derive(Clone, Copy, Default)]
struct Gathered {
    levels: i32,
    clipped: i32,
    weight: i32,
    square: i32,
    /// Sums of the offsets across from the sample's nominal one, and of their squares.
    moment: f32,
    second: f32,
}

impl Gathered {
    /// Adds a pixel of weight g, at offset e from its sample.
    #[inline(always)]
    fn add(&mut self, g: i32, e: f32, level: i32, full_scale: i32) {
        let f = g as f32;
        self.levels += g * level;
        self.clipped += if level >= full_scale { g } else { 0 };
        self.weight += g;
        self.square += g * g;
        self.moment += f * e;
        self.second += f * (e * e);
    }
}

impl Window {
    #[inline(always)]
    fn new(&Seen { at: (x, y), n: (nx, ny), .. }: &Seen, s: &PeakFrame) -> Window {
        let columns = by_columns((nx, ny));
        let (na, nb) = if columns { (nx, ny) } else { (ny, nx) };
        let (a0, b0, width, height) = if columns { (x, y, s.width, s.height) } else { (y, x, s.height, s.width) };
        let lean = lean(na, nb);
        // The pixel nearest to the middle may be half a pixel off it.
        let off = (lean.abs() * s.half_across * s.rows as f32).min(0.5);
        Window {
            columns,
            a0,
            b0,
            na,
            nb,
            lean,
            reach: (s.radius * nb.abs() + off).floor() as i32,
            room: room((a0, b0), (na, nb), (width, height)),
            fade: s.along_factor / (nb * nb),
            tall: s.rows,
            last: (width - 1, height - 1),
            full_scale: s.full_scale as i32,
        }
    }

    /// The window's middle in a row, and the pixel there. Not + 0.5, so that rounding errors do not decide at 45
    /// degrees.
    #[inline(always)]
    fn middle(&self, row: i32) -> (f32, i32) {
        let middle = row as f32 * self.lean;
        (middle, (middle + 0.47).floor() as i32)
    }

    /// Weight of the pixel at offset i from the skeleton pixel, in a row with this middle.
    #[inline(always)]
    fn weight(&self, i: i32, (middle, pixel): (f32, i32)) -> i32 {
        let t = i as f32 - middle;
        let f = (1.0 - self.fade * (t * t)).max(0.0);
        if (i - pixel).abs() <= self.room { (WEIGHT * (f * f) + 0.5) as i32 } else { 0 }
    }

    /// Whole pixels by which a group with its middle at `i` is shifted to follow the line. Not + 0.5, so that rounding
    /// errors do not decide at 45 degrees.
    #[inline(always)]
    fn shift(&self, i: f32) -> i32 {
        (-(i * self.na) / self.nb + 0.47).floor() as i32
    }

    /// Sample k, read pixel by pixel along the window.
    #[inline(always)]
    fn singles<G: Grey>(&self, image: G, k: i32) -> Gathered {
        let mut sums = Gathered::default();
        for row in 0..self.tall {
            let line = k * self.tall + row;
            let middle = self.middle(line);
            for i in middle.1 - self.reach..=middle.1 + self.reach {
                let shift = self.shift(i as f32);
                let (a, b) = (self.a0 + i, self.b0 + shift + line);
                let level = if self.columns { image.whole(a, b) } else { image.whole(b, a) };
                let e = (shift + row) as f32 * self.nb + i as f32 * self.na;
                sums.add(self.weight(i, middle), e, level, self.full_scale);
            }
        }
        sums
    }

    /// The columns of a window that does not move, which are the same for all samples. Those of a wide stripe are taken
    /// four at a time, as they are stored.
    #[inline(always)]
    fn columns(&self, fours: i32, columns: &mut Vec<Column>) {
        columns.clear();
        let weight = |i: i32| self.weight(i, (0.0, 0));
        if fours == 0 {
            columns.extend((-self.reach..=self.reach).map(|i| Column {
                i,
                shift: self.shift(i as f32),
                weights: [weight(i), 0, 0, 0],
            }));
        } else {
            let left = (self.a0 - 2 * fours + 2) & !3;
            columns.extend((left..left + 4 * fours).step_by(4).map(|a| {
                let i = a - self.a0;
                Column {
                    i,
                    shift: self.shift(i as f32 + 1.5),
                    weights: [weight(i), weight(i + 1), weight(i + 2), weight(i + 3)],
                }
            }));
        }
    }

    /// The sums that all samples of a window that does not move have in common: all except their light.
    #[inline(always)]
    fn alike(&self, columns: &[Column]) -> Gathered {
        let mut sums = Gathered::default();
        for row in 0..self.tall {
            for &Column { i, shift, weights } in columns {
                for (i, g) in (i..).zip(weights) {
                    sums.add(g, (shift + row) as f32 * self.nb + i as f32 * self.na, 0, self.full_scale);
                }
            }
        }
        sums
    }

    /// Sample k of a window that does not move: its light; all else is as in `alike`.
    #[inline(always)]
    fn still<G: Grey>(&self, image: G, k: i32, fours: bool, columns: &[Column], alike: &Gathered) -> Gathered {
        let (mut levels, mut clipped) = (0, 0);
        for row in 0..self.tall {
            let line = self.b0 + k * self.tall + row;
            if !fours {
                for &Column { i, shift, weights: [g, ..] } in columns {
                    let (a, b) = (self.a0 + i, line + shift);
                    let level = if self.columns { image.whole(a, b) } else { image.whole(b, a) };
                    levels += g * level;
                    clipped += if level >= self.full_scale { g } else { 0 };
                }
            } else {
                for &Column { i, shift, weights: g } in columns {
                    let a = (self.a0 + i).clamp(0, self.last.0 & !3);
                    let [p, q, r, s] = image.four(a, (line + shift).clamp(0, self.last.1));
                    levels += (g[0] * p + g[1] * q) + (g[2] * r + g[3] * s);
                    if p.max(q).max(r.max(s)) >= self.full_scale {
                        let full = |level: i32, g: i32| if level >= self.full_scale { g } else { 0 };
                        clipped += (full(p, g[0]) + full(q, g[1])) + (full(r, g[2]) + full(s, g[3]));
                    }
                }
            }
        }
        Gathered { levels, clipped, ..*alike }
    }

    /// Whether all pixels of sample k that have weight lie in the picture. The pixels at the window's ends decide.
    /// Columns that share their shift with three others lie up to one and a half columns from where the shift is exact.
    #[inline(always)]
    fn holds(&self, k: i32, fours: bool) -> bool {
        let reach = self.reach.min(self.room);
        let shared = if fours { 1.5 } else { 0.0 };
        [0, self.tall - 1].into_iter().all(|row| {
            let line = k * self.tall + row;
            let pixel = self.middle(line).1;
            [-1, 1].into_iter().all(|end| {
                let i = pixel + end * reach;
                let b = self.b0 + line + self.shift(i as f32 + end as f32 * shared);
                (0..=self.last.0).contains(&(self.a0 + i)) && (0..=self.last.1).contains(&b)
            })
        })
    }
}

/// A line through the average offsets of the samples' pixels. Pixels that follow a slanted line in whole steps lie a
/// little closer together, or farther apart, than the nominal steps. The remaining offsets are [`Profiles::off`].
#[derive(Default)]
struct Off {
    all: f32,
    k: f32,
    kk: f32,
    e: f32,
    ke: f32,
    /// Weighted sums of the samples' variance, weight and squared weight.
    blur2: f32,
    weight: f32,
    square: f32,
}

impl Off {
    /// Adds sample k; it counts less the farther it lies from the middle: `near` from 1 to 0.
    #[inline(always)]
    fn add(&mut self, k: f32, near: f32, sample: &Gathered) {
        let weight = sample.weight as f32;
        let e = sample.moment / weight;
        self.all += near;
        self.k += near * k;
        self.kk += near * (k * k);
        self.e += near * e;
        self.ke += near * (k * e);
        self.blur2 += near * (sample.second / weight - e * e);
        self.weight += near * weight;
        self.square += near * sample.square as f32;
    }

    /// Offset of the samples at k = 0, and its increase from one sample to the next.
    #[inline(always)]
    fn line(&self) -> (f32, f32) {
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
            columns: Vec::new(),
        }
    }

    /// Stores the profile at a place in a lane.
    #[inline(always)]
    pub fn put<G: Grey>(&mut self, lane: usize, image: G, seen: &Seen, s: &PeakFrame) {
        let window = Window::new(seen, s);
        let still = window.lean == 0.0;
        let fours = if still && window.columns { s.fours } else { 0 };
        let step = window.tall as f32 * window.nb;
        let alike = still.then(|| {
            window.columns(fours, &mut self.columns);
            window.alike(&self.columns)
        });
        let mut off = Off::default();
        let (mut low, mut high) = (0, 0);
        let half = self.half;
        for (side, j) in (0..2).flat_map(|side| (0..half).map(move |j| (side, j))) {
            let k = number(side, j);
            let sample = match &alike {
                Some(alike) => window.still(image, k as i32, fours > 0, &self.columns, alike),
                None => window.singles(image, k as i32),
            };
            let scale = 1.0 / sample.weight as f32;
            self.levels[side][j].0[lane] = sample.levels as f32 * scale;
            self.clipped[side][j].0[lane] = sample.clipped as f32 * scale;
            let e = sample.moment * scale;
            self.off[side][j].0[lane] = e;
            self.more[side][j].0[lane] = sample.second * scale - e * e;
            off.add(k, (1.0 - (k * step).abs() / (3.0 * s.s0)).max(0.0), &sample);
            if window.holds(k as i32, fours > 0) {
                (low, high) = (low.min(k as i32), high.max(k as i32));
            }
        }
        let (offset, by) = off.line();
        let blur2 = (off.blur2 / off.all).max(0.0);
        for (side, j) in (0..2).flat_map(|side| (0..half).map(move |j| (side, j))) {
            let stray = self.off[side][j].0[lane] - (offset + by * number(side, j));
            self.off[side][j].0[lane] = stray;
            self.more[side][j].0[lane] += stray * stray - blur2;
        }
        self.low.0[lane] = low as f32;
        self.high.0[lane] = high as f32;
        self.offset.0[lane] = offset;
        self.step.0[lane] = step + by;
        self.weight.0[lane] = off.weight / (off.all * WEIGHT);
        self.square.0[lane] = off.square / (off.all * WEIGHT * WEIGHT);
        self.blur2.0[lane] = blur2;
        self.base.0[lane] = seen.base;
        self.uneven2.0[lane] = seen.uneven2;
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
