//! In: a user's settings for the ball calibration. Out: the checked settings.
//! Frame and unit: mm.

use crate::calibrate::profile_sensor::missing::Heights;
use crate::calibrate::profile_sensor::ranges::in_ranges;
use crate::fault::Result;

/// On which side of the profile plane (y = 0 of the sensor) the ball's centre lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// At y > 0 of the sensor.
    Plus,
    /// At y < 0 of the sensor.
    Minus,
}

impl std::str::FromStr for Side {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Side, String> {
        match s {
            "plus" | "+y" => Ok(Side::Plus),
            "minus" | "-y" => Ok(Side::Minus),
            _ => Err(format!("unknown side '{s}': plus (the ball's centre at y > 0 of the sensor) or minus")),
        }
    }
}

/// Settings of [`super::solve::solve`].
#[derive(Clone, Debug)]
pub struct BallOptions {
    /// The ball's diameter, mm; 1..=1000.
    pub diameter: f64,
    /// The side of the profile plane on which the ball lies in every profile; `None`: determined from the data.
    pub side: Option<Side>,
    /// A point farther than this from the circle of its profile is not on the ball, mm; 0.001..=10.
    pub gate_mm: f64,
    /// A profile counts as wrong if its squared Mahalanobis distance (3 degrees of freedom) exceeds this; 12..=1000.
    pub gate: f64,
    /// The other side must fit worse by this many units of squared Mahalanobis distance; 9..=1000.
    pub clear: f64,
    /// Smallest number of profiles; 6..=1000.
    pub min_profiles: usize,
    /// Random seed; the same seed gives the same result.
    pub seed: u64,
    /// What is stated about z.
    pub heights: Heights,
}

impl BallOptions {
    /// The defaults for a ball of this diameter, mm.
    pub fn new(diameter: f64) -> BallOptions {
        BallOptions {
            diameter,
            side: None,
            gate_mm: 0.3,
            gate: 21.0,
            clear: 25.0,
            min_profiles: 8,
            seed: 1,
            heights: Heights::default(),
        }
    }
    /// Refuses values outside the ranges stated at the fields.
    pub fn check(&self) -> Result<()> {
        in_ranges(&[
            ("diameter", self.diameter, 1.0, 1000.0),
            ("gate_mm", self.gate_mm, 0.001, 10.0),
            ("gate", self.gate, 12.0, 1000.0),
            ("clear", self.clear, 9.0, 1000.0),
            ("min_profiles", self.min_profiles as f64, 6.0, 1000.0),
        ])
    }
}
