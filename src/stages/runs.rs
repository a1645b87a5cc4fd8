//! In: the list of tiles that may be lit. Out: the same tiles as runs one below the other: (first tile, number of tiles).
//! Frame and unit: tiles of 32 x 8 pixels.

use super::frame::{frame_of, tile_unpack};
use super::listing::{RESET, append, tile_index};
use crate::gpu::{Access::*, Binding, Stage};

pub const STAGE: Stage = Stage {
    name: "runs",
    wgsl: include_str!("../../shaders/runs.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "listed", access: Texels },
        Binding { name: "single_listing", access: ReadWrite },
        Binding { name: "singles", access: ReadWrite },
        Binding { name: "run_listing", access: ReadWrite },
        Binding { name: "runs", access: ReadWrite },
    ],
    ..RESET
};

/// Longest run, and the rows of tiles after which runs begin anew.
pub const LONGEST: u32 = 4;

pub fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, listed, single_listing, singles, run_listing, runs] = b else { unreachable!() };
    for &tile in &list[..listing[3] as usize] {
        let (_, y, _) = tile_unpack(tile);
        let at = tile_index(&f, tile);
        let is_listed = |down: u32| listed[at + (down * f.tiles_x) as usize] != 0;
        if y % LONGEST > 0 && listed[at - f.tiles_x as usize] != 0 {
            continue;
        }
        let room = (LONGEST - y % LONGEST).min(f.tiles_y - y);
        let length = (0..room).take_while(|&down| is_listed(down)).count() as u32;
        match length {
            1 => append(single_listing, singles, [tile, length]),
            _ => append(run_listing, runs, [tile, length]),
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
