//! In: nothing. Out: all settings of the way from picture to points, one group a step.
//! Frame and unit: each field says; sizes are in stripe widths where the physics scales with the stripe.

use crate::fault::Result;
use crate::stages::choose::ChooseParams;
use crate::stages::lengthen::LengthenParams;
use crate::stages::peak::PeakParams;
use crate::stages::support::SupportParams;
use crate::stages::{Thinning, ThresholdParams};

/// Settings of the extraction; `[extraction]` in station.toml.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Extraction {
    /// Measure the stripe's width and speckle in the first shots and take the window of the threshold
    /// and the sizes of the fit from them. Off: the numbers below are used as they stand.
    pub measure_stripe: bool,
    pub threshold: ThresholdParams,
    pub thinning: Thinning,
    pub lengthen: LengthenParams,
    pub peak: PeakParams,
    pub choose: ChooseParams,
    pub support: SupportParams,
}

impl Default for Extraction {
    fn default() -> Extraction {
        Extraction {
            measure_stripe: true,
            threshold: ThresholdParams::default(),
            thinning: Thinning::default(),
            lengthen: LengthenParams::default(),
            peak: PeakParams::default(),
            choose: ChooseParams::default(),
            support: SupportParams::default(),
        }
    }
}

impl Extraction {
    pub fn check(&self) -> Result<()> {
        self.threshold.check()?;
        self.lengthen.check()?;
        self.peak.check()?;
        self.choose.check()?;
        self.support.check()
    }
}
