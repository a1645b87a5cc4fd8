//! In: slopes of a pyramid level in whole numbers. Out: directions, and how well every strided place matches each of 16
//! directions, as WGSL stages with their CPU twins (docs/math.md, Shape matching, coarse search). Frame and unit: cells
//! of the level, x right, y down; slopes in 1 / 64 of the threshold; responses 0 to 4.

use super::frame::{BINS, SHARED, STRIDE, ShapeFrame, UNIFORM};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};

/// The direction of each cell's slope as one of 16 bits; one invocation per cell.
pub const QUANTISE: Stage = Stage {
    name: "shape_quantise",
    wgsl: include_str!("../../../shaders/shape_quantise.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "slopes", access: Texels },
        Binding { name: "bits", access: ReadWrite },
    ],
    uniform: UNIFORM,
    overrides: &[],
};

/// How well each strided place matches each direction; one invocation for four places of one phase.
pub const SPREAD: Stage = Stage {
    name: "shape_spread",
    wgsl: include_str!("../../../shaders/shape_spread.wgsl"),
    shared: &[SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "bits", access: Texels },
        Binding { name: "responses", access: ReadWrite },
    ],
    uniform: UNIFORM,
    overrides: &[],
};

/// Largest component of a packed slope; with it, squares and products with a tangent stay below 2^31.
const LARGEST: i32 = 8191;
/// The threshold in packed slopes.
const UNIT: f32 = 64.0;
/// tan(11.25 degrees) and tan(33.75 degrees) in units of 1 / 65536: they separate the directions in an octant.
const TAN_11: i32 = 13036;
const TAN_33: i32 = 43790;

/// Packs the two components of a slope into one word.
pub fn packed(gx: i32, gy: i32) -> u32 {
    (gx as u32 & 0xffff) | (gy as u32) << 16
}

/// A slope in the format of the stages: in 1 / 64 of `threshold`; a strong slope is shortened so that it keeps its
/// direction. This is the only floating-point step of the coarse search. It is done on the host, so that every machine
/// uses the same numbers.
pub fn pack(gx: f32, gy: f32, threshold: f32) -> u32 {
    let k = UNIT / threshold.max(f32::MIN_POSITIVE);
    let most = gx.abs().max(gy.abs()) * k;
    let k = if most > LARGEST as f32 { k * (LARGEST as f32 / most) } else { k };
    let whole = |g: f32| ((g * k).round() as i32).clamp(-LARGEST, LARGEST);
    packed(whole(gx), whole(gy))
}

/// The bit of a packed slope's direction, 0 below the threshold.
pub fn direction(slope: u32) -> u16 {
    let (gx, gy) = (i32::from(slope as u16 as i16), slope as i32 >> 16);
    if gx * gx + gy * gy < (UNIT * UNIT) as i32 {
        return 0;
    }
    let (ax, ay) = (gx.abs(), gy.abs());
    let (small, large) = (ax.min(ay), ax.max(ay));
    let within = u32::from(small << 16 > TAN_11 * large) + u32::from(small << 16 > TAN_33 * large);
    let quarter = if ax < ay { 4 - within } else { within };
    let half = if gx < 0 { 8 - quarter } else { quarter };
    1 << if gy < 0 { (16 - half) % 16 } else { half }
}

/// How well a set of directions matches direction `want`: 4 for the same direction, 3 and 1 for one and two bins off.
pub fn response(bits: u16, want: usize) -> u8 {
    // Without branches, so that a row of sets can be processed in parallel.
    let bits = bits.rotate_right(want as u32);
    let near = |mask: u16, score: u8| if bits & mask != 0 { score } else { 0 };
    near(1, 4).max(near(1 << 1 | 1 << 15, 3)).max(near(1 << 2 | 1 << 14, 1))
}

/// The set of directions with the opposite of each added.
pub fn both_polarities(bits: u16) -> u16 {
    bits | bits.rotate_left(8)
}

pub(crate) fn quantise_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let [_, slopes, bits] = b else { unreachable!() };
    for (out, &slope) in bits.iter_mut().zip(slopes.iter()) {
        *out = u32::from(direction(slope));
    }
}

pub(crate) fn spread_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let frame = ShapeFrame::read(&b[0]);
    let [_, bits, responses] = b else { unreachable!() };
    let (w, h) = (i64::from(frame.width), i64::from(frame.height));
    let half = STRIDE as i64 / 2;
    let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut responses[frame.first as usize..]);
    for y in 0..h {
        for x in 0..w {
            let mut all = 0u16;
            for yy in (y - half).max(0)..(y + half).min(h) {
                for xx in (x - half).max(0)..(x + half).min(w) {
                    all |= bits[(yy * w + xx) as usize] as u16;
                }
            }
            let all = if frame.ignore != 0 { both_polarities(all) } else { all };
            let (px, py) = (x as usize + frame.margin as usize, y as usize + frame.margin as usize);
            let phase = py % STRIDE * STRIDE + px % STRIDE;
            let place = py / STRIDE * 4 * frame.words as usize + px / STRIDE;
            for want in 0..BINS {
                bytes[(want * STRIDE * STRIDE + phase) * 4 * frame.plane() + place] = response(all, want);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_the_nearest_bins() {
        for k in 0..3600 {
            let a = (f64::from(k) + 0.5) * std::f64::consts::TAU / 3600.0;
            let bin = (a / std::f64::consts::TAU * 16.0).round() as usize % 16;
            let border = (a / std::f64::consts::TAU * 16.0).fract() - 0.5;
            // At 100 thresholds a component is known to 1 / 6400.
            if border.abs() > 1e-3 {
                let slope = pack(100.0 * a.cos() as f32, 100.0 * a.sin() as f32, 1.0);
                assert_eq!(direction(slope), 1 << bin, "at {a}");
            }
        }
        assert_eq!(direction(pack(0.9, 0.1, 1.0)), 0);
        assert_eq!(direction(pack(-1e9, 1e9, 1.0)), 1 << 6, "a strong slope keeps its direction");
    }

    #[test]
    fn responses_fall_with_the_angle_and_forget_polarity_on_request() {
        assert_eq!([0, 1, 2, 3, 8].map(|k| response(1 << k, 0)), [4, 3, 1, 0, 0]);
        assert_eq!(response(1 << 15, 0), 3);
        assert_eq!(response(both_polarities(1 << 8), 0), 4);
        assert_eq!(response(0, 5), 0);
    }
}
