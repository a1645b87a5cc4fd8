//! In: the lit tiles of a picture. Out: the same tiles thinned to lines one pixel wide, from which nothing more can be
//! deleted. Frame and unit: tiles of 32 x 8 pixels as eight words, with a border of dark tiles. The rule is that of the
//! stage `thin`.

use super::light::Tile;
use crate::stages::Thinning;
use crate::stages::stripe::thin::{Neighbours, deletions, interior};
use multiversion::multiversion;

/// A mask tile by tile, with a dark tile beyond every border.
#[derive(Clone, Default)]
pub struct Tiles {
    pub words: Vec<Tile>,
    /// Distance in `words` from one row of tiles to the next.
    pub stride: usize,
}

impl Tiles {
    pub fn new(tiles_x: u32, tiles_y: u32) -> Tiles {
        let stride = tiles_x as usize + 2;
        Tiles { words: vec![[0; 8]; stride * (tiles_y as usize + 2)], stride }
    }
    /// Whether a pixel is set; it may lie in the picture or at most 8 pixels beyond it.
    #[inline(always)]
    pub fn get(&self, x: i32, y: i32) -> bool {
        let at = ((y >> 3) + 1) as usize * self.stride + ((x >> 5) + 1) as usize;
        self.words[at][(y & 7) as usize] >> (x & 31) & 1 == 1
    }
    pub fn set(&mut self, x: i32, y: i32) {
        let at = ((y >> 3) + 1) as usize * self.stride + ((x >> 5) + 1) as usize;
        self.words[at][(y & 7) as usize] |= 1 << (x & 31);
    }
    /// Column and row of the tile at an index.
    pub fn tile(&self, at: u32) -> (u32, u32) {
        (at % self.stride as u32 - 1, at / self.stride as u32 - 1)
    }
    /// Skeleton pixels of a tile with one or two neighbours. They include all ends.
    #[inline(always)]
    pub fn ends(&self, at: usize) -> Tile {
        let around = self.around(at);
        std::array::from_fn(|r| {
            // Neighbours are counted up to three with a chain of bit adders.
            let (mut one, mut two, mut more) = (0, 0, 0);
            for n in around[r] {
                more |= two & one & n;
                let carry = one & n;
                one ^= n;
                two |= carry;
            }
            self.words[at][r] & (one ^ two) & !more
        })
    }
    /// Pixels of a tile without another one above or below them within the distance of a spacing's setting. Empty for
    /// settings along rows or with a distance beyond the neighbouring tiles.
    #[inline(always)]
    pub fn alone(&self, at: usize, spacing: u32) -> Tile {
        if spacing == 0 || spacing > 8 {
            return [0; 8];
        }
        let column = [at - self.stride, at, at + self.stride].map(|at| self.words[at]);
        let row = |r: usize| column[r / 8][r % 8];
        std::array::from_fn(|r| {
            let near = (1..=spacing as usize).fold(0, |near, d| near | row(8 + r - d) | row(8 + r + d));
            self.words[at][r] & !near
        })
    }
    /// Pixels of a tile with another one within `near` columns and rows; `near` is at most 8.
    #[inline(always)]
    pub fn in_company(&self, at: usize, near: usize) -> Tile {
        let columns = [at - 1, at, at + 1].map(|at| [at - self.stride, at, at + self.stride].map(|at| self.words[at]));
        // For the rows of the tile and of the tiles above and below, 8 each. `beside`: whether a pixel to the left or
        // right of a place is set. `within`: that, or the place's own pixel.
        let beside: [u32; 24] = std::array::from_fn(|r| {
            let [west, own, east] = columns.map(|rows| rows[r / 8][r % 8]);
            (1..=near).fold(0, |near, d| near | own << d | west >> (32 - d) | own >> d | east << (32 - d))
        });
        let within: [u32; 24] = std::array::from_fn(|r| beside[r] | columns[1][r / 8][r % 8]);
        std::array::from_fn(|r| {
            let rows = (1..=near).fold(beside[8 + r], |rows, d| rows | within[8 + r - d] | within[8 + r + d]);
            self.words[at][r] & rows
        })
    }
    /// The eight neighbours of every pixel of a tile, row by row.
    #[inline(always)]
    pub fn around(&self, at: usize) -> [Neighbours; 8] {
        // Rows -1 to 8 of a tile.
        let column = |at: usize| -> [u32; 10] {
            let own = self.words[at];
            std::array::from_fn(|r| match r {
                0 => self.words[at - self.stride][7],
                9 => self.words[at + self.stride][0],
                r => own[r - 1],
            })
        };
        let (west, own, east) = (column(at - 1), column(at), column(at + 1));
        let right: [u32; 10] = std::array::from_fn(|r| own[r] >> 1 | east[r] << 31);
        let left: [u32; 10] = std::array::from_fn(|r| own[r] << 1 | west[r] >> 31);
        std::array::from_fn(|r| {
            let (above, below) = (r, r + 2);
            let own_row = r + 1;
            [
                own[above],
                right[above],
                right[own_row],
                right[below],
                own[below],
                left[below],
                left[own_row],
                left[above],
            ]
        })
    }
}

/// Memory for thinning that is reused from picture to picture.
#[derive(Default)]
pub struct Worn {
    /// Last sub-iteration in which a tile must be examined, because it or a neighbour changed.
    due: Vec<u32>,
    active: Vec<u32>,
    gone: Vec<Tile>,
}

/// Thins the listed tiles of a picture of that size: sub-iterations until two in a row delete nothing. A tile is
/// skipped if its neighbourhood did not change in the last two, because the same rule was already applied to the same
/// pixels.
pub fn thin(mask: &mut Tiles, list: &[u32], (width, height): (u32, u32), rule: Thinning, worn: &mut Worn) {
    if width < 3 || height < 3 {
        return;
    }
    worn.due.resize(mask.words.len(), 0);
    for &at in list {
        worn.due[at as usize] = 1;
    }
    for step in 0.. {
        worn.active.clear();
        worn.active.extend(list.iter().filter(|&&at| worn.due[at as usize] >= step));
        if worn.active.is_empty() {
            break;
        }
        worn.gone.clear();
        worn.gone.resize(worn.active.len(), [0; 8]);
        match rule {
            Thinning::ZhangSuen => decide::<true>(mask, &worn.active, (width, height), step, &mut worn.gone),
            Thinning::GuoHall => decide::<false>(mask, &worn.active, (width, height), step, &mut worn.gone),
        }
        for (&at, gone) in worn.active.iter().zip(&worn.gone) {
            if *gone == [0; 8] {
                continue;
            }
            let at = at as usize;
            (0..8).for_each(|r| mask.words[at][r] &= !gone[r]);
            for row in [at - mask.stride, at, at + mask.stride] {
                worn.due[row - 1..=row + 1].fill(step + 2);
            }
        }
    }
    // Neighbours that are not listed may have been marked as due: they are dark and stay dark.
    for &at in list {
        for row in [at as usize - mask.stride, at as usize, at as usize + mask.stride] {
            worn.due[row - 1..=row + 1].fill(0);
        }
    }
}

/// Pixels that one sub-iteration deletes, for every listed tile.
#[multiversion(targets = "simd")]
fn decide<const ZHANG_SUEN: bool>(
    mask: &Tiles,
    list: &[u32],
    (width, height): (u32, u32),
    step: u32,
    gone: &mut [Tile],
) {
    let rule = if ZHANG_SUEN { Thinning::ZhangSuen } else { Thinning::GuoHall };
    for (&at, gone) in list.iter().zip(gone) {
        let (tx, ty) = mask.tile(at);
        let around = mask.around(at as usize);
        let own = mask.words[at as usize];
        // As in OpenCV, the outermost rows and columns stay.
        let inside = interior(width, tx as usize);
        for r in 0..8 {
            gone[r] = own[r] & inside & deletions(rule, &around[r], step % 2 == 1);
        }
        if ty == 0 {
            gone[0] = 0;
        }
        let last = (height - 1) as usize;
        if last / 8 == ty as usize {
            gone[last % 8..].fill(0);
        }
    }
}
