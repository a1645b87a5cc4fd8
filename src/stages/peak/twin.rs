//! In: a picture, its skeleton. Out: the peaks, by the arithmetic of peak.wgsl.
//! Frame and unit: px, grey levels.

use super::found::Peak;
use super::frame::PeakFrame;
use super::grey::{Grey, Place, View};
use super::lanes::LANES;
use super::params::{Method, PeakParams};
use super::profile::Profiles;
use super::{fit, methods};
use crate::raster::{Image, Pixels};
use crate::stages::stripe::choose_params::ChooseParams;
use multiversion::multiversion;
use rayon::prelude::*;

/// CPU twin: one peak per skeleton pixel, in the order given. `skeleton` is packed x | y << 16, `across` the unit image
/// direction of depth ([`crate::stages::stripe::point::Optics::across`]).
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
pub const TOGETHER: usize = 256;

/// Compiled for what processors can do; none of it rounds otherwise.
#[multiversion(targets = "simd")]
pub fn each<G: Grey>(image: G, pixels: &[u32], shot: u32, frame: &PeakFrame, method: Method) -> Vec<Peak> {
    let mut peaks = Vec::with_capacity(pixels.len());
    let mut profiles = Profiles::new(frame);
    for some in pixels.chunks(LANES) {
        let mut places = [Place { image, pixel: 0, shot }; LANES];
        places.iter_mut().zip(some).for_each(|(place, &pixel)| place.pixel = pixel);
        measured(&places[..some.len()], &mut profiles, frame, method, |peak| peaks.push(peak));
    }
    peaks
}

/// The peaks of up to [`LANES`] places, in their order; `profiles` is memory that is used again.
#[inline(always)]
pub(super) fn measured<G: Grey>(
    places: &[Place<G>],
    profiles: &mut Profiles,
    frame: &PeakFrame,
    method: Method,
    take: impl FnMut(Peak),
) {
    match method {
        Method::Gaussian => fit::gaussians(places, profiles, frame, take),
        Method::Centroid => methods::centroids(places, profiles, frame, take),
        Method::Derivative => methods::derivatives(places, profiles, frame, take),
        Method::Pixel => places.iter().map(|place| methods::pixel(place, frame)).for_each(take),
    }
}
