//! In: a user's settings for the calibration on a plate. Out: the checked settings.
//! Frame and unit: mm.

use crate::calibrate::profile_sensor::missing::Heights;
use crate::calibrate::profile_sensor::ranges::in_ranges;
use crate::fault::Result;

/// Settings of [`super::solve::solve`].
#[derive(Clone, Debug)]
pub struct PlaneOptions {
    /// A point farther than this from the line of its profile is not on the plate, mm; 0.001..=10.
    pub gate_mm: f64,
    /// A profile counts as wrong if its squared Mahalanobis distance (2 degrees of freedom) exceeds this; 12..=1000.
    pub gate: f64,
    /// Another solution must fit worse by this many units of squared Mahalanobis distance; 9..=1000.
    pub clear: f64,
    /// Smallest number of profiles; 6..=1000.
    pub min_profiles: usize,
    /// Random seed; the same seed gives the same result.
    pub seed: u64,
    /// What is stated about z.
    pub heights: Heights,
}

impl Default for PlaneOptions {
    fn default() -> PlaneOptions {
        // A right profile exceeds 18 with 2 degrees of freedom once in 8000.
        PlaneOptions { gate_mm: 0.3, gate: 18.0, clear: 25.0, min_profiles: 8, seed: 1, heights: Heights::default() }
    }
}

impl PlaneOptions {
    /// Refuses values outside the ranges stated at the fields.
    pub fn check(&self) -> Result<()> {
        in_ranges(&[
            ("gate_mm", self.gate_mm, 0.001, 10.0),
            ("gate", self.gate, 12.0, 1000.0),
            ("clear", self.clear, 9.0, 1000.0),
            ("min_profiles", self.min_profiles as f64, 6.0, 1000.0),
        ])
    }
}
