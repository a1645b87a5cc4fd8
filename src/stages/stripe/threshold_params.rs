//! In: what a person may choose about lit pixels. Out: the choice, checked.
//! Frame and unit: px, grey levels; each field says.

use crate::fault::{Fault, Result};

/// The mean that a pixel is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Window {
    /// Every pixel of the window counts the same.
    #[default]
    Mean,
    /// Gaussian weights, sigma = 0.3 ((size - 1) / 2 - 1) + 0.8 px; the published 1-4-6-4-1 like
    /// tables for sizes up to 9 (OpenCV's getGaussianKernel).
    Gaussian,
}

/// A pixel is lit when `value > mean + offset` and `value >= minimum`; the mean over the window is
/// rounded to a whole grey level and pixels beyond the border repeat the border's. With minimum 0
/// and an 8-bit picture this is OpenCV's adaptiveThreshold with C = -offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThresholdParams {
    /// Weights of the window.
    pub window: Window,
    /// Edge of the window, odd, 3..=101 px; at least three times the stripe's width, or the stripe hollows out.
    pub size: u32,
    /// How far above the mean a pixel must be, -65535..=65535 grey levels; larger finds less.
    pub offset: i32,
    /// Absolute minimum, 0..=65535 grey levels; above the background's noise it makes the search fast
    /// and free of specks. 0 is off.
    pub minimum: u16,
}

impl Default for ThresholdParams {
    fn default() -> Self {
        ThresholdParams { window: Window::Mean, size: 31, offset: 4, minimum: 7 }
    }
}

impl ThresholdParams {
    /// Refuses what is out of its range.
    pub fn check(&self) -> Result<()> {
        if self.size.is_multiple_of(2) || !(3..=101).contains(&self.size) {
            return Err(Fault::usage(format!("threshold size is {}, it must be odd and in 3..=101 px", self.size))
                .next("choose an odd window about five times as wide as the stripe, e.g. 31"));
        }
        if !(-65535..=65535).contains(&self.offset) {
            return Err(Fault::usage(format!(
                "threshold offset is {}, it must be in -65535..=65535 grey levels",
                self.offset
            ))
            .next("correct [extraction.threshold] in station.toml"));
        }
        Ok(())
    }
}
