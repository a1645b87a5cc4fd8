//! In: a thinned mask. Out: its lit pixels as a list, always in the same order.
//! Frame and unit: pixels, packed x | y << 16.

use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::Mask;
use crate::stages::frame;
use crate::stages::frame::{Frame, PX_LOG2, SHARED, frame_of, tile_unpack};
use crate::stages::listing::{self, HEADER_WORDS, mask_index, tile_index};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// Width and height of the tiles that the stages work on, in pixels: one word wide.
pub const TILE: (u32, u32) = (32, 8);

/// A pixel in one word: x | y << 16.
pub fn pack(x: u32, y: u32) -> u32 {
    x | y << 16
}
/// CPU twin: lit pixels tile by tile (rows of tiles from the top, tiles from the left), within a tile row by row. The
/// order is not plain row order because one tile is one unit of GPU work.
pub fn twin(mask: &Mask) -> Vec<u32> {
    let words = mask.words_per_row();
    let mut list = Vec::new();
    for top in (0..mask.height).step_by(TILE.1 as usize) {
        let bottom = (top + TILE.1).min(mask.height);
        for i in 0..words {
            for y in top..bottom {
                let mut word = mask.words[y as usize * words + i];
                while word != 0 {
                    list.push(pack(32 * i as u32 + word.trailing_zeros(), y));
                    word &= word - 1;
                }
            }
        }
    }
    list
}

/// Number of lit pixels in each listed tile.
pub const COUNT: Stage = Stage {
    name: "count",
    wgsl: include_str!("../../../shaders/count.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "mask", access: Texels },
        Binding { name: "counts", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// Counts the pixels of each tile.
pub const COUNTING: Step = Step {
    stage: &COUNT,
    twin: count_twin,
    binds: &["frame", "lit header", "lit list", "long", "counts"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Number of pixels before each tile in its row of tiles, and each row's total.
pub const SCAN_ROWS: Stage = Stage {
    name: "scan_rows",
    wgsl: include_str!("../../../shaders/scan_rows.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "counts", access: Texels },
        Binding { name: "starts", access: ReadWrite },
        Binding { name: "rows", access: ReadWrite },
    ],
    ..COUNT
};

/// Computes the first entry of each tile in its row.
pub const SCANNING_ROWS: Step = Step {
    stage: &SCAN_ROWS,
    twin: scan_rows_twin,
    binds: &["frame", "counts", "starts", "rows"],
    groups: Groups::Of(rows_groups),
    same: Same::Words,
};

/// Number of pixels before each row of tiles in its shot, and each shot's total.
pub const SCAN_SHOTS: Stage = Stage {
    name: "scan_shots",
    wgsl: include_str!("../../../shaders/scan_shots.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "rows", access: Texels },
        Binding { name: "row_starts", access: ReadWrite },
        Binding { name: "totals", access: ReadWrite },
    ],
    ..COUNT
};

/// Computes the first entry of each row in its shot.
pub const SCANNING_SHOTS: Step = Step {
    stage: &SCAN_SHOTS,
    twin: scan_shots_twin,
    binds: &["frame", "rows", "row starts", "totals"],
    groups: Groups::Of(shots_groups),
    same: Same::Words,
};

/// The header of the pixel list.
pub const HEAD: Stage = Stage {
    name: "header",
    wgsl: include_str!("../../../shaders/header.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "totals", access: Texels },
        Binding { name: "listing", access: Read },
        Binding { name: "shortened", access: Read },
        Binding { name: "header", access: ReadWrite },
    ],
    ..COUNT
};

/// Writes the batch's totals.
pub const HEADING: Step = Step {
    stage: &HEAD,
    twin: head_twin,
    binds: &["frame", "totals", "all header", "active headers", "header"],
    groups: Groups::Of(shots_groups),
    same: Same::Words,
};

/// The pixel list: (x | y << 16, shot).
pub const STAGE: Stage = Stage {
    name: "skeleton",
    wgsl: include_str!("../../../shaders/skeleton.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "mask", access: Texels },
        Binding { name: "starts", access: Texels },
        Binding { name: "row_starts", access: Texels },
        Binding { name: "header", access: Read },
        Binding { name: "pixels", access: ReadWrite },
    ],
    ..COUNT
};

/// Writes the list of pixels.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin: stage_twin,
    binds: &["frame", "lit header", "lit list", "long", "starts", "row starts", "header", "pixels"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Word of the pixel list's header: pixels found, of which [`crate::stages::listing::COUNT`] are listed.
pub const FOUND: usize = 4;
/// Word of the pixel list's header: tiles that could not be proven dark.
pub const LISTED: usize = 5;
/// Word of the pixel list's header: shortened lists of thinning that still contained a tile.
pub const LEFT: usize = 6;
/// Word of the pixel list's header: number of pictures in the batch.
pub const SHOTS: usize = 7;
/// Words of the pixel list's header before the shots' first pixels.
pub const HEADER: usize = 8;

pub(crate) fn rows_groups(f: &Frame) -> [u32; 3] {
    SCAN_ROWS.groups([f.tiles_y * f.shots, 1, 1])
}
pub(crate) fn shots_groups(f: &Frame) -> [u32; 3] {
    SCAN_SHOTS.groups([f.shots, 1, 1])
}

pub(crate) fn count_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, mask, counts] = b else { unreachable!() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        counts[tile_index(&f, tile)] = (0..8).map(|r| mask[mask_index(&f, tile, r)].count_ones()).sum();
    }
}

pub(crate) fn scan_rows_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, counts, starts, rows] = b else { unreachable!() };
    for (y, row) in counts.chunks_exact(f.tiles_x as usize).enumerate() {
        let mut sum = 0;
        for (x, count) in row.iter().enumerate() {
            starts[y * f.tiles_x as usize + x] = sum;
            sum += count;
        }
        rows[y] = sum;
    }
}

pub(crate) fn scan_shots_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, rows, row_starts, totals] = b else { unreachable!() };
    for (shot, rows) in rows.chunks_exact(f.tiles_y as usize).enumerate() {
        let mut sum = 0;
        for (y, row) in rows.iter().enumerate() {
            row_starts[shot * f.tiles_y as usize + y] = sum;
            sum += row;
        }
        totals[shot] = sum;
    }
}

pub(crate) fn head_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, totals, listing, shortened, header] = b else { unreachable!() };
    let mut sum = 0;
    for (shot, total) in totals.iter().enumerate() {
        header[HEADER + shot] = sum.min(f.capacity);
        sum += total;
    }
    let kept = sum.min(f.capacity);
    let left = shortened.chunks(HEADER_WORDS as usize).filter(|list| list[listing::COUNT] > 0).count() as u32;
    header[..HEADER].copy_from_slice(&[kept.div_ceil(64), 1, 1, kept, sum, listing[listing::COUNT], left, f.shots]);
    header[HEADER + f.shots as usize] = kept;
}

pub(crate) fn stage_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, mask, starts, row_starts, header, points] = b else { unreachable!() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        let (tx, ty, shot) = tile_unpack(tile);
        let row_start = header[HEADER + shot as usize] + row_starts[(shot * f.tiles_y + ty) as usize];
        let mut at = (row_start + starts[tile_index(&f, tile)]) as usize;
        for row in 0..8 {
            let mut bits = mask[mask_index(&f, tile, row)];
            while bits != 0 {
                if at < f.capacity as usize {
                    points[2 * at] = pack(32 * tx + bits.trailing_zeros(), 8 * ty + row);
                    points[2 * at + 1] = shot;
                }
                bits &= bits - 1;
                at += 1;
            }
        }
    }
}
