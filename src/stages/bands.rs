//! In: block statistics. Out: per block what its column of blocks gives to the windows around it ([`Band`]).
//! Frame and unit: blocks of 16 x 8 pixels, 256ths of full scale.

use super::frame::{self, Frame, PX_LOG2, SHARED, frame_of};
use super::stats::Block;
use super::threshold::RADIUS;
use crate::gpu::{Access::*, Binding, Stage};

pub const STAGE: Stage = Stage {
    name: "bands",
    wgsl: include_str!("../../shaders/bands.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "stats", access: Texels },
        Binding { name: "bands", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2, RADIUS],
};

/// One invocation four tiles, one below the other.
pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.tiles_x * f.tiles_y.div_ceil(4) * f.shots, 1, 1])
}

/// How the windows of all pixels of a block lie over blocks of `edge` pixels, along one axis: blocks up to `full` away
/// are covered whole, `rest` pixels more lie in the blocks beyond them up to `reach` away.
#[derive(Clone, Copy, Debug)]
pub struct Cover {
    pub full: i32,
    pub reach: i32,
    pub rest: u32,
}

impl Cover {
    pub fn new(size: u32, edge: i32) -> Cover {
        let r = (size / 2) as i32;
        let full = if r >= edge - 1 { (r - edge + 1) / edge } else { -1 };
        let rest = size as i32 - if full >= 0 { edge * (2 * full + 1) } else { 0 };
        Cover { full, reach: (r + edge - 1) / edge, rest: rest as u32 }
    }
    /// Distances of the blocks that are covered in part.
    pub fn partial(self) -> impl Iterator<Item = i32> {
        (-self.reach..=self.reach).filter(move |d| d.abs() > self.full)
    }
    pub fn whole(self) -> impl Iterator<Item = i32> {
        -self.full..=self.full
    }
}

/// What a column of blocks gives to the windows of all pixels of one of its blocks, and that block's largest pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// Least sum of the windows' rows over the block's width.
    pub sum: u32,
    pub largest: u32,
    /// Least sum over one column of pixels of the rows that all windows cover.
    pub column: u32,
    /// Smallest pixel, and half the smallest quad, of the blocks that windows cover in part.
    pub smallest: u32,
    pub half_quad: u32,
}

impl Band {
    pub fn unpack(words: &[u32]) -> Band {
        Band {
            sum: words[0] & 0x7f_ffff,
            largest: words[0] >> 23,
            column: words[1] & 0x7fff,
            smallest: words[1] >> 15 & 0xff,
            half_quad: words[1] >> 23,
        }
    }
    fn pack(&self) -> [u32; 2] {
        [self.sum | self.largest << 23, self.column | self.smallest << 15 | self.half_quad << 23]
    }
}

pub fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, stats, bands] = b else { unreachable!() };
    let (blocks_x, blocks_y) = (2 * f.tiles_x as usize, f.tiles_y as i32);
    let cover = Cover::new(f.size, 8);
    for (at, out) in bands.chunks_exact_mut(2).enumerate().take(2 * f.tiles() as usize) {
        let (x, row) = (at % blocks_x, (at / blocks_x) as i32);
        let (shot, y) = (row / blocks_y, row % blocks_y);
        // Above and below the picture its border's pixels repeat.
        let block = |dy: i32| {
            let near = (y + dy).clamp(0, blocks_y - 1);
            let at = 2 * ((shot * blocks_y + near) as usize * blocks_x + x);
            let b = Block::unpack(&stats[at..at + 2]);
            if near == y + dy {
                return b;
            }
            Block { sum: 8 * b.row, column: 8 * b.smallest, half_quad: 2 * b.smallest, ..b }
        };
        let whole = |of: fn(Block) -> u32| cover.whole().map(|dy| of(block(dy))).sum::<u32>();
        let part =
            |of: fn(Block) -> u32| cover.partial().map(|dy| of(block(dy))).min().expect("no window ends with a block");
        let band = Band {
            sum: whole(|b| b.sum) + cover.rest * part(|b| b.row),
            largest: block(0).largest,
            column: whole(|b| b.column),
            smallest: part(|b| b.smallest),
            half_quad: part(|b| b.half_quad),
        };
        out.copy_from_slice(&band.pack());
    }
}
