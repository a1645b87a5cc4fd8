//! In: a grey picture. Out: a mask of the pixels that are brighter than the mean of their neighbourhood. Frame and
//! unit: pixels; offset and minimum in grey levels of the picture's own depth.

use super::stats::padded_pixel;
use super::threshold_params::{ThresholdParams, Window};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::raster::{Image, Mask};
use crate::stages::frame;
use crate::stages::frame::{COLUMNS, Frame, PIXELS, PX_LOG2, SHARED, frame_of, tile_unpack};
use crate::stages::listing;
use crate::stages::same::Same;
use crate::stages::step::{Groups, Step};

/// Override constant of the mean window's pipeline; the window's edge is 2 radius + 1.
pub const RADIUS: &str = "radius";

/// Threshold with a mean window; its list contains runs of tiles ([`crate::stages::stripe::tiles`]).
pub const MEAN: Stage = Stage {
    name: "threshold",
    wgsl: include_str!("../../../shaders/threshold.wgsl"),
    shared: &[SHARED, COLUMNS],
    workgroup: [64, 1, 1],
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
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2, RADIUS],
};

/// Finds the lit pixels of runs of tiles, by the mean of a window.
pub const BY_MEAN: Step = Step {
    stage: &MEAN,
    twin: mean_twin,
    binds: &["frame", "image", "run header", "runs", "roi", "mask", "lit", "lit header", "lit list"],
    groups: Groups::Listed("run header"),
    same: Same::Lists(&[(8, 1)]),
};

/// Threshold with a Gaussian window.
pub const GAUSSIAN: Stage = Stage {
    name: "threshold_gaussian",
    wgsl: include_str!("../../../shaders/threshold_gaussian.wgsl"),
    shared: &[SHARED, PIXELS],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "image", access: Texels },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "weights", access: Read },
        Binding { name: "quads", access: ReadWrite },
    ],
    overrides: &[PX_LOG2],
    ..MEAN
};

/// Finds lit pixels with a Gaussian window.
pub const BY_GAUSSIAN: Step = Step {
    stage: &GAUSSIAN,
    twin: stage_twin,
    binds: &["frame", "image", "single header", "singles", "weights", "quads"],
    groups: Groups::Listed("single header"),
    same: Same::Within(
        pixels_apart,
        1.0,
        "f32 sums in another order; at most 1 pixel in 100,000 lies that near to its limit",
    ),
};

/// Combines quads to words, cut to the picture and the region of interest.
pub const GATHER: Stage = Stage {
    name: "gather",
    wgsl: include_str!("../../../shaders/gather.wgsl"),
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "listing", access: Read },
        Binding { name: "list", access: Texels },
        Binding { name: "quads", access: Texels },
        Binding { name: "roi", access: Texels },
        Binding { name: "mask", access: ReadWrite },
        Binding { name: "lit", access: ReadWrite },
        Binding { name: "lit_listing", access: ReadWrite },
        Binding { name: "lit_list", access: ReadWrite },
    ],
    shared: &[SHARED],
    ..GAUSSIAN
};

/// Writes the mask's words of the Gaussian window's tiles.
pub const GATHERING: Step = Step {
    stage: &GATHER,
    twin: gather_twin,
    binds: &["frame", "single header", "singles", "quads", "roi", "mask", "lit", "lit header", "lit list"],
    groups: Groups::Listed("single header"),
    same: Same::Lists(&[(8, 1)]),
};

/// Lit exactly when `value - offset > round(sum / n^2)`. Because n is odd, the mean is never half way between two
/// levels. So this is `n^2 (value - offset) > sum + (n^2 - 1) / 2` in whole numbers; the largest term, 101^2 * 131070,
/// fits in 31 bits.
#[inline]
pub fn passes_mean(value: u32, sum: u32, p: &ThresholdParams) -> bool {
    let area = (p.size * p.size) as i32;
    area * (value as i32 - p.offset) > sum as i32 + (area - 1) / 2 && value >= u32::from(p.minimum)
}

/// CPU twin: the whole picture, pixel by pixel.
pub fn twin(image: &Image, p: &ThresholdParams) -> Mask {
    match p.window {
        Window::Mean => mean(image, p),
        Window::Gaussian => gaussian(image, p),
    }
}

/// Running column sums, then a running sum along the row: four additions per pixel for any window.
fn mean(image: &Image, p: &ThresholdParams) -> Mask {
    let (w, h, r) = (image.width as usize, image.height as usize, (p.size / 2) as usize);
    let mut mask = Mask::new(image.width, image.height);
    let words = mask.words_per_row();
    let rows = Rows::new(image);
    let mut columns = vec![0u32; w];
    let (mut entering, mut leaving) = (vec![0u32; w], vec![0u32; w]);
    for i in 0..p.size as usize {
        rows.copy(i.saturating_sub(r).min(h - 1), &mut entering);
        columns.iter_mut().zip(&entering).for_each(|(c, &v)| *c += v);
    }
    let mut row = vec![0u32; w];
    // Column sums with the border repeated on both sides: no clamping in the inner loop.
    let mut wide = vec![0u32; w + 2 * r + 1];
    for y in 0..h {
        rows.copy(y, &mut row);
        wide[..r].fill(columns[0]);
        wide[r..r + w].copy_from_slice(&columns);
        wide[r + w..].fill(columns[w - 1]);
        let mut sum: u32 = wide[..2 * r].iter().sum();
        let out = &mut mask.words[y * words..(y + 1) * words];
        for x in 0..w {
            sum += wide[x + 2 * r];
            out[x / 32] |= u32::from(passes_mean(row[x], sum, p)) << (x % 32);
            sum -= wide[x];
        }
        if y + 1 < h {
            rows.copy((y + 1 + r).min(h - 1), &mut entering);
            rows.copy(y.saturating_sub(r), &mut leaving);
            for x in 0..w {
                columns[x] = columns[x] + entering[x] - leaving[x];
            }
        }
    }
    mask
}

/// Weights along one axis of the Gaussian window, as from OpenCV's getGaussianKernel with sigma 0.
pub fn gaussian_weights(size: u32) -> Vec<f32> {
    match size {
        3 => return vec![0.25, 0.5, 0.25],
        5 => return vec![0.0625, 0.25, 0.375, 0.25, 0.0625],
        7 => return vec![0.03125, 0.109375, 0.21875, 0.28125, 0.21875, 0.109375, 0.03125],
        9 => return [4.0f32, 13., 30., 51., 60., 51., 30., 13., 4.].map(|v| v / 256.0).to_vec(),
        _ => {}
    }
    let r = f64::from(size / 2);
    let sigma = 0.3 * (r - 1.0) + 0.8;
    let raw: Vec<f64> = (0..size).map(|i| (-(f64::from(i) - r).powi(2) / (2.0 * sigma * sigma)).exp()).collect();
    let sum: f64 = raw.iter().sum();
    raw.iter().map(|v| (v / sum) as f32).collect()
}

/// First along the row, then down the columns, both in f32 and in ascending order, as in the shader.
fn gaussian(image: &Image, p: &ThresholdParams) -> Mask {
    let (w, h, r) = (image.width as usize, image.height as usize, (p.size / 2) as usize);
    let weights = gaussian_weights(p.size);
    let rows = Rows::new(image);
    let mut blurred = vec![0f32; w * h];
    let mut row = vec![0u32; w];
    let mut wide = vec![0f32; w + 2 * r];
    for (y, out) in blurred.chunks_exact_mut(w).enumerate() {
        rows.copy(y, &mut row);
        for (i, v) in wide.iter_mut().enumerate() {
            *v = row[i.saturating_sub(r).min(w - 1)] as f32;
        }
        for (k, &weight) in weights.iter().enumerate() {
            out.iter_mut().zip(&wide[k..]).for_each(|(o, &v)| *o += weight * v);
        }
    }
    let mut mask = Mask::new(image.width, image.height);
    let words = mask.words_per_row();
    let mut sums = vec![0f32; w];
    for y in 0..h {
        sums.fill(0.0);
        for (k, &weight) in weights.iter().enumerate() {
            let from = (y + k).saturating_sub(r).min(h - 1) * w;
            sums.iter_mut().zip(&blurred[from..from + w]).for_each(|(s, &v)| *s += weight * v);
        }
        rows.copy(y, &mut row);
        for x in 0..w {
            let value = row[x] as i32;
            let lit = value - p.offset > sums[x].round_ties_even() as i32 && value >= i32::from(p.minimum);
            mask.words[y * words + x / 32] |= u32::from(lit) << (x % 32);
        }
    }
    mask
}

/// Rows of a picture of either depth, as u32.
struct Rows<'a>(&'a Image);

impl<'a> Rows<'a> {
    fn new(image: &'a Image) -> Self {
        Rows(image)
    }
    fn copy(&self, y: usize, out: &mut [u32]) {
        use crate::raster::Pixels;
        let w = out.len();
        match &self.0.pixels {
            Pixels::U8(p) => out.iter_mut().zip(&p[y * w..]).for_each(|(o, &v)| *o = u32::from(v)),
            Pixels::U16(p) => out.iter_mut().zip(&p[y * w..]).for_each(|(o, &v)| *o = u32::from(v)),
        }
    }
}

/// One shot of the padded batch as a picture: beyond the border the stages read the repeated pixels of the padding.
fn padded_shot(f: &Frame, image: &[u32], px_log2: u32, shot: u32) -> Image {
    let (w, h) = (32 * f.tiles_x, 8 * f.tiles_y);
    let px = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
    let px = px.map(|(x, y)| padded_pixel(f, image, px_log2, shot, x.min(f.width - 1), y) as u16);
    Image { width: w, height: h, bits: 16, pixels: crate::raster::Pixels::U16(px.collect()) }
}

pub(crate) fn mean_twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let p = f.threshold();
    let masks: Vec<Mask> = (0..f.shots).map(|s| twin(&padded_shot(&f, &b[1], overrides[0].1 as u32, s), &p)).collect();
    let [_, _, listing, list, roi, mask, lit, lit_listing, lit_list] = b else { unreachable!() };
    for run in list.chunks_exact(2).take(listing[listing::COUNT] as usize) {
        let (tx, first, shot) = tile_unpack(run[0]);
        for ty in first..first + run[1] {
            let bits = |row: u32| {
                let y = 8 * ty + row;
                let passes = |x: u32| 32 * tx + x < f.width && y < f.height && masks[shot as usize].get(32 * tx + x, y);
                (0..32).filter(|&x| passes(x)).fold(0, |w, x| w | 1 << x)
            };
            store(&f, frame::tile_pack(tx, ty, shot), bits, roi, [mask, lit, lit_listing, lit_list]);
        }
    }
}

/// Stores a tile's lit pixels, row by row, in both masks, cut to the region of interest. A tile with a lit pixel is
/// listed.
fn store(f: &Frame, tile: u32, bits: impl Fn(u32) -> u32, roi: &[u32], out: [&mut Vec<u32>; 4]) {
    let (tx, ty, _) = tile_unpack(tile);
    let [mask, lit, listing, list] = out;
    let mut some = 0;
    for row in 0..8 {
        let region = if f.flags & frame::HAS_ROI != 0 { roi[f.mask_word(0, 32 * tx, 8 * ty + row)] } else { !0 };
        let at = crate::stages::listing::mask_index(f, tile, row);
        mask[at] = bits(row) & region;
        lit[at] = mask[at];
        some |= mask[at];
    }
    if some != 0 {
        crate::stages::listing::append(listing, list, [tile]);
    }
}

pub(crate) fn stage_twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let quads = b.len() - 1;
    let masks: Vec<Mask> =
        (0..f.shots).map(|s| twin(&padded_shot(&f, &b[1], overrides[0].1 as u32, s), &f.threshold())).collect();
    for slot in 0..b[2][3] as usize {
        let (tx, ty, shot) = tile_unpack(b[3][2 * slot]);
        for q in 0..8 {
            let lit = |r: u32, k: u32| masks[shot as usize].get(32 * tx + 4 * q + k, 8 * ty + r);
            let bits = (0..32).filter(|&i| lit(i / 4, i % 4)).fold(0, |w, i| w | 1 << i);
            b[quads][8 * slot + q as usize] = bits;
        }
    }
}

pub(crate) fn gather_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let [_, listing, list, quads, roi, mask, kept, lit_listing, lit_list] = b else { unreachable!() };
    for slot in 0..listing[listing::COUNT] as usize {
        let tile = list[2 * slot];
        let (tx, ty, _) = tile_unpack(tile);
        let bits = |row: u32| {
            let lit = |x: u32| quads[8 * slot + (x / 4) as usize] >> (4 * row + x % 4) & 1 == 1;
            let inside = |x: u32| 32 * tx + x < f.width && 8 * ty + row < f.height;
            (0..32).filter(|&x| lit(x) && inside(x)).fold(0, |w, x| w | 1 << x)
        };
        store(&f, tile, bits, roi, [mask, kept, lit_listing, lit_list]);
    }
}

/// Number of pixels in the quads that differ, per 100,000.
pub fn pixels_apart(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    let (a, b) = (gpu.last().unwrap(), twin.last().unwrap());
    let apart: u32 = a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum();
    f64::from(apart) * 1e5 / (a.len() as f64 * 32.0)
}
