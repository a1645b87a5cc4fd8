//! In: lists of tiles. Out: lists that are emptied, shortened or restarted, by the stages reset, clear, compact and
//! rebase. Frame and unit: tiles of 32 x 8 pixels.

use super::frame::{self, ACTIVITY, Frame, PX_LOG2, frame_of, tile_unpack};
use crate::gpu::{Access::*, Binding, Stage};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// WGSL of the constants below.
pub(crate) const SHARED: &str = include_str!("../../shaders/shared/listing.wgsl");
/// Word of a list's header: workgroups of 64 entries, the first of a dispatch's three arguments.
pub const GROUPS: usize = 0;
/// Word of a list's header: number of entries.
pub const COUNT: usize = 3;
/// Words between the headers of two lists: 256 bytes, an offset at which every adapter can bind.
pub const HEADER_WORDS: u32 = 64;

/// Empties list headers; in a further round of thinning (step 1) only those of the shortened lists.
pub const RESET: Stage = Stage {
    name: "reset",
    wgsl: include_str!("../../shaders/reset.wgsl"),
    shared: &[frame::SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "first", access: ReadWrite },
        Binding { name: "lit_first", access: ReadWrite },
        Binding { name: "runs", access: ReadWrite },
        Binding { name: "others", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// Empties the headers of all lists.
pub const RESETTING: Step = Step {
    stage: &RESET,
    twin: reset_twin,
    binds: &["frame", "single headers", "lit headers", "run headers", "active headers"],
    groups: Groups::Of(|_| [1, 1, 1]),
    same: Same::Words,
};

/// Zeroes masks, stamps and counts of the tiles that the last batch listed; one invocation per tile.
pub const CLEAR: Stage = Stage {
    name: "clear",
    wgsl: include_str!("../../shaders/clear.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "mask", access: ReadWrite },
        Binding { name: "other_mask", access: ReadWrite },
        Binding { name: "lit", access: ReadWrite },
        Binding { name: "stamps", access: ReadWrite },
        Binding { name: "counts", access: ReadWrite },
    ],
    ..RESET
};

/// Zeroes the tiles that the last batch listed.
pub const CLEARING: Step = Step {
    stage: &CLEAR,
    twin: clear_twin,
    binds: &["frame", "lit header", "lit list", "mask", "other mask", "lit", "stamps", "counts"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Lists the lit tiles that changed in the last two sub-iterations, or lie beside such a tile; one invocation per tile.
pub const COMPACT: Stage = Stage {
    name: "compact",
    wgsl: include_str!("../../shaders/compact.wgsl"),
    shared: &[frame::SHARED, ACTIVITY],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "all", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "stamps", access: Texels },
        Binding { name: "listing", access: ReadWrite },
        Binding { name: "active_list", access: ReadWrite },
    ],
    ..RESET
};

/// Shortens the list to the tiles that may still change.
pub const COMPACTING: Step = Step {
    stage: &COMPACT,
    twin: compact_twin,
    binds: &["frame", "lit header", "lit list", "stamps", "header after 1", "active list"],
    groups: Groups::Listed("lit header"),
    same: Same::Lists(&[(5, 1)]),
};

/// Zeroes the stamps of the lit tiles; one invocation per tile.
pub const REBASE: Stage = Stage {
    name: "rebase",
    wgsl: include_str!("../../shaders/rebase.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "stamps", access: ReadWrite },
    ],
    ..RESET
};

/// Resets the stamps after a round, before a further one.
pub const REBASING: Step = Step {
    stage: &REBASE,
    twin: rebase_twin,
    binds: &["frame", "lit header", "lit list", "stamps"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Appends an entry, which is a tile or a run of tiles. [`COUNT`] of the header is the number of entries, [`GROUPS`]
/// the number of workgroups of 64 entries.
pub fn append<const N: usize>(listing: &mut [u32], list: &mut [u32], entry: [u32; N]) {
    list[N * listing[COUNT] as usize..][..N].copy_from_slice(&entry);
    listing[GROUPS] += u32::from(listing[COUNT].is_multiple_of(64));
    listing[COUNT] += 1;
}

/// Index of a tile in arrays that contain every tile.
pub fn tile_index(f: &Frame, tile: u32) -> usize {
    let (x, y, shot) = tile_unpack(tile);
    ((shot * f.tiles_y + y) * f.tiles_x + x) as usize
}
/// Index of a tile's row in a mask.
pub fn mask_index(f: &Frame, tile: u32, row: u32) -> usize {
    8 * tile_index(f, tile) + row as usize
}
/// Indices of a tile and its neighbours.
pub fn near_tiles(f: &Frame, tile: u32) -> impl Iterator<Item = usize> {
    let (x, y, shot) = tile_unpack(tile);
    let near = |v: u32, n: u32| v.saturating_sub(1)..=(v + 1).min(n - 1);
    let (tiles_x, tiles_y) = (f.tiles_x, f.tiles_y);
    near(y, tiles_y).flat_map(move |ny| near(x, tiles_x).map(move |nx| ((shot * tiles_y + ny) * tiles_x + nx) as usize))
}
/// The latest stamp of a tile and its neighbours.
pub fn latest(f: &Frame, stamps: &[u32], tile: u32) -> u32 {
    near_tiles(f, tile).map(|at| stamps[at]).max().expect("the tile itself")
}

pub(crate) fn reset_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    const EMPTY: [u32; 4] = [0, 1, 1, 0];
    if frame_of(b).step == 0 {
        b[1].chunks_mut(HEADER_WORDS as usize).for_each(|h| h[..4].copy_from_slice(&EMPTY));
        b[2][..4].copy_from_slice(&EMPTY);
        b[3][..4].copy_from_slice(&EMPTY);
    }
    b[4].chunks_mut(HEADER_WORDS as usize).for_each(|h| h[..4].copy_from_slice(&EMPTY));
}

pub(crate) fn clear_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, mask, other, lit, stamps, counts] = b else { unreachable!() };
    for &tile in &list[..listing[COUNT] as usize] {
        for row in 0..8 {
            mask[mask_index(&f, tile, row)] = 0;
            other[mask_index(&f, tile, row)] = 0;
            lit[mask_index(&f, tile, row)] = 0;
        }
        stamps[tile_index(&f, tile)] = 0;
        counts[tile_index(&f, tile)] = 0;
    }
}

pub(crate) fn compact_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, all, list, stamps, listing, active] = b else { unreachable!() };
    for &tile in list[..all[COUNT] as usize].iter().filter(|&&t| latest(&f, stamps, t) > f.step) {
        append(listing, active, [tile]);
    }
}

pub(crate) fn rebase_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, stamps] = b else { unreachable!() };
    for &tile in &list[..listing[COUNT] as usize] {
        stamps[tile_index(&f, tile)] = 0;
    }
}
