//! In: nothing. Out: what a chain is built for.
//! Frame and unit: px; each field says.

use super::measure::Measure;
use crate::gpu::Device;
use crate::raster::{Image, Mask};
use crate::stages::{Thinning, ThresholdParams};

/// What a chain is built for.
#[derive(Clone, Debug)]
pub struct ChainConfig {
    /// Picture size, px.
    pub width: u32,
    /// Picture size, px.
    pub height: u32,
    /// Depth of the pictures, 8..=16.
    pub bits: u8,
    /// Pictures in one batch, 1..=64; small pictures want many, a dispatch costs as much as 100,000 pixels.
    pub shots: u32,
    /// Batches in flight, 1..=8.
    pub slots: usize,
    /// Which pixels are lit: px, and grey levels of the pictures' depth.
    pub threshold: ThresholdParams,
    /// Which boundary pixels thinning deletes.
    pub thinning: Thinning,
    /// Prove tiles dark before looking at them. Off is the plain path: the same result, slower.
    pub prune: bool,
    /// Pixels that are looked at; `None` for all.
    pub region: Option<Mask>,
    /// Subtracted from every picture.
    pub ambient: Option<Image>,
    /// How far the ends of lines are carried on ([`crate::stages::stripe::lengthen::LengthenParams::word`]); 0 is not
    /// at all.
    pub lengthen: u32,
    /// One fit a crossing of a wide stripe ([`crate::stages::stripe::spacing::word`]), none of what has no company
    /// ([`crate::stages::stripe::spacing::COMPANY`]); 0 is one for every skeleton pixel.
    pub spacing: u32,
    /// Peaks, their choice and points for every skeleton pixel; `None` ends with the pixels.
    pub measure: Option<Measure>,
    /// Take GPU timestamps of every stage.
    pub timed: bool,
}

impl ChainConfig {
    /// Defaults for pictures of `width` x `height` px and 8..=16 bits: 10 million px or 32 shots a batch, no peaks.
    pub fn new(width: u32, height: u32, bits: u8) -> ChainConfig {
        ChainConfig {
            width,
            height,
            bits,
            shots: shots_for(width, height, 10_000_000, 32),
            slots: 3,
            threshold: ThresholdParams::default(),
            thinning: Thinning::default(),
            prune: true,
            region: None,
            ambient: None,
            lengthen: 0,
            spacing: 0,
            measure: None,
            timed: false,
        }
    }
    /// With the batch that hides the fixed cost on this device: one with memory of its own has more processors to
    /// keep busy, and a dispatch of any size takes it as long as 400,000 pixels. All three batches need less than a
    /// gigabyte.
    pub fn on(self, device: &Device) -> ChainConfig {
        if !device.info.unified_memory {
            return ChainConfig { shots: shots_for(self.width, self.height, 40_000_000, 64), ..self };
        }
        self
    }
}

/// Shots of a batch of about so many pixels.
pub fn shots_for(width: u32, height: u32, pixels: u32, most: u32) -> u32 {
    (pixels / width.saturating_mul(height).max(1)).clamp(1, most)
}
