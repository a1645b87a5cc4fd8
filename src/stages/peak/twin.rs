//! In: a picture, its skeleton. Out: the peaks, with the arithmetic of peak.wgsl. Frame and unit: px, grey levels.

use super::found::Peak;
use super::frame::PeakFrame;
use super::grey::{Grey, Place, View};
use super::lanes::LANES;
use super::params::{Method, PeakParams};
use super::profile::Profiles;
use super::{fit, methods};
use crate::raster::{Image, Pixels};
use crate::stages::stripe::choose_params::ChooseParams;
use glam::Vec2;
use multiversion::multiversion;
use rayon::prelude::*;

/// CPU twin: one peak per skeleton pixel, in the order given. `skeleton` is packed x | y << 16, `across` the unit image
/// direction of depth ([`crate::stages::stripe::point::Optics::across`]).
pub fn peaks(image: &Image, skeleton: &[u32], shot: u32, p: &PeakParams, across: Vec2) -> Vec<Peak> {
    let size = (image.width, image.height, image.bits);
    let frame = PeakFrame::new(size, 1, p, &ChooseParams::default(), across);
    fitted(image, skeleton, shot, &frame, p.method)
}

/// The same with a frame that was computed before.
pub fn fitted(image: &Image, skeleton: &[u32], shot: u32, frame: &PeakFrame, method: Method) -> Vec<Peak> {
    let (width, height) = (frame.width, frame.height);
    let some = |pixels: &[u32]| match &image.pixels {
        Pixels::U8(px) => each(View { pixels: px, width, height }, pixels, shot, frame, method),
        Pixels::U16(px) => each(View { pixels: px, width, height }, pixels, shot, frame, method),
    };
    skeleton.par_chunks(TOGETHER).flat_map_iter(some).collect()
}

/// Least number of skeleton pixels for a thread: few enough that all threads finish together on a small picture.
pub const TOGETHER: usize = 64;

/// Compiled for several instruction sets; all of them round in the same way.
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

/// The peaks of up to [`LANES`] places, in their order; `profiles` is reused memory.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stages::cases::stripe;

    /// Neither the profiles in neighbouring lanes nor earlier ones influence a profile. Tried with places all over a
    /// stripe, also at the picture's borders, wide and narrow, each alone and with its seven neighbours in the list.
    #[test]
    fn a_profile_among_others_comes_to_the_bits_that_it_comes_to_alone() {
        for (width, method) in [0.8, 2.5, 7.0].into_iter().flat_map(|w| Method::ALL.map(|m| (w, m))) {
            let image = stripe(160, 120, 8, width, 5, 4);
            let places: Vec<u32> = (0..160).map(|x| x | (x * 7 % 120) << 16).collect();
            let params = PeakParams { width_px: width as f32, method, ..PeakParams::default() };
            let together = peaks(&image, &places, 3, &params, Vec2::new(0.1, 0.99));
            assert_eq!(together.len(), places.len());
            for (place, seen) in places.iter().zip(&together) {
                let alone = peaks(&image, std::slice::from_ref(place), 3, &params, Vec2::new(0.1, 0.99));
                let bits = |peak: &Peak| bytemuck::cast::<Peak, [u32; 12]>(*peak);
                assert_eq!(bits(&alone[0]), bits(seen), "{method:?}, {width} px, {place:x}");
            }
        }
    }
}
