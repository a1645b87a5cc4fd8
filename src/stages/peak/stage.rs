//! In: the bindings of the peak stage as words. Out: the same bindings with the peaks and the strongest amplitudes,
//! from the CPU twin. Frame and unit: words; peaks in pixels and grey levels.

use super::found::Peak;
use super::frame;
use super::frame::{SHARED, frame_of};
use super::grey::{Grey, Place};
use super::lanes::LANES;
use super::params::Method;
use super::profile::Profiles;
use super::twin::measured;
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::frame::PX_LOG2;
use crate::stages::listing;
use crate::stages::stripe::choose;
use rayon::prelude::*;

/// Selects the method when the pipeline is built: 0 Gaussian, 1 centroid, 2 derivative, 3 the skeleton pixel.
pub const METHOD: &str = "peak_method";

/// Quads of samples of a profile, a constant of the pipeline: [`super::PeakFrame::quads`].
pub const QUADS: &str = "quads";

const DIRECTION: &str = include_str!("../../../shaders/shared/direction.wgsl");
const PROFILE: &str = include_str!("../../../shaders/shared/profile.wgsl");

/// One peak for each skeleton pixel, and the strongest of each line across the stripe; one invocation per pixel.
pub const STAGE: Stage = Stage {
    name: "peak",
    wgsl: include_str!("../../../shaders/peak.wgsl"),
    shared: &[SHARED, DIRECTION, PROFILE, choose::LINE_OF, listing::SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "image", access: Texels },
        Binding { name: "header", access: Read },
        Binding { name: "pixels", access: Texels },
        Binding { name: "peaks", access: ReadWrite },
        Binding { name: "strongest", access: ReadWrite },
    ],
    uniform: frame::UNIFORM,
    overrides: &[PX_LOG2, METHOD, QUADS],
};

impl Method {
    /// The value of the override [`METHOD`].
    pub fn number(self) -> f64 {
        f64::from(self as u8)
    }
}

/// One picture of a batch, as packed for the GPU.
#[derive(Clone, Copy)]
struct Packed<'a> {
    words: &'a [u32],
    pitch: i32,
    width: i32,
    height: i32,
    px_log2: u32,
}

impl Grey for Packed<'_> {
    #[inline(always)]
    fn inside(&self, x: i32, y: i32) -> i32 {
        let bits = 32 >> self.px_log2;
        let place = x as u32 & ((1 << self.px_log2) - 1);
        let word = self.words[(y * self.pitch + (x >> self.px_log2)) as usize];
        (word >> (place * bits) & ((1u32 << bits) - 1)) as i32
    }
    #[inline(always)]
    fn whole(&self, x: i32, y: i32) -> i32 {
        self.inside(x.clamp(0, self.width - 1), y.clamp(0, self.height - 1))
    }
    #[inline(always)]
    fn is(&self, other: &Self) -> bool {
        std::ptr::eq(self.words, other.words)
    }
    #[inline(always)]
    fn stored(&self, number: i32) -> i32 {
        self.inside(number % self.width, number / self.width)
    }
    type Four = [i32; 4];
    #[inline(always)]
    fn four(&self, number: i32) -> [i32; 4] {
        std::array::from_fn(|i| self.stored(number + i as i32))
    }
    #[inline(always)]
    fn of_four(four: [i32; 4], which: usize) -> i32 {
        four[which]
    }
}

/// CPU twin: the peaks of all pixels of a batch.
pub fn stage_twin(b: &mut [Vec<u32>], overrides: &[(&'static str, f64)]) {
    let f = frame_of(b);
    let value = |name: &str| overrides.iter().find(|o| o.0 == name).map_or(0.0, |o| o.1) as u32;
    let px_log2 = value(PX_LOG2);
    let method = Method::ALL[value(METHOD) as usize];
    let [_, image, header, points, peaks, strongest] = b else { unreachable!() };
    let place = |p: &[u32]| {
        let from = (p[1] * f.shot_words) as usize;
        let words = &image[from..from + f.shot_words as usize];
        let image = Packed { words, pitch: f.pitch as i32, width: f.width, height: f.height, px_log2 };
        Place { image, pixel: p[0], shot: p[1] }
    };
    let mut found: Vec<Peak> = points[..2 * header[listing::COUNT] as usize]
        .par_chunks(2 * LANES)
        .flat_map_iter(|some| {
            let places: Vec<_> = some.chunks_exact(2).map(place).collect();
            let (mut peaks, mut profiles) = (Vec::with_capacity(LANES), Profiles::new(&f));
            measured(&places, &mut profiles, &f, method, |peak| peaks.push(peak));
            peaks
        })
        .collect();
    for k in &mut found {
        let from = (k.shot * f.lines) as usize;
        choose::alone(k, &f, &mut strongest[from..from + f.lines as usize]);
    }
    let words: &[u32] = bytemuck::cast_slice(&found);
    peaks[..words.len()].copy_from_slice(words);
}

/// Largest difference of two lists of peaks, in units of the limit for each number. The limit for a position is 0.01 px
/// or a hundredth of its sigma, because rounding decides what the light does not determine. The other limits are: width
/// 1 %, stated sigma 2 %, amplitude, background and strongest amplitudes 0.5 % or a hundredth of a grey level.
/// Everything else must be equal. If a number is so close to a limit that only one of the two peaks is rejected, each
/// must have the reason that its own numbers give.
pub fn apart(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    let frame = frame_of(gpu);
    let (a, b): (&[Peak], &[Peak]) = (bytemuck::cast_slice(&gpu[4]), bytemuck::cast_slice(&twin[4]));
    let near = |x: f32, y: f32, relative: f32, least: f32| {
        f64::from((x - y).abs() / (relative * x.abs().max(y.abs())).max(least))
    };
    let (top_a, top_b) = (&gpu[5], &twin[5]);
    let lengths = a.len() == b.len() && top_a.len() == top_b.len();
    let tops = top_a.iter().zip(top_b).fold(if lengths { 0.0 } else { f64::INFINITY }, |worst: f64, (&a, &b)| {
        worst.max(near(f32::from_bits(a), f32::from_bits(b), 5e-3, 0.01))
    });
    let judged = |k: &Peak| k.flags & 0xff == choose::reason(k, &frame) as u32;
    a.iter().zip(b).fold(tops, |worst, (a, b)| {
        let flags = a.flags == b.flags || (a.flags >> 8 == b.flags >> 8 && judged(a) && judged(b));
        let same = flags && a.pixel == b.pixel && a.shot == b.shot;
        // A centre with a sigma of a pixel is rejected; rounding decides where a fit without a solution stops.
        if same && a.sigma_px.min(b.sigma_px) >= 1.0 {
            return worst;
        }
        let place = (0.01 * a.sigma_px.max(b.sigma_px)).max(0.01);
        let d = [
            near(a.u, b.u, 0.0, place),
            near(a.v, b.v, 0.0, place),
            near(a.normal_u, b.normal_u, 0.0, 1e-3),
            near(a.normal_v, b.normal_v, 0.0, 1e-3),
            near(a.amplitude, b.amplitude, 5e-3, 0.01),
            near(a.background, b.background, 5e-3, 0.01),
            near(a.width_px, b.width_px, 0.01, 1e-3),
            near(a.sigma_px, b.sigma_px, 0.02, 1e-3),
            near(a.snr, b.snr, 5e-3, 0.01),
        ];
        let numbers = d.into_iter().fold(worst, |w, d| if d.is_nan() { f64::INFINITY } else { w.max(d) });
        if same { numbers } else { f64::INFINITY }
    })
}
