//! In: block statistics. Out: a lower bound on the sum of any window around a pixel of a block. Frame and unit: blocks
//! of 16 x 8 pixels, 256ths of full scale.

use super::stats::Block;
use crate::stages::frame::Frame;

/// How the windows of all pixels of a block cover blocks of `edge` pixels, along one axis. Blocks up to `full` away are
/// covered whole. `rest` more pixels lie in the blocks beyond them, up to `reach` away.
#[derive(Clone, Copy, Debug)]
struct Cover {
    full: i32,
    reach: i32,
    rest: u32,
}

impl Cover {
    fn new(size: u32, edge: i32) -> Cover {
        let r = (size / 2) as i32;
        let full = if r >= edge - 1 { (r - edge + 1) / edge } else { -1 };
        let rest = size as i32 - if full >= 0 { edge * (2 * full + 1) } else { 0 };
        Cover { full, reach: (r + edge - 1) / edge, rest: rest as u32 }
    }
    fn all(self) -> impl Iterator<Item = i32> {
        -self.reach..=self.reach
    }
    /// Distances of the blocks that are covered in part.
    fn partial(self) -> impl Iterator<Item = i32> {
        self.all().filter(move |d| d.abs() > self.full)
    }
    fn whole(self) -> impl Iterator<Item = i32> {
        -self.full..=self.full
    }
}

/// Contribution of a column of blocks to the windows of all pixels of one of its blocks.
#[derive(Clone, Copy, Debug)]
struct Band {
    /// Least sum of the windows' rows over the block's width.
    sum: u32,
    /// Least sum over one column of pixels, of the rows that all windows cover.
    column: u32,
    /// Smallest pixel, and half the smallest quad, of the blocks that windows cover in part.
    smallest: u32,
    half_quad: u32,
}

/// The block statistics of one shot.
#[derive(Clone, Copy, Debug)]
pub struct Blocks<'a> {
    words: &'a [u32],
    columns: i32,
    rows: i32,
    /// Edge of the window, px.
    size: u32,
}

impl<'a> Blocks<'a> {
    /// `stats` has the format of [`crate::stages::stripe::stats`]: two words per block, shot by shot.
    pub fn new(f: &Frame, stats: &'a [u32], shot: u32) -> Blocks<'a> {
        let per_shot = (4 * f.tiles_x * f.tiles_y) as usize;
        let words = &stats[shot as usize * per_shot..][..per_shot];
        Blocks { words, columns: 2 * f.tiles_x as i32, rows: f.tiles_y as i32, size: f.size }
    }

    /// The block in column `x`, row `y` of blocks; beyond the picture the nearest block.
    pub fn block(&self, x: i32, y: i32) -> Block {
        let near = (x.clamp(0, self.columns - 1), y.clamp(0, self.rows - 1));
        Block::unpack(&self.words[2 * (near.1 * self.columns + near.0) as usize..][..2])
    }

    /// The block; above and below the picture one that repeats the border's pixels.
    fn repeated(&self, x: i32, y: i32) -> Block {
        let b = self.block(x, y);
        if (0..self.rows).contains(&y) {
            return b;
        }
        Block { sum: 8 * b.row, column: 8 * b.smallest, half_quad: 2 * b.smallest, ..b }
    }

    fn band(&self, x: i32, y: i32) -> Band {
        let cover = Cover::new(self.size, 8);
        let whole = |of: fn(Block) -> u32| cover.whole().map(|dy| of(self.repeated(x, y + dy))).sum::<u32>();
        let part = |of: fn(Block) -> u32| {
            cover.partial().map(|dy| of(self.repeated(x, y + dy))).min().expect("no window ends with a block")
        };
        let band = Band {
            sum: whole(|b| b.sum) + cover.rest * part(|b| b.row),
            column: whole(|b| b.column),
            smallest: part(|b| b.smallest),
            half_quad: part(|b| b.half_quad),
        };
        if (0..self.columns).contains(&x) {
            return band;
        }
        // Beyond the border the band's smallest column repeats sixteen times, and its smallest pixel four times.
        let sum = 16 * (band.column + cover.rest * band.smallest);
        Band { sum, half_quad: 2 * band.smallest, ..band }
    }

    /// Lower bound on the sum of every window whose centre lies in the block. Windows contain the blocks near it whole,
    /// and a part of those farther away.
    pub fn least_sum(&self, x: i32, y: i32) -> u32 {
        let (across, down) = (Cover::new(self.size, 16), Cover::new(self.size, 8));
        // The area covered in part in both directions contains this many whole quads, on both sides together.
        let quads = (across.rest - 1) / 2 * ((down.rest - 1) / 2);
        let singles = across.rest * down.rest - 4 * quads;
        let part = |of: fn(Band) -> u32| {
            across.partial().map(|dx| of(self.band(x + dx, y))).min().expect("no window ends with a block")
        };
        across.whole().map(|dx| self.band(x + dx, y).sum).sum::<u32>()
            + across.rest * part(|b| b.column)
            + 2 * quads * part(|b| b.half_quad)
            + singles * part(|b| b.smallest)
    }

    /// Smallest pixel of all blocks that overlap a window with its centre in the block: it bounds any weighted mean.
    pub fn darkest(&self, x: i32, y: i32) -> u32 {
        let (across, down) = (Cover::new(self.size, 16), Cover::new(self.size, 8));
        let near = down.all().flat_map(|dy| across.all().map(move |dx| (dx, dy)));
        near.map(|(dx, dy)| self.block(x + dx, y + dy).smallest).min().expect("the block itself")
    }
}
