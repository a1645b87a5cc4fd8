//! In: pictures; tiles that stand alone in the list, with the least sum of their windows. Out: tiles with one pixel
//! that may pass against that sum are finished; tiles with more become runs of one tile. Frame and unit: pixels, tiles
//! of 32 x 8; sums in 256ths of full scale.

use super::stats::{depth_shift, padded_pixel};
use super::threshold;
use super::threshold::passes_mean;
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::frame::{Frame, HAS_ROI, frame_of, tile_unpack};
use crate::stages::listing::{self, append, mask_index};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

pub const STAGE: Stage = Stage {
    name: "specks",
    wgsl: include_str!("../../../shaders/specks.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "image", access: Texels },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "roi", access: Texels },
        Binding { name: "mask", access: ReadWrite },
        Binding { name: "lit", access: ReadWrite },
        Binding { name: "lit_listing", access: ReadWrite },
        Binding { name: "lit_list", access: ReadWrite },
        Binding { name: "run_listing", access: ReadWrite },
        Binding { name: "runs", access: ReadWrite },
    ],
    ..threshold::MEAN
};

/// Finds the lit pixels of the tiles that stand alone.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin,
    binds: &[
        "frame",
        "image",
        "single header",
        "singles",
        "roi",
        "mask",
        "lit",
        "lit header",
        "lit list",
        "run header",
        "runs",
    ],
    groups: Groups::Listed("single header"),
    same: Same::Lists(&[(8, 1), (10, 2)]),
};

/// Least brightness that passes against a window of that sum.
fn passing(f: &Frame, least_sum: u32) -> i32 {
    let area = f.size * f.size;
    (((least_sum << depth_shift(f)) + (area - 1) / 2) / area) as i32 + f.offset + 1
}

pub fn twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, image, listing, list, roi, mask, lit, lit_listing, lit_list, run_listing, runs] = b else { unreachable!() };
    for single in list.chunks_exact(2).take(listing[listing::COUNT] as usize) {
        let (tile, least) = (single[0], passing(&f, single[1]).max(f.minimum as i32));
        let (tx, ty, shot) = tile_unpack(tile);
        let pixel = |x: i32, y: i32| {
            let x = x.clamp(0, 32 * f.tiles_x as i32 - 1) as u32;
            padded_pixel(&f, image, overrides[0].1 as u32, shot, x, y.max(0) as u32)
        };
        let places = (0..8).flat_map(|row| (0..32).map(move |column| (32 * tx + column, 8 * ty + row)));
        let bright: Vec<(u32, u32)> = places.filter(|&(x, y)| pixel(x as i32, y as i32) as i32 >= least).collect();
        let &[(x, y)] = &bright[..] else {
            if !bright.is_empty() {
                append(run_listing, runs, [tile, 1]);
            }
            continue;
        };
        let r = (f.size / 2) as i32;
        let row = |dy: i32| (-r..=r).map(|dx| pixel(x as i32 + dx, y as i32 + dy)).sum::<u32>();
        let passes = passes_mean(pixel(x as i32, y as i32), (-r..=r).map(row).sum(), &f.threshold());
        let wanted = f.flags & HAS_ROI == 0 || roi[f.mask_word(0, x, y)] >> (x % 32) & 1 == 1;
        if passes && wanted {
            let at = mask_index(&f, tile, y % 8);
            mask[at] = 1 << (x % 32);
            lit[at] = mask[at];
            append(lit_listing, lit_list, [tile]);
        }
    }
}
