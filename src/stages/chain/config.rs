//! In: nothing. Out: the settings that a chain is built for. Frame and unit: px; stated at each field.

use super::measure::Measure;
use crate::gpu::Device;
use crate::raster::{Image, Mask};
use crate::stages::{Thinning, ThresholdParams};

/// Settings of a chain.
#[derive(Clone, Debug)]
pub struct ChainConfig {
    /// Picture width, px.
    pub width: u32,
    /// Picture height, px.
    pub height: u32,
    /// Depth of the pictures, 8..=16.
    pub bits: u8,
    /// Pictures in one batch, 1..=64. Small pictures need many, because a dispatch costs as much as 100,000 pixels.
    pub shots: u32,
    /// Batches in flight, 1..=8.
    pub slots: usize,
    /// Limits of lit pixels: px, and grey levels of the pictures' depth.
    pub threshold: ThresholdParams,
    /// The rule by which thinning deletes boundary pixels.
    pub thinning: Thinning,
    /// Whether tiles are proven dark first, and then skipped. Off is the plain path: the same result, but slower.
    pub prune: bool,
    /// Pixels that are evaluated; `None` for all.
    pub region: Option<Mask>,
    /// Picture of the ambient light, which is subtracted from every picture.
    pub ambient: Option<Image>,
    /// How far the ends of lines are lengthened ([`crate::stages::stripe::lengthen::LengthenParams::word`]); 0 is off.
    pub lengthen: u32,
    /// One fit for each column of a wide stripe ([`crate::stages::stripe::spacing::word`]), and none for isolated lit
    /// pixels ([`crate::stages::stripe::spacing::COMPANY`]). 0 fits every skeleton pixel.
    pub spacing: u32,
    /// Settings of peaks, their choice and points for every skeleton pixel. `None`: the chain ends with the pixels.
    pub measure: Option<Measure>,
    /// Whether GPU timestamps of every stage are taken.
    pub timed: bool,
}

impl ChainConfig {
    /// Defaults for pictures of `width` x `height` px and 8..=16 bits: batches of 10 million px or 32 shots, no peaks.
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
    /// The same with a batch that is large enough to hide the fixed cost on this device. A device with its own memory
    /// has more processors to keep busy, and any dispatch takes it as long as 400,000 pixels. The three batches in
    /// flight need less than a gigabyte.
    pub fn on(self, device: &Device) -> ChainConfig {
        if !device.info.unified_memory {
            return ChainConfig { shots: shots_for(self.width, self.height, 40_000_000, 64), ..self };
        }
        self
    }
}

/// Number of shots in a batch of about `pixels` pixels, 1..=`most`.
pub fn shots_for(width: u32, height: u32, pixels: u32, most: u32) -> u32 {
    (pixels / width.saturating_mul(height).max(1)).clamp(1, most)
}
