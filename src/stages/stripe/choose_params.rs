//! In: what a person may choose about peaks. Out: the choice, checked.
//! Frame and unit: each field says.

use crate::fault::{Fault, Result};

/// What a peak of the laser looks like, against reflections, glints, hot pixels and mixed spots.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChooseParams {
    /// Least amplitude, 0..=255 grey levels of an 8-bit picture; below about ten times the read noise specks survive.
    pub faintest: f32,
    /// Least profile sigma over the stripe's, 0..=1. A hot pixel has 0.4; a face that is tilted towards the laser, or
    /// along the sheet, 0.6 to 0.8 where the sheet is wider than the lens's blur
    /// (docs/decisions/0020-narrow-stripes.md).
    pub narrowest: f32,
    /// Largest profile sigma over the stripe's, 1..=3. Two stripes that run together have 1.5 and more.
    pub widest: f32,
    /// Profile sigma over the stripe's, 0..=1, below which a peak may be a spot cut by an edge; and the amplitude over
    /// the strongest nearby, 0..=1, that it then needs. What is left of a cut spot has lost width and light at once,
    /// and its centre is off the sheet's centre by up to a beam radius.
    pub cut_width: f32,
    /// That amplitude over the strongest nearby, 0..=1.
    pub cut_amplitude: f32,
    /// Largest standard deviation of a centre over the stripe's sigma, 0.01..=2.
    pub uncertain: f32,
    /// Largest angle between a stripe and the image of a surface that faces the camera, 0..=90 degrees. Beyond it the
    /// stripe runs along the direction of depth, where walls and reflections of the sheet lie.
    pub steepest_deg: f32,
    /// Least amplitude over the strongest peak on the same line across the stripe, 0..=1: light that comes by way of
    /// another surface has lost most of its power.
    pub echo: f32,
    /// How far along the stripe that line reaches, stripe sigmas, 0..=100.
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
    /// Refuses nothing but what the fit itself cannot place.
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
    /// Refuses what is out of its range.
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
