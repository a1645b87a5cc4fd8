//! In: what a person may choose about neighbours. Out: the choice, checked.
//! Frame and unit: each field says.

use crate::fault::{Fault, Result};

/// How much of a neighbourhood a point needs. A point on a flat surface has, in each of the two neighbouring shots, a
/// chord of points within the radius; support is the number found over the number expected there.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SupportParams {
    /// Whether points are judged by their neighbours at all.
    pub on: bool,
    /// Half of the chord on a neighbouring shot's line, 0.0001..=1000 mm: what a point may be wrong by and still be
    /// useful; smaller removes more at corners. Unless given a 540th of what the picture's longer side sees where the
    /// sheet meets the optical axis: a camera that is turned sees the same.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f32>,
    /// How much farther than the distance of the shots a neighbour may lie, 1..=3; 1.2 is a slope of 33 degrees.
    pub slope: f32,
    /// Support that a peak of the right width needs, 0..=1.
    pub clean: f32,
    /// Support that any other peak needs, 0..=1.
    pub doubtful: f32,
    /// Share of the amplitude, 0..=10, by which the level beside a peak may exceed the shot's usual level there.
    /// A reflection lies in the glow of what it reflects.
    pub haze: f32,
    /// Support that a peak in such a glow needs, 0..=1.
    pub hazy: f32,
    /// Widths over the stripe's that count as right.
    pub right_width: [f32; 2],
    /// Largest standard deviation of a clean peak's centre over the stripe's sigma, 0.01..=2; others are doubtful.
    pub sure: f32,
}

impl Default for SupportParams {
    fn default() -> Self {
        SupportParams {
            on: true,
            radius_mm: None,
            slope: 1.2,
            clean: 0.1,
            doubtful: 0.3,
            haze: 0.05,
            hazy: 0.7,
            right_width: [0.88, 1.22],
            sure: 0.43,
        }
    }
}

impl SupportParams {
    /// Refuses what is out of its range.
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("radius_mm", self.radius_mm.unwrap_or(1.0), 1e-4, 1e3),
            ("slope", self.slope, 1.0, 3.0),
            ("clean", self.clean, 0.0, 1.0),
            ("doubtful", self.doubtful, 0.0, 1.0),
            ("haze", self.haze, 0.0, 10.0),
            ("hazy", self.hazy, 0.0, 1.0),
            ("sure", self.sure, 0.01, 2.0),
            ("right_width[0]", self.right_width[0], 0.0, 1.0),
            ("right_width[1]", self.right_width[1], 1.0, 3.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("support {name} is {value}, it must be in {low}..={high}"))
                    .next("correct [extraction] in station.toml"));
            }
        }
        Ok(())
    }
}
