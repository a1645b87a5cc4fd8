//! In: block statistics. Out: the list of tiles that may hold a lit pixel; the others are proven dark.
//! Frame and unit: tiles of 32 x 8 pixels, blocks of 16 x 8.

use super::frame::{self, ALL_TILES, Frame, GAUSSIAN, HAS_ROI, PX_LOG2, SHARED, frame_of, tile_pack};
use crate::gpu::{Access::*, Binding, Stage};

pub const STAGE: Stage = Stage {
    name: "tiles",
    wgsl: include_str!("../../shaders/tiles.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "stats", access: Read },
        Binding { name: "roi", access: Read },
        Binding { name: "listing", access: ReadWrite },
        Binding { name: "list", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.tiles(), 1, 1])
}

/// (sum, largest, smallest, smallest row, smallest column) of a block; outside the picture the border repeats.
fn block(f: &Frame, stats: &[u32], x: i32, y: i32, shot: u32) -> [u32; 5] {
    let (cx, cy) = (x.clamp(0, 2 * f.tiles_x as i32 - 1), y.clamp(0, f.tiles_y as i32 - 1));
    let at = 4 * ((shot as i32 * f.tiles_y as i32 + cy) * 2 * f.tiles_x as i32 + cx) as usize;
    let (sum, most, least, row, column) =
        (stats[at], stats[at + 1] & 0xffff, stats[at + 1] >> 16, stats[at + 2], stats[at + 3]);
    match (x != cx, y != cy) {
        (false, false) => [sum, most, least, row, column],
        (true, false) => [16 * column, most, least, 16 * least, column],
        (false, true) => [8 * row, most, least, row, 8 * least],
        (true, true) => [128 * least, most, least, 16 * least, 8 * least],
    }
}

/// Lower bound on the sum of every window of edge `f.size` whose centre lies in the block: windows hold
/// the blocks up to `full` away whole, the rest of their rows and columns comes from those up to `reach`.
pub fn bound(f: &Frame, stats: &[u32], x: i32, y: i32, shot: u32) -> u32 {
    let (r, n) = ((f.size / 2) as i32, f.size as i32);
    let full = |edge: i32| if r >= edge - 1 { (r - edge + 1) / edge } else { -1 };
    let rest = |edge: i32, full: i32| if full >= 0 { n - edge * (2 * full + 1) } else { n } as u32;
    let (full_x, full_y) = (full(16), full(8));
    let (reach_x, reach_y) = ((r + 15) / 16, (r + 7) / 8);
    let partial = |full: i32, reach: i32| (-reach..=reach).filter(move |d| d.abs() > full);
    // Sum over a block's width, and over one column of pixels, of the window's rows in the blocks at dx.
    let column = |dx: i32, of: usize, edge: usize| {
        let whole: u32 = (-full_y..=full_y).map(|dy| block(f, stats, x + dx, y + dy, shot)[of]).sum();
        let rest_row = partial(full_y, reach_y).map(|dy| block(f, stats, x + dx, y + dy, shot)[edge]).min().unwrap();
        whole + rest(8, full_y) * rest_row
    };
    let whole: u32 = (-full_x..=full_x).map(|dx| column(dx, 0, 3)).sum();
    whole + rest(16, full_x) * partial(full_x, reach_x).map(|dx| column(dx, 4, 2)).min().unwrap()
}

/// Block x of a tile (its left one is even).
fn may_be_lit(f: &Frame, stats: &[u32], x: i32, y: i32, shot: u32) -> bool {
    let [_, largest, ..] = block(f, stats, x, y, shot);
    let reach = |edge: i32| ((f.size / 2) as i32 + edge - 1) / edge;
    if largest < f.minimum {
        return false;
    }
    if f.flags & GAUSSIAN != 0 {
        let near = (-reach(8)..=reach(8)).flat_map(|dy| (-reach(16)..=reach(16) + 1).map(move |dx| (dx, dy)));
        let darkest = near.map(|(dx, dy)| block(f, stats, x / 2 * 2 + dx, y + dy, shot)[2]).min().unwrap();
        return largest as i32 - f.offset > darkest as i32;
    }
    let area = (f.size * f.size) as i32;
    area * (largest as i32 - f.offset) > bound(f, stats, x, y, shot) as i32 + (area - 1) / 2
}

pub fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, stats, roi, listing, list] = b else { unreachable!() };
    for shot in 0..f.shots {
        for y in 0..f.tiles_y {
            for x in 0..f.tiles_x {
                let wanted = f.flags & HAS_ROI == 0 || (0..8).any(|r| roi[((8 * y + r) * f.tiles_x + x) as usize] != 0);
                let lit = f.flags & ALL_TILES != 0
                    || may_be_lit(&f, stats, 2 * x as i32, y as i32, shot)
                    || may_be_lit(&f, stats, 2 * x as i32 + 1, y as i32, shot);
                if wanted && lit {
                    super::listing::append(listing, list, tile_pack(x, y, shot));
                }
            }
        }
    }
}
