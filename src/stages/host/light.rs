//! In: a picture, the proof for a row of tiles. Out: the lit pixels of that row of tiles, from exact window means,
//! which are computed only for pixels that may be lit. Frame and unit: pixels, tiles of 32 x 8 as eight words; grey
//! levels of the picture's depth.

use super::blocks::{Proof, level};
use super::sample::{EDGE, Sample};
use crate::stages::frame::{ALL_TILES, GAUSSIAN};
use crate::stages::stripe::threshold::passes_mean;
use crate::stages::{Frame, ThresholdParams};
use multiversion::multiversion;
use std::ops::{AddAssign, SubAssign};

/// The lit pixels of a tile, one word for each row.
pub type Tile = [u32; 8];
/// Pixels in a row of a tile.
const WIDE: usize = 32;
/// Up to this many pixels in question in a tile, each window is summed separately. Above it the tile's columns are
/// summed once for all of them.
const FEW: u32 = 6;
/// Most neighbouring tiles whose columns are summed together.
const MOST: usize = 16;

/// A picture with the settings of the threshold.
#[derive(Clone, Copy)]
pub struct View<'a, T> {
    pub px: &'a [T],
    pub f: &'a Frame,
    pub p: ThresholdParams,
    /// Weights along one axis of the Gaussian window.
    pub weights: &'a [f32],
}

impl<'a, T: Sample> View<'a, T> {
    fn row(&self, y: isize) -> &'a [T] {
        let (w, h) = (self.f.width as usize, self.f.height as isize);
        let from = y.clamp(0, h - 1) as usize * w;
        &self.px[from..from + w]
    }
}

/// Reused memory: sums along the columns and values derived from them.
#[derive(Default)]
pub struct Sums<W> {
    rolled: Rolled<W>,
    few: Vec<(usize, Tile)>,
    columns: Vec<W>,
    line: Vec<W>,
    before: Vec<u32>,
    sums: Vec<u32>,
    blurred: Vec<f32>,
    wide: Vec<f32>,
}

/// The lit pixels of row `ty` of tiles; `region` and `out` are that row's tiles.
pub fn row<T: Sample>(
    v: View<T>,
    ty: usize,
    proof: &Proof,
    region: Option<&[Tile]>,
    sums: &mut Sums<T::Wide>,
    out: &mut [Tile],
) {
    let tiles = v.f.tiles_x as usize;
    let wanted = |tx: usize| region.is_none_or(|r| r[tx] != [0; 8]);
    // Tiles whose columns must be summed wait for their neighbours.
    let mut run = 0..0;
    sums.few.clear();
    for tx in 0..tiles {
        let four: [u8; 4] = proof.lit[4 * tx..4 * tx + 4].try_into().expect("four blocks a tile");
        if u32::from_ne_bytes(four) == 0 || !wanted(tx) {
            continue;
        }
        let whole = if v.f.flags & ALL_TILES != 0 {
            true
        } else {
            let question = in_question(v, tx, ty, four, &proof.least[4 * tx..4 * tx + 4]);
            let count: u32 = question.iter().map(|w| w.count_ones()).sum();
            if (1..=FEW).contains(&count) && v.f.flags & GAUSSIAN == 0 {
                sums.few.push((tx, question));
            }
            count > FEW || v.f.flags & GAUSSIAN != 0 && count > 0
        };
        if whole && run.end == tx && run.len() < MOST {
            run.end = tx + 1;
        } else if whole {
            settle(v, ty, run, sums, out);
            run = tx..tx + 1;
        }
    }
    settle(v, ty, run, sums, out);
    few(v, ty, sums, out);
    if let Some(region) = region {
        for (tile, region) in out.iter_mut().zip(region) {
            (0..8).for_each(|r| tile[r] &= region[r]);
        }
    }
}

/// Pixels of a tile that pass against the least window of their block. They include all lit pixels.
#[multiversion(targets = "simd")]
fn in_question<T: Sample>(v: View<T>, tx: usize, ty: usize, four: [u8; 4], least: &[u32]) -> Tile {
    let (w, h) = (v.f.width as usize, v.f.height as usize);
    let mut levels = [u32::MAX; WIDE];
    for b in (0..4).filter(|&b| four[b] != 0) {
        levels[EDGE * b..EDGE * b + EDGE].fill(level(v.f, least[b]));
    }
    let (from, rows) = (WIDE * tx, (h - EDGE * ty).min(EDGE));
    let mut tile = [0; 8];
    for (r, word) in tile.iter_mut().enumerate().take(rows) {
        let row = &v.row((EDGE * ty + r) as isize)[from..w.min(from + WIDE)];
        *word = match <&[T; WIDE]>::try_from(row) {
            Ok(row) => bits(|i| T::number(row[i].wide()) >= levels[i]),
            Err(_) => bits(|i| i < row.len() && T::number(row[i].wide()) >= levels[i]),
        };
    }
    tile
}

/// A word of 32 answers, one bit each.
#[inline(always)]
fn bits(of: impl Fn(usize) -> bool) -> u32 {
    (0..WIDE).fold(0, |word, i| word | u32::from(of(i)) << i)
}

/// Tiles with few pixels in question. Each window is summed separately or, if that is less work, the columns of the
/// whole picture are updated from row to row: one row enters, one leaves.
fn few<T: Sample>(v: View<T>, ty: usize, s: &mut Sums<T::Wide>, out: &mut [Tile]) {
    let (height, rows) = (v.f.size as usize, (v.f.height as usize - EDGE * ty).min(EDGE));
    let pixels: u32 = s.few.iter().flat_map(|(_, question)| question).map(|w| w.count_ones()).sum();
    let alone = pixels as usize * height * (height + WIDE);
    let rolling = alone > v.f.width as usize * (s.rolled.rows_to(EDGE * ty, height) + 2 * rows);
    for r in 0..rows {
        for (tx, question) in &s.few {
            let mut left = question[r];
            while left != 0 {
                let i = left.trailing_zeros();
                left &= left - 1;
                let (x, y) = (WIDE * tx + i as usize, EDGE * ty + r);
                let sum = if rolling {
                    s.rolled.to(v, y);
                    s.rolled.window(v, x)
                } else {
                    window(v, x, y, &mut s.columns)
                };
                let value = T::number(v.row(y as isize)[x].wide());
                out[*tx][r] |= u32::from(passes_mean(value, sum, &v.p)) << i;
            }
        }
    }
}

/// Sums along all columns of the picture, over the window's rows around row `around`.
#[derive(Default)]
struct Rolled<W> {
    around: Option<usize>,
    columns: Vec<W>,
}

impl<W> Rolled<W> {
    /// Number of rows that are read to move the sums to row `y`.
    fn rows_to(&self, y: usize, height: usize) -> usize {
        self.around.and_then(|at| y.checked_sub(at)).map_or(height, |n| (2 * n).min(height))
    }
}

impl<W: Copy + Default + AddAssign + SubAssign> Rolled<W> {
    fn to<T: Sample<Wide = W>>(&mut self, v: View<T>, y: usize) {
        if self.around == Some(y) {
            return;
        }
        let (height, r) = (v.f.size as usize, (v.f.size / 2) as isize);
        match self.around {
            Some(at) if self.rows_to(y, height) < height => {
                for y in at as isize + 1..=y as isize {
                    exchange(v.row(y + r), v.row(y - 1 - r), &mut self.columns);
                }
            }
            _ => {
                self.columns.clear();
                self.columns.resize(v.f.width as usize, W::default());
                (y as isize - r..=y as isize + r).for_each(|y| enter(v.row(y), &mut self.columns));
            }
        }
        self.around = Some(y);
    }

    /// The sum of the window around a pixel of the row.
    #[inline]
    fn window<T: Sample<Wide = W>>(&self, v: View<T>, x: usize) -> u32 {
        let (columns, r) = (&self.columns, (v.f.size / 2) as usize);
        let (from, to) = (x.saturating_sub(r), (x + r + 1).min(columns.len()));
        let (left, right) = ((r - (x - from)) as u32, (x + r + 1 - to) as u32);
        let edges = left * T::number(columns[0]) + right * T::number(columns[columns.len() - 1]);
        edges + columns[from..to].iter().map(|&c| T::number(c)).sum::<u32>()
    }
}

#[multiversion(targets = "simd")]
fn enter<T: Sample>(row: &[T], columns: &mut [T::Wide]) {
    columns.iter_mut().zip(row).for_each(|(c, v)| *c += v.wide());
}

#[multiversion(targets = "simd")]
fn exchange<T: Sample>(enters: &[T], leaves: &[T], columns: &mut [T::Wide]) {
    for ((c, enters), leaves) in columns.iter_mut().zip(enters).zip(leaves) {
        *c += enters.wide();
        *c -= leaves.wide();
    }
}

/// The sum of the window around a pixel: first its columns, for which a whole row is added at once. `columns` is reused
/// memory on the heap: the compiler would split an array on the stack into single numbers.
#[multiversion(targets = "simd")]
fn window<T: Sample>(v: View<T>, x: usize, y: usize, columns: &mut Vec<T::Wide>) -> u32 {
    let (w, r) = (v.f.width as usize, (v.f.size / 2) as usize);
    let (from, to) = (x.saturating_sub(r), (x + r + 1).min(w));
    let (left, right) = ((r - (x - from)) as u32, (x + r + 1 - to) as u32);
    // Whole registers: some more columns, which are excluded at the end.
    let n = (to - from).next_multiple_of(WIDE).min(w);
    let first = from.min(w - n);
    columns.clear();
    columns.resize(n, T::Wide::default());
    let mut sum = 0;
    for y in y as isize - r as isize..=(y + r) as isize {
        let row = v.row(y);
        columns.iter_mut().zip(&row[first..first + n]).for_each(|(c, &v)| *c += v.wide());
        sum += left * T::number(row[0].wide()) + right * T::number(row[w - 1].wide());
    }
    sum + columns[from - first..to - first].iter().map(|&c| T::number(c)).sum::<u32>()
}

/// All pixels of a run of tiles.
fn settle<T: Sample>(v: View<T>, ty: usize, run: std::ops::Range<usize>, sums: &mut Sums<T::Wide>, out: &mut [Tile]) {
    if run.is_empty() {
        return;
    }
    if v.f.flags & GAUSSIAN != 0 {
        gaussian(v, ty, run, sums, out);
    } else {
        mean(v, ty, run, sums, out);
    }
}

/// Column sums over all rows of the window, updated from row to row: one row enters, one leaves. Then the sums over the
/// window's columns.
#[multiversion(targets = "simd")]
fn mean<T: Sample>(v: View<T>, ty: usize, run: std::ops::Range<usize>, s: &mut Sums<T::Wide>, out: &mut [Tile]) {
    let (w, h, r) = (v.f.width as usize, v.f.height as usize, (v.f.size / 2) as isize);
    let (from, n) = ((WIDE * run.start) as isize - r, WIDE * run.len() + 2 * r as usize);
    let (top, rows) = (EDGE * ty, (h - EDGE * ty).min(EDGE));
    s.columns.clear();
    s.columns.resize(n, T::Wide::default());
    for y in top as isize - r..=top as isize + r {
        each(v.row(y), from, s, |column, v| *column += v);
    }
    for k in 0..rows {
        let y = (top + k) as isize;
        if k > 0 {
            each(v.row(y + r), from, s, |column, v| *column += v);
            each(v.row(y - 1 - r), from, s, |column, v| *column -= v);
        }
        across(&s.columns, v.f.size as usize, &mut s.before, &mut s.sums);
        let row = v.row(y);
        for (i, tile) in out[run.clone()].iter_mut().enumerate() {
            let at = WIDE * (run.start + i);
            let row = &row[at..w.min(at + WIDE)];
            let sums: &[u32; WIDE] = s.sums[WIDE * i..WIDE * i + WIDE].try_into().expect("32 sums");
            let passes = |i: usize| passes_mean(T::number(row[i].wide()), sums[i], &v.p);
            tile[k] = match <&[T; WIDE]>::try_from(row) {
                Ok(row) => bits(|i| passes_mean(T::number(row[i].wide()), sums[i], &v.p)),
                Err(_) => bits(|i| i < row.len() && passes(i)),
            };
        }
    }
}

/// Changes every column by its pixel of a row; the first column is `from`.
#[inline(always)]
fn each<W: Copy + Default, T: Sample<Wide = W>>(row: &[T], from: isize, s: &mut Sums<W>, change: impl Fn(&mut W, W)) {
    let n = s.columns.len();
    match usize::try_from(from).ok().and_then(|from| row.get(from..from + n)) {
        Some(row) => s.columns.iter_mut().zip(row).for_each(|(c, v)| change(c, v.wide())),
        None => {
            widened(row, from, &mut s.line, n);
            s.columns.iter_mut().zip(&s.line).for_each(|(c, &v)| change(c, v));
        }
    }
}

/// `n` pixels of a row from `from` on; beyond the border the border pixel repeats.
#[inline(always)]
fn widened<T: Sample>(row: &[T], from: isize, out: &mut Vec<T::Wide>, n: usize) {
    let left = (-from).clamp(0, n as isize) as usize;
    let first = from.max(0) as usize;
    let inside = (n - left).min(row.len().saturating_sub(first));
    out.resize(n, T::Wide::default());
    out[..left].fill(row[0].wide());
    out[left + inside..].fill(row[row.len() - 1].wide());
    for (out, v) in out[left..].iter_mut().zip(&row[first.min(row.len())..][..inside]) {
        *out = v.wide();
    }
}

/// Sums of `size` neighbouring columns: the sum of all columns up to the last of them minus the sum of all before the
/// first.
#[inline(always)]
fn across<W: Copy + Into<u32>>(columns: &[W], size: usize, before: &mut Vec<u32>, sums: &mut Vec<u32>) {
    before.resize(columns.len() + 1, 0);
    // In deep pictures the sum of all columns may overflow a word, but the differences do not.
    let mut all = 0u32;
    for (before, &column) in before.iter_mut().zip(columns) {
        *before = all;
        all = all.wrapping_add(column.into());
    }
    before[columns.len()] = all;
    sums.clear();
    sums.extend(before[size..].iter().zip(&*before).map(|(to, from)| to.wrapping_sub(*from)));
}

/// First along the row, then down the columns, both in f32 and in ascending order, as in the shader.
#[multiversion(targets = "simd")]
fn gaussian<T: Sample>(v: View<T>, ty: usize, run: std::ops::Range<usize>, s: &mut Sums<T::Wide>, out: &mut [Tile]) {
    let (w, h, r) = (v.f.width as usize, v.f.height as usize, (v.f.size / 2) as isize);
    let (from, n) = ((WIDE * run.start) as isize - r, WIDE * run.len());
    let (top, rows) = (EDGE * ty, (h - EDGE * ty).min(EDGE));
    let reached = rows + 2 * r as usize;
    s.blurred.clear();
    s.blurred.resize(n * reached, 0.0);
    for (y, line) in (top as isize - r..).zip(s.blurred.chunks_exact_mut(n)) {
        widened(v.row(y), from, &mut s.line, n + 2 * r as usize);
        s.wide.clear();
        s.wide.extend(s.line.iter().map(|&v| T::number(v) as f32));
        for (k, &weight) in v.weights.iter().enumerate() {
            line.iter_mut().zip(&s.wide[k..]).for_each(|(o, &v)| *o += weight * v);
        }
    }
    for k in 0..rows {
        s.wide.clear();
        s.wide.resize(n, 0.0);
        for (j, &weight) in v.weights.iter().enumerate() {
            s.wide.iter_mut().zip(&s.blurred[(k + j) * n..]).for_each(|(s, &v)| *s += weight * v);
        }
        let row = v.row((top + k) as isize);
        for (i, tile) in out[run.clone()].iter_mut().enumerate() {
            let at = WIDE * (run.start + i);
            let row = &row[at..w.min(at + WIDE)];
            tile[k] = (0..).zip(row).fold(0, |word, (j, &value)| {
                let value = T::number(value.wide()) as i32;
                let mean = s.wide[WIDE * i + j].round_ties_even() as i32;
                word | u32::from(value - v.p.offset > mean && value >= i32::from(v.p.minimum)) << j
            });
        }
    }
}
