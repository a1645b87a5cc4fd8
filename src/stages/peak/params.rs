//! In: the user's settings for peaks. Out: the settings, checked. Frame and unit: px, grey levels; stated at each
//! field.

use crate::fault::{Fault, Result};
use crate::raster::Levels;

/// Method for finding the centre across the stripe.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Maximum likelihood of a Gaussian profile under shot, read and speckle noise; the most accurate.
    #[default]
    Gaussian,
    /// Centre of gravity above the background; fast, but biased by any other light in the window.
    Centroid,
    /// Zero of the derivative of the Gaussian-smoothed profile (\[steger98\]).
    Derivative,
    /// The skeleton pixel itself, as in the paper that this program rebuilds: for comparisons.
    Pixel,
}

impl Method {
    /// All methods in the order of their numbers.
    pub const ALL: [Method; 4] = [Method::Gaussian, Method::Centroid, Method::Derivative, Method::Pixel];
}

/// Settings of the sub-pixel step. The stripe's width and speckle are properties of laser and lens: [`super::measure`]
/// measures them on the first shots.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PeakParams {
    /// How the centre is found.
    pub method: Method,
    /// Gaussian sigma of the stripe's profile, px, 0.4..=12. All windows follow from it. Laser waist, lens blur and
    /// magnification determine it, and it scales with the resolution.
    pub width_px: f32,
    /// Speckle contrast of one pixel, 0..=1: standard deviation over mean of coherent light. 0 means a stripe without
    /// speckle; a larger value gives more weight to the flanks and less to the top.
    pub speckle: f32,
    /// Factor by which a centre scatters more with speckle of large grains than with speckle of single pixels, 1..=20;
    /// measured on the first shots.
    #[serde(skip, default = "one")]
    pub grain: f32,
    /// The pictures' levels in terms of those of one exposure, which all levels here are. Not a setting: it follows
    /// from the exposures that the pictures were merged from.
    #[serde(skip)]
    pub levels: Levels,
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
            grain: 1.0,
            levels: Levels::default(),
            read_noise: 0.7,
            gain: 0.05,
            along: 1.0,
            steps: 8,
        }
    }
}

impl PeakParams {
    /// Refuses values out of their range.
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
    /// The same settings with the stripe's measured width, speckle and noise.
    pub fn with(self, stripe: &Stripe) -> PeakParams {
        let (read_noise, gain) = (stripe.read_noise.unwrap_or(self.read_noise), stripe.gain.unwrap_or(self.gain));
        PeakParams {
            width_px: stripe.width_px,
            speckle: stripe.speckle,
            grain: stripe.grain_factor,
            read_noise,
            gain,
            ..self
        }
    }
}

/// The stripe as laser, lens and sensor show it: constant over a scan.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stripe {
    /// Gaussian sigma of the profile, px.
    pub width_px: f32,
    /// Standard deviation over mean of the stripe's light from pixel to pixel.
    pub speckle: f32,
    /// Sigma of the blur that makes the speckle's grains, px; 0 if the speckle of all pixels is independent.
    #[serde(default)]
    pub grain_px: f32,
    /// Factor by which a centre scatters more with such speckle than with speckle of single pixels; 1 if it is of
    /// single pixels.
    #[serde(default = "one")]
    pub grain_factor: f32,
    /// Standard deviation of a dark pixel, grey levels of an 8-bit picture; 0 if it is unknown.
    #[serde(default)]
    pub noise: f32,
    /// Read noise as in [`PeakParams`]. `None` if it was not measured: the settings apply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub read_noise: Option<f32>,
    /// Shot noise, grey levels (8-bit) per photo-electron, as [`PeakParams::gain`]. `None` if it was not measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<f32>,
}

fn one() -> f32 {
    1.0
}

impl Default for Stripe {
    fn default() -> Stripe {
        Stripe {
            width_px: 0.0,
            speckle: 0.0,
            grain_px: 0.0,
            grain_factor: 1.0,
            noise: 0.0,
            read_noise: None,
            gain: None,
        }
    }
}

/// Most samples of a profile: as many as the shader has unrolled.
pub(super) const SAMPLES: usize = 40;
