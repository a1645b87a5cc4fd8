//! In: pictures in order. Out: their peaks, chosen, in the same order; on the GPU, or on the CPU twins.
//! Frame and unit: pixels; grey levels.

use super::{Extraction, Format, Where};
use crate::camera::Intrinsics;
use crate::fault::Result;
use crate::geometry::{Camera, Plane};
use crate::raster::{Image, Mask};
use crate::stages::choose::{self, Scene};
use crate::stages::peak::{self, Peak, Stripe};
use crate::stages::point::{Optics, plane_in_view};
use crate::stages::{lengthen, skeleton, thin, threshold};
use rayon::prelude::*;

/// The peaks of one shot.
pub struct Measured {
    pub shot: u32,
    pub peaks: Vec<Peak>,
}

/// What the engine needs to know of the rig: where in the picture the laser can be.
pub struct Optical {
    pub camera: Intrinsics,
    pub laser: Plane<Camera>,
    /// Nearest and farthest camera depth believed, mm.
    pub depth_mm: [f64; 2],
}

/// The per-pixel work.
pub struct Engine {
    format: Format,
    region: Mask,
    across: [f32; 2],
    extraction: Extraction,
    width_px: f32,
    pending: Vec<(u32, Image)>,
}

/// Least window of the threshold in stripe sigmas: the stripe fills a sixth of it, so the mean stays that
/// of the surroundings and the flanks stay lit.
const WINDOW_WIDTHS: f32 = 24.0;
/// Shots worked on together.
const BATCH: usize = 4;

impl Engine {
    pub fn new(format: Format, optical: &Optical, extraction: &Extraction, _place: Where) -> Result<Engine> {
        Ok(Engine {
            format,
            region: region(format, optical),
            across: Optics::new(&optical.camera, &optical.laser).across(),
            extraction: extraction.clone(),
            width_px: extraction.peak.width_px,
            pending: Vec::new(),
        })
    }

    pub fn ran_on(&self) -> String {
        "CPU twins".into()
    }

    /// Width and speckle of the stripe, the median over some pictures; `None` where none shows enough of it.
    pub fn measure(&self, images: &[&Image]) -> Result<Option<Stripe>> {
        let mut found: Vec<Stripe> = images
            .par_iter()
            .filter_map(|image| peak::measure(image, &self.skeleton(image).1, &self.extraction.peak))
            .collect();
        if found.is_empty() {
            return Ok(None);
        }
        let middle = found.len() / 2;
        let width_px =
            *found.iter().map(|s| s.width_px).collect::<Vec<_>>().select_nth_unstable_by(middle, f32::total_cmp).1;
        found.sort_by(|a, b| a.speckle.total_cmp(&b.speckle));
        Ok(Some(Stripe { width_px, speckle: found[middle].speckle }))
    }

    /// Takes over a measured stripe: the sizes of the fit, and the least window of the threshold.
    pub fn set_stripe(&mut self, stripe: &Stripe) -> Result<()> {
        self.width_px = stripe.width_px;
        let window = (WINDOW_WIDTHS * stripe.width_px) as u32 | 1;
        self.extraction.threshold.size = self.extraction.threshold.size.max(window.min(101));
        self.extraction.peak = self.extraction.peak.with(stripe);
        self.extraction.peak.check()
    }

    pub fn submit(&mut self, shot: u32, image: &Image) -> Result<()> {
        self.pending.push((shot, image.clone()));
        Ok(())
    }

    pub fn collect(&mut self, all: bool) -> Result<Vec<Measured>> {
        if !all && self.pending.len() < BATCH {
            return Ok(Vec::new());
        }
        let batch = std::mem::take(&mut self.pending);
        Ok(batch.par_iter().map(|(shot, image)| Measured { shot: *shot, peaks: self.peaks(*shot, image) }).collect())
    }

    fn skeleton(&self, image: &Image) -> (Mask, Vec<u32>) {
        let mut lit = threshold::twin(image, &self.extraction.threshold);
        lit.words.iter_mut().zip(&self.region.words).for_each(|(l, r)| *l &= r);
        let thin = thin::twin(&lit, self.extraction.thinning);
        let long = lengthen::twin(image, &lit, &thin, self.width_px, &self.extraction.lengthen);
        let list = skeleton::twin(&long);
        (lit, list)
    }

    fn peaks(&self, shot: u32, image: &Image) -> Vec<Peak> {
        let (_, list) = self.skeleton(image);
        let mut peaks = peak::peaks(image, &list, shot, &self.extraction.peak);
        let scene = Scene {
            width: self.format.width,
            height: self.format.height,
            full_scale: f32::from(image.full_scale()),
            width_px: self.width_px,
            across: self.across,
        };
        choose::choose(&mut peaks, &scene, &self.extraction.choose);
        peaks
    }
}

/// Pixels at which the laser plane lies within the believed depths; others are neither processed nor believed.
fn region(format: Format, o: &Optical) -> Mask {
    Mask::from_fn(format.width, format.height, |x, y| {
        plane_in_view(&o.camera, &o.laser, x, y).is_some_and(|z| (o.depth_mm[0]..=o.depth_mm[1]).contains(&z))
    })
}
