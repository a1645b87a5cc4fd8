//! In: pictures, one picture of the ambient light. Out: the pictures minus the ambient light. Frame and unit: grey
//! levels; a saturated pixel stays saturated.

use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::{Image, Pixels};
use crate::stages::frame;
use crate::stages::frame::{Frame, PX_LOG2, SHARED, frame_of};
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// Subtracts the ambient light from the pictures in place; one invocation for 4 words of one shot.
pub const STAGE: Stage = Stage {
    name: "ambient",
    wgsl: include_str!("../../../shaders/ambient.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "image", access: ReadWrite },
        Binding { name: "ambient", access: Read },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2],
};

/// Subtracts the ambient light from the pictures in place.
pub const STEP: Step =
    Step { stage: &STAGE, twin, binds: &["frame", "image", "ambient"], groups: Groups::Of(groups), same: Same::Words };

/// One invocation for 4 words of one shot.
pub fn groups(f: &Frame) -> [u32; 3] {
    STAGE.groups([f.shot_words / 4, f.shots, 1])
}

/// A pixel minus the ambient light, never below 0. A saturated pixel stays, because its true value is unknown.
pub fn subtract(value: u32, ambient: u32, full_scale: u32) -> u32 {
    if value >= full_scale { value } else { value.saturating_sub(ambient) }
}

/// A picture minus the ambient light; both have the same size and depth.
pub fn without(image: &Image, ambient: &Image) -> Image {
    let full = image.full_scale();
    let left = |(s, a): (&u16, &u16)| if *s >= full { *s } else { s.saturating_sub(*a) };
    let pixels = match (&image.pixels, &ambient.pixels) {
        (Pixels::U8(s), Pixels::U8(a)) => {
            let left = |(s, a): (&u8, &u8)| if *s == u8::MAX { *s } else { s.saturating_sub(*a) };
            Pixels::U8(s.iter().zip(a).map(left).collect())
        }
        (Pixels::U16(s), Pixels::U16(a)) => Pixels::U16(s.iter().zip(a).map(left).collect()),
        _ => unreachable!("the depths were compared"),
    };
    Image { pixels, ..*image }
}

pub(crate) fn twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let bits = 32 >> overrides[0].1 as u32;
    let [_, image, ambient] = b else { unreachable!() };
    for (v, a) in image.iter_mut().zip(ambient.iter().cycle().take((f.shot_words * f.shots) as usize)) {
        let mut out = 0;
        for shift in (0..32).step_by(bits) {
            let px = |w: u32| w >> shift & ((1u64 << bits) - 1) as u32;
            out |= subtract(px(*v), px(*a), f.full_scale) << shift;
        }
        *v = out;
    }
}
