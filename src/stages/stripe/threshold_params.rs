//! In: the user's settings for lit pixels. Out: the settings, checked. Frame and unit: px, grey levels; stated at each
//! field.

use crate::fault::{Fault, Result};

/// The kind of mean that a pixel is compared with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Window {
    /// Every pixel of the window has the same weight.
    #[default]
    Mean,
    /// Gaussian weights, sigma = 0.3 ((size - 1) / 2 - 1) + 0.8 px; for sizes up to 9 fixed tables such as 1-4-6-4-1
    /// (OpenCV's getGaussianKernel).
    Gaussian,
}

/// A pixel is lit when `value > mean + offset` and `value >= minimum`. The mean over the window is rounded to a whole
/// grey level, and beyond the border the border's pixels repeat. With minimum 0 and an 8-bit picture this is OpenCV's
/// adaptiveThreshold with C = -offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ThresholdParams {
    /// Weights of the window.
    pub window: Window,
    /// Edge of the window, odd, 3..=101 px; with less than three times the stripe's width the stripe becomes hollow.
    pub size: u32,
    /// Amount by which a pixel must exceed the mean, -65535..=65535 grey levels; a larger value finds fewer pixels.
    pub offset: i32,
    /// Absolute minimum, 0..=65535 grey levels. A value above the background's noise makes the search fast and avoids
    /// specks. 0 is off.
    pub minimum: u16,
}

impl Default for ThresholdParams {
    fn default() -> Self {
        ThresholdParams { window: Window::Mean, size: 31, offset: 4, minimum: 7 }
    }
}

impl ThresholdParams {
    /// Refuses values out of their range.
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
