//! In: pictures, skeleton pixels, the directions across the stripe. Out: the sums over the pixels of one sample of a
//! stripe's profile, for as many places side by side as fits run. Frame and unit: px, grey levels. docs/math.md, Stripe
//! peak (2).

use super::PeakFrame;
use super::grey::Grey;
use super::lanes::{LANES, Lanes, Whole};
use std::array::from_fn;
use std::hint::black_box;

/// Weights along the stripe are whole numbers up to this: sums are then exact.
pub(super) const WEIGHT: f32 = 127.0;

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
pub(super) fn lean(na: f32, nb: f32) -> f32 {
    let lean = na * nb;
    if lean.abs() < STILL { 0.0 } else { lean }
}

/// How far a window may reach to both sides along a. It reaches no farther than the picture does on either side,
/// because an error of the direction would move the centre of an asymmetric window. It also reaches no farther than the
/// shifted columns of the skeleton pixel's own sample lie in the picture, because a profile without that sample has no
/// crest. The 0.03 keeps rounding from deciding at whole numbers.
#[inline(always)]
fn room((a0, b0): (i32, i32), (na, nb): (f32, f32), (last_a, last_b): (i32, i32)) -> i32 {
    let across = b0.min(last_b - b0) as f32 * nb.abs() / na.abs().max(1e-6);
    a0.min(last_a - a0).min((across.min(8192.0) + 0.03).floor() as i32)
}

/// The windows of profiles side by side: a counts along the image axis that the stripe is closer to, b across it. A
/// window is a rectangle along the stripe: on a slanted stripe its middle moves along a from row to row. Windows of
/// whole columns would have flanks from other places of the stripe, and at edges from another surface.
pub(super) struct Windows<G> {
    images: [G; LANES],
    /// Whether a counts columns of the picture, else rows.
    columns: [bool; LANES],
    a0: Whole,
    b0: Whole,
    /// The normal along a and b.
    na: Lanes,
    nb: Lanes,
    /// Shift of the windows' middles along a from row to row.
    lean: Lanes,
    /// Offset of the first column from the pixel at the window's middle.
    first: Whole,
    /// Columns that may have weight, and the most of any window.
    own: Whole,
    count: i32,
    /// 1 where groups of four columns share their shift, and the offset of a group's middle from its first column.
    fours: Whole,
    mid: Lanes,
    /// To how many pixels the picture limits a window on both sides, and how many of them may have weight.
    room: Whole,
    reach: Whole,
    /// 1 / R² along a.
    fade: Lanes,
    /// Rows of a sample.
    tall: i32,
    /// The pictures' last pixels along a and b.
    last: (Whole, Whole),
    /// Pixels from one to the next along a and b, in the order in which a picture is stored.
    stride: (Whole, Whole),
    full_scale: i32,
}

/// One column of each window: offset from the skeleton pixel, shift along the line, weight.
#[derive(Clone, Copy)]
pub(super) struct Column {
    i: Whole,
    shift: Whole,
    weight: Whole,
}

/// Four neighbouring columns of each window that share their shift, so that their pixels in a line are neighbours in
/// the picture.
#[derive(Clone, Copy)]
pub(super) struct Four {
    /// Number of the first column's pixel in line 0.
    at: Whole,
    weights: [Whole; 4],
}

/// The columns of windows that do not move: all, those that are read four at a time, and the others.
#[derive(Default)]
pub(super) struct Still {
    all: Vec<Column>,
    fours: Vec<Four>,
    single: Vec<Column>,
}

/// Weighted sums over the pixels of a sample.
#[derive(Clone, Copy)]
pub(super) struct Gathered {
    pub levels: Whole,
    pub clipped: Whole,
    pub weight: Whole,
    pub square: Whole,
    /// Sums of the offsets across from the sample's nominal one, and of their squares.
    pub moment: Lanes,
    pub second: Lanes,
}

impl Gathered {
    const NONE: Gathered = Gathered {
        levels: Whole::ZERO,
        clipped: Whole::ZERO,
        weight: Whole::ZERO,
        square: Whole::ZERO,
        moment: Lanes::ZERO,
        second: Lanes::ZERO,
    };

    /// Adds pixels of weight g, at offsets e from their samples.
    #[inline(always)]
    fn place(&mut self, g: Whole, e: Lanes) {
        let f = g.float();
        self.weight = self.weight + g;
        self.square = self.square + g * g;
        self.moment = self.moment + f * e;
        self.second = self.second + f * (e * e);
    }

    /// Adds the light of pixels of weight g.
    #[inline(always)]
    fn light(&mut self, g: Whole, level: Whole, full_scale: i32) {
        self.levels = self.levels + g * level;
        self.clip(g, level, full_scale);
    }

    /// Adds the weight of pixels that are clipped.
    #[inline(always)]
    fn clip(&mut self, g: Whole, level: Whole, full_scale: i32) {
        self.clipped = self.clipped + g.with(level, |g, level| if level >= full_scale { g } else { 0 });
    }
}

impl<G: Grey> Windows<G> {
    #[inline(always)]
    pub fn new(images: [G; LANES], seen: &[Seen; LANES], s: &PeakFrame) -> Windows<G> {
        let columns: [bool; LANES] = from_fn(|lane| by_columns(seen[lane].n));
        let turned = |lane: usize, (u, v): (i32, i32)| if columns[lane] { (u, v) } else { (v, u) };
        let at: [(i32, i32); LANES] = from_fn(|lane| turned(lane, seen[lane].at));
        let last: [(i32, i32); LANES] = from_fn(|lane| turned(lane, (s.width - 1, s.height - 1)));
        let stride: [(i32, i32); LANES] = from_fn(|lane| turned(lane, (1, s.width)));
        let normal: [(f32, f32); LANES] = from_fn(|lane| {
            let (u, v) = seen[lane].n;
            if columns[lane] { (u, v) } else { (v, u) }
        });
        let lean = Lanes(normal.map(|(na, nb)| lean(na, nb)));
        let nb = Lanes(normal.map(|n| n.1));
        // The pixel nearest to the middle may be half a pixel off it.
        let off = (lean.map(f32::abs) * Lanes::all(s.half_across * s.rows as f32)).min(Lanes::all(0.5));
        let reach = Whole::floor(Lanes::all(s.radius) * nb.map(f32::abs) + off);
        let grouped: [bool; LANES] = from_fn(|lane| s.fours > 0 && columns[lane] && lean.0[lane] == 0.0);
        let farthest = reach.0.into_iter().max().expect("lanes");
        // Groups are those in which pixels are stored. Columns that a window does not reach have no weight.
        let first =
            |lane: usize| if grouped[lane] { ((at[lane].0 - 2 * s.fours + 2) & !3) - at[lane].0 } else { -farthest };
        let own = Whole(grouped.map(|g| if g { 4 * s.fours } else { 2 * farthest + 1 }));
        Windows {
            images,
            columns,
            a0: Whole(at.map(|a| a.0)),
            b0: Whole(at.map(|a| a.1)),
            na: Lanes(normal.map(|n| n.0)),
            nb,
            lean,
            first: Whole(from_fn(first)),
            own,
            count: own.0.into_iter().max().expect("lanes"),
            fours: Whole(grouped.map(i32::from)),
            mid: Lanes(grouped.map(|g| if g { 1.5 } else { 0.0 })),
            room: Whole(from_fn(|lane| room(at[lane], normal[lane], last[lane]))),
            reach,
            fade: Lanes::all(s.along_factor) / (nb * nb),
            tall: s.rows,
            last: (Whole(last.map(|l| l.0)), Whole(last.map(|l| l.1))),
            stride: (Whole(stride.map(|l| l.0)), Whole(stride.map(|l| l.1))),
            full_scale: s.full_scale as i32,
        }
    }

    /// Step from sample to sample across the stripe, px.
    #[inline(always)]
    pub fn step(&self) -> Lanes {
        Lanes::all(self.tall as f32) * self.nb
    }

    /// The windows' middles in a row, and the pixels there. Not + 0.5, so that rounding errors do not decide at 45
    /// degrees.
    #[inline(always)]
    fn middle(&self, row: i32) -> (Lanes, Whole) {
        let middle = Lanes::all(row as f32) * self.lean;
        (middle, Whole::floor(middle + Lanes::all(0.47)))
    }

    /// Whole pixels by which a column at `i` is shifted to follow the line. Not + 0.5, so that rounding errors do not
    /// decide at 45 degrees.
    #[inline(always)]
    fn shift(&self, i: Lanes) -> Whole {
        Whole::floor(-(i * self.na) / self.nb + Lanes::all(0.47))
    }

    /// Column c of the windows in a row with these middles.
    #[inline(always)]
    fn column(&self, c: i32, (middle, pixel): (Lanes, Whole)) -> Column {
        let off = self.first + Whole::all(c);
        let i = off + pixel;
        let shift = self.shift((i - self.fours * Whole::all(c & 3)).float() + self.mid);
        let t = i.float() - middle;
        let f = (Lanes::all(1.0) - self.fade * (t * t)).max(Lanes::ZERO);
        let weight = Whole::floor(Lanes::all(WEIGHT) * (f * f) + Lanes::all(0.5));
        let near = off.with(self.room, |off, room| i32::from(off.abs() <= room));
        let among = self.own.with(near, |own, near| if c < own { near } else { 0 });
        Column { i, shift, weight: weight.with(among, |weight, among| if among != 0 { weight } else { 0 }) }
    }

    /// Offset across of a column's pixel in a row of a sample from the sample's nominal one.
    #[inline(always)]
    fn across(&self, column: &Column, row: i32) -> Lanes {
        (column.shift + Whole::all(row)).float() * self.nb + column.i.float() * self.na
    }

    /// The levels of a column's pixels in a line.
    #[inline(always)]
    fn levels<const INNER: bool>(&self, column: &Column, line: i32) -> Whole {
        let (a, b) = (self.a0 + column.i, (self.b0 + column.shift) + Whole::all(line));
        if INNER {
            // Stored at once, or they are computed one by one where they are used.
            let index = black_box(a * self.stride.0 + b * self.stride.1);
            Whole(index.0.map(|number| self.images[0].stored(number)))
        } else {
            Whole(from_fn(|lane| {
                let (a, b) = (a.0[lane], b.0[lane]);
                let (u, v) = if self.columns[lane] { (a, b) } else { (b, a) };
                self.images[lane].whole(u, v)
            }))
        }
    }

    /// Sample k.
    #[inline(always)]
    pub fn sample<const INNER: bool>(&self, k: i32) -> Gathered {
        let mut sums = Gathered::NONE;
        for row in 0..self.tall {
            let line = k * self.tall + row;
            let middle = self.middle(line);
            for c in 0..self.count {
                let column = self.column(c, middle);
                sums.place(column.weight, self.across(&column, row));
                sums.light(column.weight, self.levels::<INNER>(&column, line), self.full_scale);
            }
        }
        sums
    }

    /// The sums that all samples of windows that do not move have in common: all except their light. Their columns are
    /// the same for all samples. None if a window moves. With `INNER`, pixels beside the windows lie in the picture,
    /// too.
    #[inline(always)]
    pub fn alike<const INNER: bool>(&self, still: &mut Still) -> Option<Gathered> {
        if self.lean.0.iter().any(|&lean| lean != 0.0) {
            return None;
        }
        let Still { all, fours, single } = still;
        all.clear();
        fours.clear();
        single.clear();
        // Columns beyond a window have no weight.
        let whole = (self.count + 3) & !3;
        all.extend((0..whole).map(|c| self.column(c, (Lanes::ZERO, Whole::ZERO))));
        let mut sums = Gathered::NONE;
        for row in 0..self.tall {
            all.iter().for_each(|column| sums.place(column.weight, self.across(column, row)));
        }
        let in_rows = INNER && self.columns == [true; LANES];
        for four in all.chunks_exact(4) {
            let shift = four[0].shift;
            if in_rows && four.iter().all(|column| column.shift.0 == shift.0) {
                let at = (self.a0 + four[0].i) + (self.b0 + shift) * self.stride.1;
                fours.push(Four { at, weights: from_fn(|c| four[c].weight) });
            } else {
                single.extend(four.iter().filter(|column| column.weight.0 != [0; LANES]));
            }
        }
        Some(sums)
    }

    /// Visits weights and levels of the pixels of sample k that are read four at a time.
    #[inline(always)]
    fn by_fours(&self, k: i32, fours: &[Four], mut visit: impl FnMut(Whole, Whole)) {
        for line in k * self.tall..(k + 1) * self.tall {
            let down = Whole::all(line) * self.stride.1;
            for Four { at, weights } in fours {
                let four = (*at + down).0.map(|number| self.images[0].four(number));
                for (c, &weight) in weights.iter().enumerate() {
                    visit(weight, Whole(four.map(|four| G::of_four(four, c))));
                }
            }
        }
    }

    /// Sample k of windows that do not move: its light; all else is as in `alike`.
    #[inline(always)]
    pub fn still<const INNER: bool>(&self, k: i32, still: &Still, alike: &Gathered) -> Gathered {
        let (mut sums, mut most) = (*alike, Whole::ZERO);
        self.by_fours(k, &still.fours, |weight, level| {
            sums.levels = sums.levels + weight * level;
            most = most.with(level, i32::max);
        });
        // Few samples have clipped pixels.
        if most.0.iter().any(|level| *level >= self.full_scale) {
            self.by_fours(k, &still.fours, |weight, level| sums.clip(weight, level, self.full_scale));
        }
        for line in k * self.tall..(k + 1) * self.tall {
            for column in &still.single {
                sums.light(column.weight, self.levels::<INNER>(column, line), self.full_scale);
            }
        }
        sums
    }

    /// k where all pixels of sample k that have weight lie in the picture, else 0. The pixels at the window's ends
    /// decide. Columns that share their shift with three others lie up to one and a half columns from where the shift
    /// is exact.
    #[inline(always)]
    pub fn held(&self, k: i32) -> Lanes {
        let reach = self.reach.with(self.room, i32::min);
        let mut held = [true; LANES];
        for line in [k * self.tall, (k + 1) * self.tall - 1] {
            let pixel = self.middle(line).1;
            for end in [-1, 1] {
                let i = pixel + Whole::all(end) * reach;
                let shift = self.shift(i.float() + end as f32 * self.mid);
                let (a, b) = (self.a0 + i, (self.b0 + shift) + Whole::all(line));
                for (lane, held) in held.iter_mut().enumerate() {
                    *held &= (0..=self.last.0.0[lane]).contains(&a.0[lane])
                        && (0..=self.last.1.0[lane]).contains(&b.0[lane]);
                }
            }
        }
        Lanes(held.map(|held| if held { k as f32 } else { 0.0 }))
    }
}
