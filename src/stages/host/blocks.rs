//! In: a band of a picture. Out: the blocks of 8 x 8 pixels that may contain a lit pixel, and the least sum of a window
//! around any of their pixels; all other blocks are proven dark. Frame and unit: blocks of pixels, four to a tile;
//! 256ths of full scale. docs/math.md, Stripe stages.

use super::sample::{EDGE, FOUR, Four, Sample};
use crate::stages::Frame;
use crate::stages::frame::{ALL_TILES, GAUSSIAN};
use crate::stages::stripe::stats::depth_shift;
use multiversion::multiversion;

/// Statistics of a row of blocks that the proof needs, one array for each quantity.
#[derive(Clone, Default)]
struct Row {
    sum: Vec<u16>,
    largest: Vec<u16>,
    smallest: Vec<u16>,
    /// Smallest sums of a row and of a column of the block.
    row: Vec<u16>,
    column: Vec<u16>,
}

/// Rows of blocks of a band of a picture, with `margin` rows and columns around them. Beyond the picture its border
/// repeats.
#[derive(Clone, Default)]
pub struct Blocks {
    rows: Vec<Row>,
    margin: usize,
    /// Number of the band's first row in the picture.
    first: usize,
    /// Number of rows that are computed, from the top of the margin.
    done: usize,
}

/// How the windows of all pixels of a block cover blocks, along one axis. Blocks up to `full` away are covered whole.
/// `rest` more pixels lie in the blocks beyond them, up to `reach` away.
#[derive(Clone, Copy)]
struct Cover {
    full: isize,
    reach: isize,
    rest: u32,
}

impl Cover {
    fn new(size: u32) -> Cover {
        let (r, edge) = ((size / 2) as isize, EDGE as isize);
        let full = if r >= edge - 1 { (r - edge + 1) / edge } else { -1 };
        Cover { full, reach: (r + edge - 1) / edge, rest: (size as isize - edge * (2 * full + 1).max(0)) as u32 }
    }
    fn whole(self) -> std::ops::RangeInclusive<isize> {
        -self.full..=self.full
    }
    /// Distances of the blocks that are covered in part.
    fn partial(self) -> impl Iterator<Item = isize> + Clone {
        (-self.reach..=self.reach).filter(move |d| d.abs() > self.full)
    }
}

/// Result for a row of blocks: `lit` is not 0 if a pixel of the block may pass against a window with a sum of `least`.
#[derive(Clone, Default)]
pub struct Proof {
    pub lit: Vec<u8>,
    pub least: Vec<u32>,
    /// For columns of blocks: least sums of their part of a window, over a block's width and over one column of pixels.
    bands: [Vec<u32>; 2],
    part: Vec<u16>,
}

impl Blocks {
    /// Memory for bands of `rows` rows.
    pub fn new(f: &Frame, rows: usize) -> Blocks {
        let margin = Cover::new(f.size).reach as usize;
        let of = || vec![0; FOUR * f.tiles_x as usize + 2 * margin];
        let row = || Row { sum: of(), largest: of(), smallest: of(), row: of(), column: of() };
        Blocks { rows: (0..rows + 2 * margin).map(|_| row()).collect(), margin, first: 0, done: 0 }
    }

    /// Begins a band with row `first`.
    pub fn begin(&mut self, first: usize) {
        (self.first, self.done) = (first, 0);
    }

    /// Computes the statistics down to the last row that row `y` needs, and no further, so that they are still in the
    /// cache when they are used.
    fn gather<T: Sample>(&mut self, px: &[T], f: &Frame, y: usize) {
        let last = f.tiles_y as isize - 1;
        while self.done <= y - self.first + 2 * self.margin {
            let at = (self.first + self.done) as isize - self.margin as isize;
            let row = &mut self.rows[self.done];
            statistics(px, f, at.clamp(0, last) as usize, self.margin, row);
            row.repeat_sides(self.margin);
            if !(0..=last).contains(&at) {
                *row = row.beyond();
            }
            self.done += 1;
        }
    }

    /// Proves row `y` of blocks; the rows of a band must come in order.
    pub fn prove<T: Sample>(&mut self, px: &[T], f: &Frame, y: usize, out: &mut Proof) {
        let across = FOUR * f.tiles_x as usize;
        out.lit.resize(across, 0);
        out.least.resize(across, 0);
        if f.flags & ALL_TILES != 0 {
            // The plain path uses no bound.
            out.lit.fill(1);
            return;
        }
        self.gather(px, f, y);
        let at = y - self.first + self.margin;
        bound(self, f, at, out);
        passing(f, &self.rows[at].largest[self.margin..], out);
    }
}

impl Row {
    /// Stores the statistics of four blocks, as 8-bit levels.
    #[inline(always)]
    fn put(&mut self, at: usize, four: &Four, deep: u32) {
        // The largest is rounded up, to the safe side.
        let up = (1 << deep) - 1;
        let columns: [(&mut Vec<u16>, &[u32; FOUR], u32); 5] = [
            (&mut self.sum, &four.sum, 0),
            (&mut self.row, &four.row, 0),
            (&mut self.column, &four.column, 0),
            (&mut self.largest, &four.largest, up),
            (&mut self.smallest, &four.smallest, 0),
        ];
        for (to, from, up) in columns {
            let to: &mut [u16; FOUR] = (&mut to[at..at + FOUR]).try_into().expect("four blocks");
            for b in 0..FOUR {
                to[b] = ((from[b] + up) >> deep) as u16;
            }
        }
    }
    /// Beyond the left and right borders each row repeats its last pixel: the sum of a block there is eight times its
    /// border column, of which the smallest column is a lower bound.
    fn repeat_sides(&mut self, margin: usize) {
        let last = self.sum.len() - margin - 1;
        for (from, to) in [(margin, 0..margin), (last, last + 1..last + 1 + margin)] {
            let (column, smallest) = (self.column[from], self.smallest[from]);
            self.sum[to.clone()].fill(8 * column);
            self.row[to.clone()].fill(8 * smallest);
            self.column[to.clone()].fill(column);
            self.smallest[to].fill(smallest);
        }
    }
    /// Above and below the picture each column repeats its last pixel.
    fn beyond(&self) -> Row {
        let eight = |v: &[u16]| v.iter().map(|v| 8 * v).collect();
        Row { sum: eight(&self.row), column: eight(&self.smallest), ..self.clone() }
    }
}

/// Statistics of one row of blocks; beyond the border the border's pixels repeat.
#[multiversion(targets = "simd")]
fn statistics<T: Sample>(px: &[T], f: &Frame, y: usize, margin: usize, out: &mut Row) {
    let (w, deep) = (f.width as usize, depth_shift(f));
    let line = |r: usize| {
        let from = (EDGE * y + r).min(f.height as usize - 1) * w;
        &px[from..from + w]
    };
    let lines: [&[T]; EDGE] = std::array::from_fn(line);
    let whole = w / 32;
    for tx in 0..whole {
        out.put(margin + FOUR * tx, &T::four(&lines, 32 * tx), deep);
    }
    if whole < f.tiles_x as usize {
        let rest: [[T; 32]; EDGE] = lines.map(|line| std::array::from_fn(|i| line[(32 * whole + i).min(w - 1)]));
        out.put(margin + FOUR * whole, &T::four(&rest.each_ref().map(|r| &r[..]), 0), deep);
    }
}

/// Lower bounds on the sums of the windows around a row's pixels. Windows contain the blocks near them whole, and a
/// part of those farther away.
#[multiversion(targets = "simd")]
fn bound(blocks: &Blocks, f: &Frame, y: usize, out: &mut Proof) {
    let cover = Cover::new(f.size);
    let at = |d: isize| &blocks.rows[(y as isize + d) as usize];
    let across = out.least.len() + 2 * blocks.margin;
    let smallest_of = |part: &mut Vec<u16>, distances: &mut dyn Iterator<Item = isize>, of: fn(&Row) -> &[u16]| {
        part.clear();
        part.resize(across, u16::MAX);
        for d in distances {
            part.iter_mut().zip(of(at(d))).for_each(|(p, &v)| *p = (*p).min(v));
        }
    };
    if f.flags & GAUSSIAN != 0 {
        // The smallest pixel that a window can contain bounds any weighted mean.
        smallest_of(&mut out.part, &mut (-cover.reach..=cover.reach), |r| &r.smallest);
        for (x, least) in out.least.iter_mut().enumerate() {
            let near = &out.part[x..=x + 2 * blocks.margin];
            *least = f.size * f.size * u32::from(near.iter().copied().fold(u16::MAX, u16::min));
        }
        return;
    }
    let sums: [(fn(&Row) -> &[u16], fn(&Row) -> &[u16]); 2] =
        [(|r| &r.sum, |r| &r.row), (|r| &r.column, |r| &r.smallest)];
    for (band, (whole, part)) in out.bands.iter_mut().zip(sums) {
        smallest_of(&mut out.part, &mut cover.partial(), part);
        band.clear();
        band.extend(out.part.iter().map(|&p| cover.rest * u32::from(p)));
        for d in cover.whole() {
            band.iter_mut().zip(whole(at(d))).for_each(|(b, &v)| *b += u32::from(v));
        }
    }
    let beside = |d: isize| (blocks.margin as isize + d) as usize;
    out.least.fill(u32::MAX);
    for d in cover.partial() {
        out.least.iter_mut().zip(&out.bands[1][beside(d)..]).for_each(|(l, &b)| *l = (*l).min(b));
    }
    out.least.iter_mut().for_each(|l| *l *= cover.rest);
    for d in cover.whole() {
        out.least.iter_mut().zip(&out.bands[0][beside(d)..]).for_each(|(l, &b)| *l += b);
    }
}

/// If even the block's largest pixel does not pass against that bound, none of its pixels passes against its true mean.
#[multiversion(targets = "simd")]
fn passing(f: &Frame, largest: &[u16], out: &mut Proof) {
    let deep = depth_shift(f);
    let area = (f.size * f.size) as i32;
    let half = half(f);
    for ((lit, &least), &top) in out.lit.iter_mut().zip(&out.least).zip(largest) {
        let top = i32::from(top) << deep;
        let passes = area * (top - f.offset) > ((least << deep) as i32) + half && top >= f.minimum as i32;
        *lit = u8::from(passes);
    }
}

/// Added to a sum so that a comparison with it rounds the mean.
fn half(f: &Frame) -> i32 {
    if f.flags & GAUSSIAN != 0 { 0 } else { ((f.size * f.size) as i32 - 1) / 2 }
}

/// Least brightness that passes against a window of that sum, in the picture's own grey levels.
pub fn level(f: &Frame, least: u32) -> u32 {
    let area = (f.size * f.size) as i32;
    let mean = (((least << depth_shift(f)) as i32) + half(f)) / area;
    (mean + f.offset + 1).max(f.minimum as i32).max(0) as u32
}
