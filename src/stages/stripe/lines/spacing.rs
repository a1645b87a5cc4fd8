//! In: the skeleton, lit pixels. Out: of each run of skeleton pixels across the stripe, the middle pixel and every
//! pixel at a multiple of the spacing from it. The pixels of a run are at most the spacing apart. Isolated lit pixels
//! are excluded. Frame and unit: pixels; the spacing follows from the stripe's width.

use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::Mask;
use crate::stages::frame;
use crate::stages::frame::{PX_LOG2, SHARED, frame_of, tile_unpack};
use crate::stages::listing::{self, mask_index};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};
use glam::Vec2;

/// If a run continues for longer than this, px, its middle cannot be found from here: its pixels are counted from the
/// picture's border.
pub(in crate::stages) const FAR: i32 = 32;

/// Bit of the setting: isolated lit pixels are excluded, because they do not belong to a stripe.
///
/// One dark pixel in 740 exceeds three standard deviations of its noise. At 12 million pixels these are 17,000 fits,
/// four times those of a stripe. 94 % of them have no other lit pixel within three columns and rows. A stripe lights
/// neighbouring pixels along it. Even if the brightest pixels of its columns are lit in only half of the cases, six
/// neighbours along it leave only one in 64 isolated. The flanks add neighbours.
pub const COMPANY: u32 = 1 << 17;
/// Columns and rows on either side in which another lit pixel is searched.
pub(in crate::stages) const NEAR: i32 = 3;

/// Up to this width, px, a skeleton hardly winds: 1.00 to 1.02 points per column.
const NARROW_PX: f32 = 2.0;

/// The setting in the stage's format: spacing in pixels, and from bit 16 on whether runs lie along rows; 0 is off.
/// [`COMPANY`] is set separately.
///
/// Speckle makes the skeleton of a wide stripe wind and branch. Its pixels across the stripe use the same light, so
/// their fits find the same centre again: at a sigma of 4 px there are 1.9 points per column. With a spacing of 1.5
/// widths, 1.1 remain. A stripe narrower than 2 px keeps every pixel. `across` is the unit image direction of depth.
pub fn word(widths: f32, width_px: f32, across: Vec2) -> u32 {
    let step = (widths * width_px).floor();
    let rows = across[1].abs() < across[0].abs();
    if width_px < NARROW_PX || step < 2.0 { 0 } else { step.min(65535.0) as u32 | u32::from(rows) << 16 }
}

/// Whether a pixel of the skeleton is kept. `skeleton` says whether a pixel is set; beyond the picture none is.
pub(in crate::stages) fn kept(x: i32, y: i32, setting: u32, skeleton: impl Fn(i32, i32) -> bool) -> bool {
    let (step, rows) = ((setting & 0xffff) as i32, (setting >> 16 & 1) as i32);
    if step == 0 {
        return true;
    }
    // Pixels of the run on one side; the run ends if no pixel follows within `step`.
    let beyond = |du: i32, dv: i32| {
        let (mut found, mut last) = (0, 0);
        for k in 1..=FAR {
            if k > last + step {
                return found;
            }
            if skeleton(x + k * du, y + k * dv) {
                (found, last) = (found + 1, k);
            }
        }
        FAR
    };
    let (before, after) = (beyond(-rows, rows - 1), beyond(rows, 1 - rows));
    let place = match before.max(after) {
        FAR => [y, x][rows as usize],
        _ => before - (before + after + 1) / 2,
    };
    place % step == 0
}

/// Whether another pixel near this one is lit; true without [`COMPANY`]. `lit` says whether a pixel is lit; beyond the
/// picture none is.
fn in_company(x: i32, y: i32, setting: u32, lit: impl Fn(i32, i32) -> bool) -> bool {
    let mut around = (-NEAR..=NEAR).flat_map(|dy| (-NEAR..=NEAR).map(move |dx| (dx, dy)));
    setting & COMPANY == 0 || around.any(|(dx, dy)| (dx, dy) != (0, 0) && lit(x + dx, y + dy))
}

/// CPU twin.
pub fn twin(lit: &Mask, skeleton: &Mask, setting: u32) -> Mask {
    let (w, h) = (skeleton.width as i32, skeleton.height as i32);
    let of = |m: &Mask, x: i32, y: i32| (0..w).contains(&x) && (0..h).contains(&y) && m.get(x as u32, y as u32);
    Mask::from_fn(skeleton.width, skeleton.height, |x, y| {
        let (u, v) = (x as i32, y as i32);
        let kept = || kept(u, v, setting, |x, y| of(skeleton, x, y));
        skeleton.get(x, y) && kept() && in_company(u, v, setting, |x, y| of(lit, x, y))
    })
}

/// Thins the skeleton across the stripe. Lengthened lines count too, because the end of a branch is lengthened across
/// the stripe.
pub const STAGE: Stage = Stage {
    name: "spacing",
    wgsl: include_str!("../../../../shaders/spacing.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "lit", access: Texels },
        Binding { name: "mask", access: Texels },
        Binding { name: "spaced", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// Leaves one fit for each column of a wide stripe.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin: stage_twin,
    binds: &["frame", "lit header", "lit list", "lit", "long", "spaced"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

pub(crate) fn stage_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, lit, mask, spaced] = b else { unreachable!() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        let (tx, ty, shot) = tile_unpack(tile);
        let of = |m: &[u32], x: i32, y: i32| {
            let inside = (0..f.width as i32).contains(&x) && (0..f.height as i32).contains(&y);
            inside && m[f.mask_word(shot, x as u32, y as u32)] >> (x & 31) & 1 == 1
        };
        let skeleton = |x: i32, y: i32| of(mask, x, y) && of(lit, x, y);
        for row in 0..8 {
            let (mut bits, mut some) = (mask[mask_index(&f, tile, row)], 0);
            while bits != 0 {
                let bit = bits.trailing_zeros();
                bits &= bits - 1;
                let (x, y) = ((32 * tx + bit) as i32, (8 * ty + row) as i32);
                if kept(x, y, f.spacing, skeleton) && in_company(x, y, f.spacing, |x, y| of(lit, x, y)) {
                    some |= 1 << bit;
                }
            }
            spaced[mask_index(&f, tile, row)] = some;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::stripe::skeleton::twin as skeletons;

    /// The rows that are kept of a column in which `rows` are lit.
    fn of_column(rows: std::ops::Range<u32>, step: u32) -> Vec<u32> {
        let (line, setting) = (rows, word(1.0, step as f32, Vec2::new(0.0, 1.0)));
        let column = Mask::from_fn(9, 200, |x, y| x == 4 && line.contains(&y));
        let kept = twin(&column, &column, setting);
        // The same for a line along a row.
        let upright = Mask::from_fn(200, 9, |x, y| y == 4 && line.contains(&x));
        assert_eq!(setting | 1 << 16, word(1.0, step as f32, Vec2::new(-1.0, 0.1)));
        let turned = twin(&upright, &upright, setting | 1 << 16);
        assert!((0..200).all(|i| kept.get(4, i) == turned.get(i, 4)), "rows and columns differ");
        (0..200).filter(|&y| kept.get(4, y)).collect()
    }

    #[test]
    fn a_short_run_leaves_its_middle_and_a_long_one_its_detail() {
        assert_eq!(of_column(50..51, 4), [50]);
        assert_eq!(of_column(50..55, 4), [52]);
        assert_eq!(of_column(0..4, 4), [2]);
        assert_eq!(of_column(50..70, 4), [52, 56, 60, 64, 68]);
        // Two branches of one stripe, and two stripes.
        let two = |apart: u32| {
            let lines = Mask::from_fn(9, 60, |_, y| y == 20 || y == 20 + apart);
            twin(&lines, &lines, 4)
        };
        assert_eq!((4, 9), (word(1.0, 4.0, Vec2::new(0.0, 1.0)), skeletons(&two(4)).len()));
        assert_eq!(18, skeletons(&two(5)).len());
        // A run without an end within reach, as on a steep face, is sampled with the same spacing.
        assert!(of_column(20..180, 3).windows(2).filter(|w| w[1] - w[0] == 3).count() >= 50);
    }

    /// Lit pixels count as neighbours, not skeleton pixels: a blob is thinned to one pixel. At the border nothing
    /// beyond it counts.
    #[test]
    fn lit_pixels_by_themselves_are_left_out() {
        let pixels = |places: &'static [(u32, u32)]| Mask::from_fn(40, 30, |x, y| places.contains(&(x, y)));
        let left = |lit: &Mask, skeleton: &Mask| skeletons(&twin(lit, skeleton, COMPANY)).len();
        let alone = pixels(&[(0, 0), (39, 29), (20, 10), (20, 14), (31, 20), (35, 20)]);
        assert_eq!(left(&alone, &alone), 0);
        assert!(twin(&alone, &alone, 0) == alone);
        let pairs = pixels(&[(20, 10), (20, 13), (30, 20), (33, 20), (5, 5), (8, 8)]);
        assert_eq!(left(&pairs, &pairs), 6);
        assert_eq!(left(&pixels(&[(9, 9), (10, 9)]), &pixels(&[(9, 9)])), 1);
    }

    #[test]
    fn what_lies_along_the_stripe_is_kept() {
        let setting = word(1.0, 4.0, Vec2::new(0.0, 1.0));
        let slanted = Mask::from_fn(120, 60, |x, y| y == 10 + x / 3);
        assert!(twin(&slanted, &slanted, setting) == slanted);
        assert_eq!(word(1.0, 1.9, Vec2::new(0.0, 1.0)), 0, "a narrow stripe keeps every pixel");
    }
}
