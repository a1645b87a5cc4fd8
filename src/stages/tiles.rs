//! In: block statistics. Out: the tiles that may hold a lit pixel, as runs one below the other: (first tile, number of
//! tiles); the others are proven dark. Frame and unit: tiles of 32 x 8 pixels, blocks of 16 x 8.

use super::bound::Blocks;
use super::frame::{self, ALL_TILES, Frame, GAUSSIAN, HAS_ROI, PX_LOG2, SHARED, frame_of, tile_pack};
use super::stats::depth_shift;
use super::threshold::RADIUS;
use crate::gpu::{Access::*, Binding, Stage};

pub const STAGE: Stage = Stage {
    name: "tiles",
    wgsl: include_str!("../../shaders/tiles.wgsl"),
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

/// 1 for a window with weights ([`GAUSSIAN`]): a constant of the pipeline.
pub const WEIGHTED: &str = "weighted";
/// Longest run, and the rows of tiles after which runs begin anew.
pub const LONGEST: u32 = 4;

/// One invocation four tiles, one below the other.
pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.tiles_x * f.tiles_y.div_ceil(LONGEST) * f.shots, 1, 1])
}

/// Some pixel of the block may pass against the least that its window can come to.
fn may_be_lit(f: &Frame, blocks: &Blocks, x: i32, y: i32) -> bool {
    let deep = depth_shift(f);
    let largest = blocks.block(x, y).largest << deep;
    if largest < f.minimum {
        return false;
    }
    let largest = largest as i32 - f.offset;
    if f.flags & GAUSSIAN != 0 {
        return largest > (blocks.darkest(x, y) << deep) as i32;
    }
    let area = (f.size * f.size) as i32;
    area * largest > (blocks.least_sum(x, y) << deep) as i32 + (area - 1) / 2
}

pub fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, stats, roi, listing, single_listing, singles, run_listing, runs] = b else { unreachable!() };
    let longest = if f.flags & GAUSSIAN != 0 { 1 } else { LONGEST };
    for shot in 0..f.shots {
        let blocks = Blocks::new(&f, stats, shot);
        let is_listed = |x: u32, y: u32| {
            let words = &roi[..];
            let wanted = || (0..8).any(|r| words[super::listing::mask_index(&f, tile_pack(x, y, 0), r)] != 0);
            let lit = || (0..2).any(|side| may_be_lit(&f, &blocks, 2 * x as i32 + side, y as i32));
            (f.flags & HAS_ROI == 0 || wanted()) && (f.flags & ALL_TILES != 0 || lit())
        };
        for x in 0..f.tiles_x {
            let listed: Vec<bool> = (0..f.tiles_y).map(|y| is_listed(x, y)).collect();
            let mut y = 0;
            while y < f.tiles_y {
                let room = longest.min(LONGEST - y % LONGEST).min(f.tiles_y - y);
                let length = (y..y + room).take_while(|&y| listed[y as usize]).count() as u32;
                let run = [tile_pack(x, y, shot), length];
                match length {
                    0 => {}
                    1 => super::listing::append(single_listing, singles, run),
                    _ => super::listing::append(run_listing, runs, run),
                }
                listing[3] += length;
                y += length.max(1);
            }
        }
    }
}

/// Words in which two results differ; the order of the runs is up to the GPU's scheduler.
pub fn apart(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    let sorted = |b: &[Vec<u32>]| {
        let mut b = b.to_vec();
        for (listing, list) in [(4, 5), (6, 7)] {
            let count = b[listing][3] as usize;
            let mut pairs: Vec<[u32; 2]> = bytemuck::cast_slice(&b[list][..2 * count]).to_vec();
            pairs.sort_unstable();
            b[list][..2 * count].copy_from_slice(bytemuck::cast_slice(&pairs));
        }
        b
    };
    super::entry::differing_words(&sorted(gpu), &sorted(twin))
}
