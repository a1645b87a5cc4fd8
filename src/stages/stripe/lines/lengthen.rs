//! In: a picture, its lit pixels and their skeleton. Out: the skeleton with its ends lengthened to the edge of the
//! surface. Frame and unit: pixels. Brightness is relative to the stripe's own, so no setting is in grey levels.

use crate::fault::{Fault, Result};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::{Image, Mask};
use crate::stages::frame;
use crate::stages::frame::{PIXELS, PX_LOG2, SHARED, frame_of, tile_unpack};
use crate::stages::listing::{self, mask_index};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// Thinning removes a lit streak from its ends as it does from its sides, so a skeleton ends before the edge by half of
/// the streak's thickness. The edge is where a blurred step has half of its height. An end is lengthened while the
/// picture there has at least `share` of the brightness at the end and was lit in the threshold.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LengthenParams {
    /// Most pixels added to one end, in stripe widths (sigma), 0..=6; 0 is off. Thinning removes about two.
    pub reach: f32,
    /// Share of the end's brightness, 0.2..=1. 0.5 is the physical edge; less extends the line into the blur beyond it.
    pub share: f32,
}

impl Default for LengthenParams {
    fn default() -> Self {
        LengthenParams { reach: 2.5, share: 0.45 }
    }
}

impl LengthenParams {
    /// Refuses values out of their range.
    pub fn check(&self) -> Result<()> {
        if !(0.0..=6.0).contains(&self.reach) || !(0.2..=1.0).contains(&self.share) {
            return Err(Fault::usage(format!(
                "lengthen reach is {} and share is {}; they must be in 0..=6 widths and 0.2..=1",
                self.reach, self.share
            ))
            .next("correct [extraction] in station.toml"));
        }
        Ok(())
    }
    /// The setting in the stage's format: most pixels added, and from bit 16 on the share in 4096ths.
    pub fn word(&self, width_px: f32) -> u32 {
        (self.reach * width_px).round() as u32 | ((4096.0 * self.share).round() as u32) << 16
    }
}

/// CPU twin.
pub fn twin(image: &Image, lit: &Mask, skeleton: &Mask, width_px: f32, p: &LengthenParams) -> Mask {
    let (w, h) = (image.width as i32, image.height as i32);
    let setting = p.word(width_px);
    let mut out = skeleton.clone();
    let words = skeleton.words_per_row();
    for (k, &word) in skeleton.words.iter().enumerate() {
        let mut bits = word;
        while bits != 0 {
            let x = 32 * (k % words) as i32 + bits.trailing_zeros() as i32;
            let y = (k / words) as i32;
            bits &= bits - 1;
            if x < 3 || y < 3 || x >= w - 3 || y >= h - 3 {
                continue;
            }
            let get = |x: i32, y: i32| skeleton.get(x as u32, y as u32);
            let level = |x: i32, y: i32| u32::from(image.get(x as u32, y as u32));
            let lit = |x: i32, y: i32| lit.get(x as u32, y as u32);
            carry(x, y, (w, h), setting, get, lit, level, |a, b| out.set(a as u32, b as u32));
        }
    }
    out
}

/// Adds the pixels beyond an end of the skeleton; does nothing if the pixel is not an end.
#[allow(clippy::too_many_arguments)]
pub(in crate::stages) fn carry(
    x: i32,
    y: i32,
    (w, h): (i32, i32),
    setting: u32,
    skeleton: impl Fn(i32, i32) -> bool,
    lit: impl Fn(i32, i32) -> bool,
    level: impl Fn(i32, i32) -> u32,
    mut add: impl FnMut(i32, i32),
) {
    let Some((ax, ay)) = outward(skeleton, x, y) else { return };
    let (reach, share) = ((setting & 0xffff) as i32, setting >> 16);
    // Sum of the 3x3 pixels around a pixel; 9 * 65535 * 4096 needs 32 bits.
    let nine = |x: i32, y: i32| -> u32 {
        (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j))).map(|(i, j)| level(x + i, y + j)).sum()
    };
    let limit = share * nine(x, y);
    for t in 1..=reach {
        let a = x + (t as f32 * ax + 0.5).floor() as i32;
        let b = y + (t as f32 * ay + 0.5).floor() as i32;
        if a < 1 || b < 1 || a >= w - 1 || b >= h - 1 || !lit(a, b) || 4096 * nine(a, b) < limit {
            return;
        }
        add(a, b);
    }
}

/// The direction outwards from the end of a line, of unit length; `None` if the pixel is not an end. An end has one or
/// two neighbours, all on one side.
fn outward(skeleton: impl Fn(i32, i32) -> bool, x: i32, y: i32) -> Option<(f32, f32)> {
    let lit = |i: i32, j: i32| i32::from(skeleton(x + i, y + j));
    let (mut n, mut sx, mut sy) = (0, 0, 0);
    for j in -1..=1 {
        for i in -1..=1 {
            let l = lit(i, j) * i32::from(i != 0 || j != 0);
            n += l;
            sx += l * i;
            sy += l * j;
        }
    }
    if n == 0 || n > 2 || (n == 2 && sx.abs() + sy.abs() < 2) {
        return None;
    }
    let (mut ax, mut ay) = (0i32, 0i32);
    for j in -3..=3 {
        for i in -3..=3 {
            let l = lit(i, j);
            ax -= l * i;
            ay -= l * j;
        }
    }
    let (ax, ay) = (ax as f32, ay as f32);
    let length = (ax * ax + ay * ay).sqrt();
    (length > 0.0).then(|| (ax / length, ay / length))
}

/// Copies the listed tiles of the skeleton, to which pixels are added.
pub const COPY: Stage = Stage {
    name: "skeleton_copy",
    wgsl: include_str!("../../../../shaders/skeleton_copy.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "mask", access: Texels },
        Binding { name: "long", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// Copies the thinned mask, whose lines are then lengthened.
pub const COPYING: Step = Step {
    stage: &COPY,
    twin: copy_twin,
    binds: &["frame", "lit header", "lit list", "mask", "long"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

/// Lengthens the ends. Only lit pixels are added, so they lie in listed tiles.
pub const STAGE: Stage = Stage {
    name: "lengthen",
    wgsl: include_str!("../../../../shaders/lengthen.wgsl"),
    shared: &[SHARED, PIXELS],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "image", access: Texels },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "mask", access: Texels },
        Binding { name: "lit", access: Texels },
        Binding { name: "long", access: ReadWrite },
    ],
    ..COPY
};

/// Lengthens the ends of lines.
pub const STEP: Step = Step {
    stage: &STAGE,
    twin: stage_twin,
    binds: &["frame", "image", "lit header", "lit list", "mask", "lit", "long"],
    groups: Groups::Listed("lit header"),
    same: Same::Words,
};

pub(crate) fn copy_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, mask, long] = b else { unreachable!() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        for row in 0..8 {
            long[mask_index(&f, tile, row)] = mask[mask_index(&f, tile, row)];
        }
    }
}

pub(crate) fn stage_twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let px_log2 = overrides.iter().find(|o| o.0 == PX_LOG2).map_or(2, |o| o.1 as u32);
    let [_, image, listing, list, mask, lit, long] = b else { unreachable!() };
    for &tile in &list[..listing[listing::COUNT] as usize] {
        let (tx, ty, shot) = tile_unpack(tile);
        let place = |x: i32, y: i32| (f.mask_word(shot, x as u32, y as u32), x as u32 % 32);
        let bit = |words: &[u32], x: i32, y: i32| {
            let (at, shift) = place(x, y);
            words[at] >> shift & 1 == 1
        };
        let level = |x: i32, y: i32| {
            let bits = 32 >> px_log2;
            let word = image[(shot * f.shot_words + y as u32 * f.pitch + (x as u32 >> px_log2)) as usize];
            word >> ((x as u32 & ((1 << px_log2) - 1)) * bits) & ((1u32 << bits) - 1)
        };
        let (w, h) = (f.width as i32, f.height as i32);
        for row in 0..8 {
            let mut bits = mask[mask_index(&f, tile, row)];
            while bits != 0 {
                let (x, y) = ((32 * tx + bits.trailing_zeros()) as i32, (8 * ty + row) as i32);
                bits &= bits - 1;
                if x < 3 || y < 3 || x >= w - 3 || y >= h - 3 {
                    continue;
                }
                carry(
                    x,
                    y,
                    (w, h),
                    f.lengthen,
                    |x, y| bit(mask, x, y),
                    |x, y| bit(lit, x, y),
                    level,
                    |a, b| {
                        let (at, shift) = place(a, b);
                        long[at] |= 1 << shift;
                    },
                );
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::stripe::{skeleton, thin, threshold};
    use crate::stages::{Thinning, ThresholdParams};

    #[test]
    fn the_skeleton_reaches_the_edge_of_the_light() {
        // A horizontal streak of sigma 1.5 px that ends at x = 60 as a blurred step of sigma 1.5 px.
        let image = crate::stages::cases::drawn(100, 40, 8, |x, y| {
            let across = (-0.5 * ((f64::from(y) - 20.0) / 1.5).powi(2)).exp();
            let along = 1.0 / (1.0 + ((f64::from(x) - 60.0) / 0.9).exp());
            (4.0 + 200.0 * across * along).round() as u32
        });
        let lit = threshold::twin(&image, &ThresholdParams::default());
        let thin = thin::twin(&lit, Thinning::ZhangSuen);
        let last = |m: &Mask| skeleton::twin(m).iter().map(|p| p & 0xffff).max().unwrap();
        let long = twin(&image, &lit, &thin, 1.5, &LengthenParams { reach: 4.0, share: 0.5 });
        // The edge has half of the brightness; the lit area continues into the blur.
        assert!(last(&thin) <= 60 && (59..=61).contains(&last(&long)), "{} {}", last(&thin), last(&long));
        assert!(thin.words.iter().zip(&long.words).all(|(t, l)| t & !l == 0), "nothing is taken away");
        let off = twin(&image, &lit, &thin, 1.5, &LengthenParams { reach: 0.0, share: 0.5 });
        assert!(off == thin);
    }
}
