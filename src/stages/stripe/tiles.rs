//! In: block statistics. Out: the tiles that may contain a lit pixel: those that stand alone as (tile, least sum of its
//! windows), and runs of tiles one below the other as (first tile, number of tiles). The others are proven dark. Frame
//! and unit: tiles of 32 x 8 pixels, blocks of 16 x 8, sums in 256ths of full scale.

use super::bound::Blocks;
use super::stats::depth_shift;
use super::threshold::RADIUS;
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::frame;
use crate::stages::frame::{ALL_TILES, Frame, GAUSSIAN, HAS_ROI, PX_LOG2, SHARED, frame_of, tile_pack};
use crate::stages::listing::{self, append};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// The tiles that may contain a lit pixel; one invocation for four tiles, one below the other.
pub const STAGE: Stage = Stage {
    name: "tiles",
    wgsl: include_str!("../../../shaders/tiles.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "stats", access: Texels },
        Binding { name: "roi", access: Texels },
        Binding { name: "listing", access: ReadWrite },
        Binding { name: "single_listing", access: ReadWrite },
        Binding { name: "singles", access: ReadWrite },
        Binding { name: "run_listing", access: ReadWrite },
        Binding { name: "runs", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2, RADIUS, WEIGHTED],
};

/// Lists the tiles that may contain a lit pixel.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin,
    binds: &["frame", "stats", "roi", "all header", "single header", "singles", "run header", "runs"],
    groups: Groups::Of(groups),
    same: Same::Lists(&[(5, 2), (7, 2)]),
};

/// 1 for a window with weights ([`GAUSSIAN`]): a constant of the pipeline.
pub const WEIGHTED: &str = "weighted";
/// Length of the longest run. A run never crosses from one group of this many rows of tiles to the next.
pub const LONGEST: u32 = 4;

/// One invocation for four tiles, one below the other.
pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.tiles_x * f.tiles_y.div_ceil(LONGEST) * f.shots, 1, 1])
}

/// Lower bound on the sums of a block's windows.
fn least_sum(f: &Frame, blocks: &Blocks, x: i32, y: i32) -> u32 {
    match f.flags & GAUSSIAN {
        0 => blocks.least_sum(x, y),
        _ => f.size * f.size * blocks.darkest(x, y),
    }
}

/// Whether some pixel of the block may pass against that bound.
fn may_be_lit(f: &Frame, blocks: &Blocks, x: i32, y: i32) -> bool {
    let deep = depth_shift(f);
    let largest = blocks.block(x, y).largest << deep;
    let area = (f.size * f.size) as i32;
    let half = if f.flags & GAUSSIAN != 0 { 0 } else { (area - 1) / 2 };
    let sum = (least_sum(f, blocks, x, y) << deep) as i32;
    area * (largest as i32 - f.offset) > sum + half && largest >= f.minimum
}

pub(crate) fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, stats, roi, listing, single_listing, singles, run_listing, runs] = b else { unreachable!() };
    let longest = if f.flags & GAUSSIAN != 0 { 1 } else { LONGEST };
    for shot in 0..f.shots {
        let blocks = Blocks::new(&f, stats, shot);
        let is_listed = |x: u32, y: u32| {
            let words = &roi[..];
            let wanted = || (0..8).any(|r| words[crate::stages::listing::mask_index(&f, tile_pack(x, y, 0), r)] != 0);
            let lit = || (0..2).any(|side| may_be_lit(&f, &blocks, 2 * x as i32 + side, y as i32));
            (f.flags & HAS_ROI == 0 || wanted()) && (f.flags & ALL_TILES != 0 || lit())
        };
        for x in 0..f.tiles_x {
            let listed: Vec<bool> = (0..f.tiles_y).map(|y| is_listed(x, y)).collect();
            let mut y = 0;
            while y < f.tiles_y {
                let room = longest.min(LONGEST - y % LONGEST).min(f.tiles_y - y);
                let length = (y..y + room).take_while(|&y| listed[y as usize]).count() as u32;
                let tile = tile_pack(x, y, shot);
                let least = || (0..2).map(|side| least_sum(&f, &blocks, 2 * x as i32 + side, y as i32)).min();
                match length {
                    0 => {}
                    // The plain path uses no bound.
                    1 if f.flags & ALL_TILES == 0 || f.flags & GAUSSIAN != 0 => {
                        append(single_listing, singles, [tile, least().expect("two blocks")]);
                    }
                    _ => append(run_listing, runs, [tile, length]),
                }
                listing[listing::COUNT] += length;
                y += length.max(1);
            }
        }
    }
}
