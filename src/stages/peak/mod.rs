//! In: a grey picture and its skeleton pixels. Out: one sub-pixel peak per skeleton pixel, with width,
//! amplitude, background, signal-to-noise and its own standard deviation across the stripe.
//! Frame and unit: image pixels (an integer is a pixel's centre), grey levels of the picture's depth.

mod fit;
mod frame;
mod measure;
mod methods;
mod noise;
mod profile;
mod stage;
mod turn;

pub use frame::{PeakFrame, UNIFORM};
pub use measure::{Stripe, measure};
pub use noise::noise;
pub(super) use stage::frame_of;
pub use stage::{METHOD, QUADS, SHARED, STAGE, apart, stage_twin};

use crate::fault::{Fault, Result};
use crate::raster::{Image, Pixels};
use crate::stages::choose::ChooseParams;
use multiversion::multiversion;
use rayon::prelude::*;

/// How the centre across the stripe is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Maximum likelihood of a Gaussian profile under shot, read and speckle noise; the best.
    #[default]
    Gaussian,
    /// Centre of gravity above the background; fast, pulled by whatever else is in the window.
    Centroid,
    /// Zero of the derivative of the Gaussian-smoothed profile ([steger98]).
    Derivative,
    /// The skeleton pixel itself, as in the paper that this program rebuilds: for comparisons.
    Pixel,
}

impl Method {
    /// In the order of their numbers.
    pub const ALL: [Method; 4] = [Method::Gaussian, Method::Centroid, Method::Derivative, Method::Pixel];
}

/// Settings of the sub-pixel step. The stripe's width and speckle are properties of laser and lens:
/// [`measure`] takes them from the first shots.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PeakParams {
    /// How the centre is found.
    pub method: Method,
    /// Gaussian sigma of the stripe's profile, px, 0.4..=12. All windows follow from it: laser waist, lens blur and
    /// magnification set it, and it scales with the resolution.
    pub width_px: f32,
    /// Speckle contrast of one pixel, 0..=1: standard deviation over mean of coherent light. 0 is a stripe without
    /// speckle; larger trusts the flanks more and the top less.
    pub speckle: f32,
    /// Read and quantisation noise, 0.1..=20 grey levels of an 8-bit picture.
    pub read_noise: f32,
    /// Shot noise: grey levels (8-bit) per photo-electron, 0..=5; its variance is this times the level.
    pub gain: f32,
    /// Sigma of the averaging along the stripe in units of `width_px`, 0..=4. At 1 the picture loses no detail that the
    /// lens had not already blurred; 0 uses one line across the stripe.
    pub along: f32,
    /// Most Gauss-Newton steps, 1..=20; a bright saturated stripe needs the most.
    pub steps: u32,
}

impl Default for PeakParams {
    fn default() -> Self {
        PeakParams {
            method: Method::Gaussian,
            width_px: 0.75,
            speckle: 0.18,
            read_noise: 0.7,
            gain: 0.05,
            along: 1.0,
            steps: 8,
        }
    }
}

impl PeakParams {
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("width_px", self.width_px, 0.4, 12.0),
            ("speckle", self.speckle, 0.0, 1.0),
            ("read_noise", self.read_noise, 0.1, 20.0),
            ("gain", self.gain, 0.0, 5.0),
            ("along", self.along, 0.0, 4.0),
            ("steps", self.steps as f32, 1.0, 20.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("peak {name} is {value}, it must be in {low}..={high}"))
                    .next("correct [extraction] in station.toml"));
            }
        }
        Ok(())
    }
    /// The same settings with the stripe's measured width and speckle.
    pub fn with(self, stripe: &Stripe) -> PeakParams {
        PeakParams { width_px: stripe.width_px, speckle: stripe.speckle, ..self }
    }
}

/// Why a peak is not believed; the low 8 bits of `Peak::flags`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Reject {
    Kept = 0,
    /// Outside the image of the working volume.
    Region = 1,
    /// Too little light.
    Faint = 2,
    /// Narrower than the laser can be: a hot pixel, a glint, or a spot cut by an edge.
    Narrow = 3,
    /// Wider than one stripe: two stripes in one, scattered light.
    Wide = 4,
    /// Its own standard deviation is too large.
    Uncertain = 5,
    /// The stripe runs along the direction of depth.
    Steep = 6,
    /// Much weaker than another peak on the same line across the stripe: a reflection.
    Echo = 7,
    /// No neighbour in the shots before and after: a reflection or a speck.
    Unsupported = 8,
    /// The ray does not meet the laser plane in front of the camera, or the lens model has no ray there.
    NoPoint = 9,
}

impl Reject {
    pub const ALL: [Reject; 10] = [
        Reject::Kept,
        Reject::Region,
        Reject::Faint,
        Reject::Narrow,
        Reject::Wide,
        Reject::Uncertain,
        Reject::Steep,
        Reject::Echo,
        Reject::Unsupported,
        Reject::NoPoint,
    ];
    pub fn words(self) -> &'static str {
        match self {
            Reject::Kept => "kept",
            Reject::Region => "outside the working volume",
            Reject::Faint => "faint",
            Reject::Narrow => "narrow",
            Reject::Wide => "wide",
            Reject::Uncertain => "uncertain",
            Reject::Steep => "steep",
            Reject::Echo => "echo",
            Reject::Unsupported => "unsupported",
            Reject::NoPoint => "no point",
        }
    }
}

/// A bit of `Peak::flags`: at least one pixel of the fit was saturated.
pub const SATURATED: u32 = 1 << 8;

/// One peak, 12 words, the same layout on the GPU.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Peak {
    /// Centre, px.
    pub u: f32,
    pub v: f32,
    /// Unit vector across the stripe; v component positive, or u where v is 0.
    pub normal_u: f32,
    pub normal_v: f32,
    /// Height of the profile above the background, grey levels; may exceed full scale when saturated.
    pub amplitude: f32,
    pub background: f32,
    /// Gaussian sigma of the profile, px.
    pub width_px: f32,
    /// Standard deviation of the centre along the normal, px.
    pub sigma_px: f32,
    /// Amplitude over the noise of a background pixel.
    pub snr: f32,
    /// Low 8 bits: [`Reject`]; bit 8: [`SATURATED`].
    pub flags: u32,
    /// Skeleton pixel, x | y << 16.
    pub pixel: u32,
    pub shot: u32,
}

impl Peak {
    pub fn kept(&self) -> bool {
        self.flags & 0xff == 0
    }
    pub fn reject(&self) -> Reject {
        Reject::ALL[(self.flags & 0xff).min(9) as usize]
    }
    /// Sets the reason, unless one is set already: the first test that fails names it.
    pub fn refuse(&mut self, why: Reject) {
        if self.kept() {
            self.flags |= why as u32;
        }
    }
}

/// Grey levels with the border repeated, as f32.
pub(crate) trait Grey: Copy + Sync {
    fn at(&self, x: i32, y: i32) -> f32;
}

#[derive(Clone, Copy)]
struct View<'a, T> {
    pixels: &'a [T],
    width: i32,
    height: i32,
}

impl<T: Copy + Sync + Into<f32>> Grey for View<'_, T> {
    #[inline(always)]
    fn at(&self, x: i32, y: i32) -> f32 {
        let (x, y) = (x.clamp(0, self.width - 1), y.clamp(0, self.height - 1));
        self.pixels[(y * self.width + x) as usize].into()
    }
}

/// CPU twin: one peak per skeleton pixel, in the order given. `skeleton` is packed x | y << 16, `across` the unit image
/// direction of depth ([`crate::stages::point::Optics::across`]).
pub fn peaks(image: &Image, skeleton: &[u32], shot: u32, p: &PeakParams, across: [f32; 2]) -> Vec<Peak> {
    let size = (image.width, image.height, image.bits);
    let frame = PeakFrame::new(size, 1, p, &ChooseParams::default(), across);
    fitted(image, skeleton, shot, &frame, p.method)
}

/// The same with the sizes worked out before.
pub fn fitted(image: &Image, skeleton: &[u32], shot: u32, frame: &PeakFrame, method: Method) -> Vec<Peak> {
    let (width, height) = (frame.width, frame.height);
    let some = |pixels: &[u32]| match &image.pixels {
        Pixels::U8(px) => each(View { pixels: px, width, height }, pixels, shot, frame, method),
        Pixels::U16(px) => each(View { pixels: px, width, height }, pixels, shot, frame, method),
    };
    skeleton.par_chunks(TOGETHER).flat_map_iter(some).collect()
}

/// Skeleton pixels that a thread takes at least.
const TOGETHER: usize = 256;

/// Compiled for what processors can do; none of it rounds otherwise.
#[multiversion(targets = "simd")]
fn each<G: Grey>(image: G, pixels: &[u32], shot: u32, frame: &PeakFrame, method: Method) -> Vec<Peak> {
    let mut peaks = Vec::with_capacity(pixels.len());
    for &pixel in pixels {
        peaks.push(one(image, pixel, shot, frame, method));
    }
    peaks
}

#[inline(always)]
fn one<G: Grey>(image: G, pixel: u32, shot: u32, frame: &PeakFrame, method: Method) -> Peak {
    let (x, y) = ((pixel & 0xffff) as i32, (pixel >> 16) as i32);
    let peak = match method {
        Method::Gaussian => fit::gaussian(image, x, y, frame),
        Method::Centroid => methods::centroid(image, x, y, frame),
        Method::Derivative => methods::derivative(image, x, y, frame),
        Method::Pixel => methods::pixel(image, x, y, frame),
    };
    Peak { pixel, shot, ..peak }
}
