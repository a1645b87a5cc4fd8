//! In: the user's settings for the choice of peaks. Out: the settings, checked. Frame and unit: stated at each field.

use crate::fault::{Fault, Result};

/// Limits that separate peaks of the laser from reflections, glints, hot pixels and mixed spots.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChooseParams {
    /// Least amplitude, 0..=255 grey levels of an 8-bit picture. Below about ten times the read noise, specks are
    /// accepted.
    pub faintest: f32,
    /// Least profile sigma over the stripe's, 0..=1. A hot pixel has 0.4. A face that is tilted towards the laser, or
    /// along the sheet, has 0.6 to 0.8 if the sheet is wider than the lens's blur
    /// (docs/decisions/0020-narrow-stripes.md).
    pub narrowest: f32,
    /// Largest profile sigma over the stripe's, 1..=3. Two stripes that run together have 1.5 and more.
    pub widest: f32,
    /// Profile sigma over the stripe's, 0..=1, below which a peak may be a spot cut by an edge. It then needs an
    /// amplitude of `cut_amplitude`. The rest of a cut spot has lost both width and light, and its centre is off the
    /// sheet's centre by up to a beam radius.
    pub cut_width: f32,
    /// Least amplitude of such a peak over the strongest nearby, 0..=1.
    pub cut_amplitude: f32,
    /// Largest standard deviation of a centre over the stripe's sigma, 0.01..=2.
    pub uncertain: f32,
    /// Largest angle between a stripe and the image of a surface that faces the camera, 0..=90 degrees. Beyond it the
    /// stripe runs along the direction of depth, where walls and reflections of the sheet lie.
    pub steepest_deg: f32,
    /// Least amplitude over the strongest peak on the same line across the stripe, 0..=1. Light that came by way of
    /// another surface has lost most of its power.
    pub echo: f32,
    /// Distance along the stripe within which peaks are compared, stripe sigmas, 0..=100.
    pub echo_reach: f32,
}

impl Default for ChooseParams {
    fn default() -> Self {
        ChooseParams {
            faintest: 8.0,
            narrowest: 0.6,
            widest: 1.7,
            cut_width: 0.88,
            cut_amplitude: 0.4,
            uncertain: 1.0,
            steepest_deg: 70.0,
            echo: 0.12,
            echo_reach: 5.7,
        }
    }
}

impl ChooseParams {
    /// The loosest limits: rejects only peaks that the fit cannot determine.
    pub fn lenient() -> ChooseParams {
        ChooseParams {
            faintest: 0.0,
            narrowest: 0.0,
            widest: 3.0,
            cut_width: 0.0,
            cut_amplitude: 0.0,
            uncertain: 2.0,
            steepest_deg: 90.0,
            echo: 0.0,
            echo_reach: 0.0,
        }
    }
    /// Refuses values out of their range.
    pub fn check(&self) -> Result<()> {
        for (name, value, low, high) in [
            ("faintest", self.faintest, 0.0, 255.0),
            ("narrowest", self.narrowest, 0.0, 1.0),
            ("widest", self.widest, 1.0, 3.0),
            ("cut_width", self.cut_width, 0.0, 1.0),
            ("cut_amplitude", self.cut_amplitude, 0.0, 1.0),
            ("uncertain", self.uncertain, 0.01, 2.0),
            ("steepest_deg", self.steepest_deg, 0.0, 90.0),
            ("echo", self.echo, 0.0, 1.0),
            ("echo_reach", self.echo_reach, 0.0, 100.0),
        ] {
            if !(low..=high).contains(&value) {
                return Err(Fault::usage(format!("choose {name} is {value}, it must be in {low}..={high}"))
                    .next("correct [extraction] in station.toml"));
            }
        }
        Ok(())
    }
}
