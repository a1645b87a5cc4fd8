//! In: pictures. Out: per block of 16 x 8 pixels (sum | largest << 15 | smallest << 24, smallest row sum |
//! smallest column sum << 12 | half the smallest sum of 2 x 2 << 23). Frame and unit: pixels, 256ths of full scale.

use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::frame;
use crate::stages::frame::{Frame, PX_LOG2, SHARED, frame_of};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// Sums and extremes of blocks of 16 x 8 pixels; one invocation per block.
pub const STAGE: Stage = Stage {
    name: "stats",
    wgsl: include_str!("../../../shaders/stats.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "image", access: Texels },
        Binding { name: "stats", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// Sums and extremes of every block.
pub const STEP: Step =
    Step { stage: &STAGE, twin, binds: &["frame", "image", "stats"], groups: Groups::Of(groups), same: Same::Words };

/// One invocation per block, two blocks per tile.
pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([2 * f.tiles(), 1, 1])
}

/// Number of bits by which the pictures' depth exceeds eight. Statistics of deeper pictures are in 256ths of full
/// scale, so that a block fits two words. They are rounded to the safe side: the largest pixel up, all others down.
pub fn depth_shift(f: &Frame) -> u32 {
    f.full_scale.count_ones() - 8
}

/// Statistics of one block, unpacked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Sum of all 128 pixels, rounded down.
    pub sum: u32,
    /// Largest pixel, rounded up, 0..=256.
    pub largest: u32,
    /// Smallest pixel, rounded down.
    pub smallest: u32,
    /// Smallest sum of a row of 16 pixels, rounded down.
    pub row: u32,
    /// Smallest sum of a column of 8 pixels, rounded down.
    pub column: u32,
    /// Half the smallest sum of 2 x 2 pixels that begin at an even column and row of the block.
    pub half_quad: u32,
}

impl Block {
    /// A block from its two words.
    pub fn unpack(words: &[u32]) -> Block {
        Block {
            sum: words[0] & 0x7fff,
            largest: words[0] >> 15 & 511,
            smallest: words[0] >> 24,
            row: words[1] & 0xfff,
            column: words[1] >> 12 & 0x7ff,
            half_quad: words[1] >> 23,
        }
    }
    fn pack(&self) -> [u32; 2] {
        [self.sum | self.largest << 15 | self.smallest << 24, self.row | self.column << 12 | self.half_quad << 23]
    }
}

/// Grey level at (x, y) of a shot in packed words; x may lie in the padding, y is clamped.
pub fn padded_pixel(f: &Frame, image: &[u32], px_log2: u32, shot: u32, x: u32, y: u32) -> u32 {
    let bits = 32 >> px_log2;
    let at = shot * f.shot_words + y.min(f.height - 1) * f.pitch + (x >> px_log2);
    image[at as usize] >> (x % (1 << px_log2) * bits) & ((1u64 << bits) - 1) as u32
}

/// CPU twin: the blocks of all pictures of a batch.
pub fn twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, image, stats] = b else { unreachable!() };
    for (i, out) in stats.chunks_exact_mut(2).enumerate().take(2 * f.tiles() as usize) {
        let (x, y) = (i as u32 % (2 * f.tiles_x), i as u32 / (2 * f.tiles_x));
        let px = |c: u32, r: u32| {
            let y_in_shot = y % f.tiles_y * 8 + r;
            padded_pixel(&f, image, overrides[0].1 as u32, y / f.tiles_y, 16 * x + c, y_in_shot)
        };
        let rows: Vec<u32> = (0..8).map(|r| (0..16).map(|c| px(c, r)).sum()).collect();
        let columns: Vec<u32> = (0..16).map(|c| (0..8).map(|r| px(c, r)).sum()).collect();
        let quad = |i: u32| (0..4).map(|k| px(i % 8 * 2 + k % 2, i / 8 * 2 + k / 2)).sum::<u32>();
        let all = || (0..8).flat_map(|r| (0..16).map(move |c| (c, r))).map(|(c, r)| px(c, r));
        let deep = depth_shift(&f);
        let block = Block {
            sum: rows.iter().sum::<u32>() >> deep,
            largest: all().max().expect("128 pixels").div_ceil(1 << deep),
            smallest: all().min().expect("128 pixels") >> deep,
            row: rows.iter().min().expect("8 rows") >> deep,
            column: columns.iter().min().expect("16 columns") >> deep,
            half_quad: (0..32).map(quad).min().expect("32 quads") >> deep >> 1,
        };
        out.copy_from_slice(&block.pack());
    }
}
