//! In: the user's settings for neighbours. Out: the settings, checked. Frame and unit: stated at each field.

use crate::fault::{Fault, Result};

/// Support that a point needs. A point on a flat surface has, in each of the two neighbouring shots, a chord of points
/// within the radius. Support is the number of points found over the number expected there.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SupportParams {
    /// Whether points are judged by their neighbours.
    pub on: bool,
    /// Half of the chord on a neighbouring shot's line, 0.0001..=1000 mm: the error of a point that is still
    /// acceptable. A smaller radius removes more points at corners. If not given, it is a 540th of the length that the
    /// picture's longer side covers where the sheet meets the optical axis. The longer side makes it independent of how
    /// the camera is turned.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_mm: Option<f32>,
    /// Distance at which a neighbour may lie, over the distance of the shots, 1..=3; 1.2 is a slope of 33 degrees.
    pub slope: f32,
    /// Support that a peak of the right width needs, 0..=1.
    pub clean: f32,
    /// Support that any other peak needs, 0..=1.
    pub doubtful: f32,
    /// Share of the amplitude, 0..=10, by which the level beside a peak may exceed the shot's usual level. A reflection
    /// lies in the glow of the light that it reflects.
    pub haze: f32,
    /// Support that a peak in such a glow needs, 0..=1.
    pub hazy: f32,
    /// Smallest and largest width of a clean peak, over the stripe's width.
    pub right_width: [f32; 2],
    /// Largest standard deviation of a clean peak's centre over the stripe's sigma, 0.01..=2; other peaks are doubtful.
    pub sure: f32,
    /// Largest width of a peak at a line's end, 1..=3, over the stripe's width and over the shot's usual one.
    pub end_width: f32,
    /// Share of the amplitude, 0..=10, by which the level beside a peak at a line's end may exceed the shot's usual
    /// level.
    pub end_haze: f32,
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
            end_width: 1.35,
            end_haze: 0.03,
        }
    }
}

impl SupportParams {
    /// Refuses values out of their range.
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("radius_mm", self.radius_mm.unwrap_or(1.0), 1e-4, 1e3),
            ("slope", self.slope, 1.0, 3.0),
            ("clean", self.clean, 0.0, 1.0),
            ("doubtful", self.doubtful, 0.0, 1.0),
            ("haze", self.haze, 0.0, 10.0),
            ("hazy", self.hazy, 0.0, 1.0),
            ("sure", self.sure, 0.01, 2.0),
            ("end_width", self.end_width, 1.0, 3.0),
            ("end_haze", self.end_haze, 0.0, 10.0),
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
