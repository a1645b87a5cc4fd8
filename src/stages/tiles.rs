//! In: bands of block statistics. Out: the list of tiles that may hold a lit pixel, and for every tile whether it is in
//! it; the others are proven dark.
//! Frame and unit: tiles of 32 x 8 pixels, blocks of 16 x 8.

use super::bands::{Band, Cover};
use super::frame::{self, ALL_TILES, Frame, GAUSSIAN, HAS_ROI, PX_LOG2, SHARED, frame_of, tile_pack};
use super::stats::{Block, depth_shift};
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
        Binding { name: "bands", access: Texels },
        Binding { name: "roi", access: Texels },
        Binding { name: "listed", access: ReadWrite },
        Binding { name: "listing", access: ReadWrite },
        Binding { name: "list", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2, RADIUS],
};

pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.tiles(), 1, 1])
}

/// Lower bound on the sum of every window of edge `f.size` whose centre lies in block x of a row of blocks, in 256ths of
/// full scale: windows hold the blocks up to `full` away whole, the rest of their columns comes from those up to `reach`.
/// `row` holds the two words of every block's [`Band`].
pub fn bound(f: &Frame, row: &[u32], x: i32) -> u32 {
    let (cover, down) = (Cover::new(f.size, 16), Cover::new(f.size, 8));
    // What is covered in part in both directions holds, on both sides together, this many whole quads.
    let quads = (cover.rest - 1) / 2 * ((down.rest - 1) / 2);
    let singles = cover.rest * down.rest - 4 * quads;
    // Beyond the picture its border repeats: sixteen times the least column, four times the smallest pixel.
    let band = |dx: i32| {
        let near = (x + dx).clamp(0, 2 * f.tiles_x as i32 - 1);
        let b = Band::unpack(&row[2 * near as usize..][..2]);
        if near == x + dx {
            return b;
        }
        Band { sum: 16 * (b.column + down.rest * b.smallest), half_quad: 2 * b.smallest, ..b }
    };
    let part = |of: fn(Band) -> u32| cover.partial().map(|dx| of(band(dx))).min().expect("no window ends with a block");
    cover.whole().map(|dx| band(dx).sum).sum::<u32>()
        + cover.rest * part(|b| b.column)
        + 2 * quads * part(|b| b.half_quad)
        + singles * part(|b| b.smallest)
}

/// Block x of a row of blocks that begins at `row` (counted in blocks).
fn may_be_lit(f: &Frame, stats: &[u32], bands: &[u32], row: usize, x: i32) -> bool {
    let deep = depth_shift(f);
    let blocks_x = 2 * f.tiles_x as usize;
    let of_row = &bands[2 * row..2 * (row + blocks_x)];
    let largest = Band::unpack(&of_row[2 * x as usize..][..2]).largest << deep;
    if largest < f.minimum {
        return false;
    }
    if f.flags & GAUSSIAN != 0 {
        let reach = |edge: i32| ((f.size / 2) as i32 + edge - 1) / edge;
        let (rows, y) = (f.tiles_y as usize, row / blocks_x);
        let (first, y) = (y / rows * rows, (y % rows) as i32);
        let near = (-reach(8)..=reach(8)).flat_map(|dy| (-reach(16)..=reach(16) + 1).map(move |dx| (dx, dy)));
        let smallest = |(dx, dy): (i32, i32)| {
            let x = (x / 2 * 2 + dx).clamp(0, blocks_x as i32 - 1) as usize;
            let y = (y + dy).clamp(0, rows as i32 - 1) as usize;
            Block::unpack(&stats[2 * ((first + y) * blocks_x + x)..][..2]).smallest
        };
        let darkest = near.map(smallest).min().expect("the block itself") << deep;
        return largest as i32 - f.offset > darkest as i32;
    }
    let area = (f.size * f.size) as i32;
    area * (largest as i32 - f.offset) > (bound(f, of_row, x) << deep) as i32 + (area - 1) / 2
}

pub fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, stats, bands, roi, listed, listing, list] = b else { unreachable!() };
    for shot in 0..f.shots {
        for y in 0..f.tiles_y {
            for x in 0..f.tiles_x {
                let tile = tile_pack(x, y, shot);
                let wanted = f.flags & HAS_ROI == 0
                    || (0..8).any(|r| roi[super::listing::mask_index(&f, tile_pack(x, y, 0), r)] != 0);
                let row = ((shot * f.tiles_y + y) * 2 * f.tiles_x) as usize;
                let lit = f.flags & ALL_TILES != 0
                    || may_be_lit(&f, stats, bands, row, 2 * x as i32)
                    || may_be_lit(&f, stats, bands, row, 2 * x as i32 + 1);
                listed[super::listing::tile_index(&f, tile)] = u32::from(wanted && lit);
                if wanted && lit {
                    super::listing::append(listing, list, [tile]);
                }
            }
        }
    }
}
