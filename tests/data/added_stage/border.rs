//! In: the thinned mask of the lit tiles. Out: the same without the pixels on the picture's border, whose profile is
//! cut off.
//! Frame and unit: pixels.

use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::Mask;
use crate::stages::frame::{self, PX_LOG2, SHARED, frame_of, tile_unpack};
use crate::stages::listing::{self, mask_index};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

pub const STAGE: Stage = Stage {
    name: "border",
    wgsl: include_str!("../../../shaders/border.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "mask", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

pub const STEP: Step = Step {
    stage: &STAGE,
    twin,
    binds: &["frame", "lit header", "lit list", "mask"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// What the stage does, said of the whole picture.
pub fn plain(thinned: &Mask) -> Mask {
    let (right, bottom) = (thinned.width - 1, thinned.height - 1);
    Mask::from_fn(thinned.width, thinned.height, |x, y| {
        thinned.get(x, y) && x > 0 && x < right && y > 0 && y < bottom
    })
}

fn twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, mask] = b else { unreachable!() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        let (tx, ty, _) = tile_unpack(tile);
        let mut columns = u32::MAX;
        if tx == 0 {
            columns &= !1;
        }
        if tx == (f.width - 1) / 32 {
            columns &= !(1 << ((f.width - 1) % 32));
        }
        for row in 0..8 {
            let y = 8 * ty + row;
            let kept = if y == 0 || y == f.height - 1 { 0 } else { columns };
            mask[mask_index(&f, tile, row)] &= kept;
        }
    }
}
