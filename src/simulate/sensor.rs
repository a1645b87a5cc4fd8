//! In: nothing. Out: how the simulated camera turns light into grey levels.
//! Frame and unit: grey levels of the sensor's depth; stated at each field.

use crate::fault::{Fault, Result};
use rand::Rng;
use rand_pcg::Pcg64;

/// Conversion of light into grey levels.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensor {
    /// Depth of the grey levels, bits, 8..=16.
    pub bits: u8,
    /// Optical blur, 1 sigma, px, 0.2..=9, for a picture as wide as the rig states; it scales with the width.
    pub blur_px: f64,
    /// Electrons at full scale, 500..=1e6: sets the shot noise.
    pub full_well_e: f64,
    /// Read noise, electrons, 0..=1000.
    pub read_noise_e: f64,
    /// Speckle contrast per pixel, 0..=0.6 (0 = none).
    pub speckle: f64,
    /// Sigma of the blur that makes the speckle's grains, px, 0..=9; 0: each pixel's speckle is independent. For a
    /// diffraction-limited lens it is 0.42 wavelengths times the f-number.
    pub grain_px: f64,
    /// Room light that leaks into laser pictures: grey of a white surface as share of full scale, 0..=0.9.
    pub ambient_leak: f64,
    /// Grey of a white surface in ambient pictures, share of full scale, 0.05..=0.98.
    pub ambient_white: f64,
    /// Peak of the stripe on a white matte surface at the working distance, share of full scale, 0.02..=20.
    pub laser_white: f64,
    /// Hot pixels per million, 0..=10000.
    pub hot_per_million: f64,
}

impl Default for Sensor {
    fn default() -> Self {
        Sensor {
            bits: 8,
            blur_px: 0.75,
            full_well_e: 10_000.0,
            read_noise_e: 20.0,
            speckle: 0.12,
            grain_px: 0.0,
            ambient_leak: 0.01,
            ambient_white: 0.78,
            laser_white: 0.95,
            hot_per_million: 20.0,
        }
    }
}

impl Sensor {
    /// Hot pixels among this number of pixels: index, and extra grey as share of full scale; the same in every
    /// picture.
    pub fn hot_pixels(&self, pixels: usize, rng: &mut Pcg64) -> Vec<(usize, f32)> {
        let count = (self.hot_per_million * pixels as f64 / 1e6).round() as usize;
        (0..count).map(|_| (rng.random_range(0..pixels), rng.random_range(0.02f32..0.5))).collect()
    }

    /// The same sensor with an exposure `times` as long as the one that its levels are stated for.
    #[must_use]
    pub fn exposed(self, times: f64) -> Sensor {
        Sensor {
            ambient_leak: times * self.ambient_leak,
            ambient_white: times * self.ambient_white,
            laser_white: times * self.laser_white,
            ..self
        }
    }

    /// Refuses values outside the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let limits = [
            ("bits", f64::from(self.bits), 8.0, 16.0),
            ("blur_px", self.blur_px, 0.2, 9.0),
            ("full_well_e", self.full_well_e, 500.0, 1e6),
            ("read_noise_e", self.read_noise_e, 0.0, 1000.0),
            ("speckle", self.speckle, 0.0, 0.6),
            ("grain_px", self.grain_px, 0.0, 9.0),
            ("ambient_leak", self.ambient_leak, 0.0, 0.9),
            ("ambient_white", self.ambient_white, 0.05, 0.98),
            ("laser_white", self.laser_white, 0.02, 20.0),
            ("hot_per_million", self.hot_per_million, 0.0, 1e4),
        ];
        match limits.iter().find(|(_, v, low, high)| !(*low..=*high).contains(v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("sensor {name} is {v}, allowed {low}..={high}")).next("correct the option"))
            }
            None => Ok(()),
        }
    }
}
