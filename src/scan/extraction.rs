//! In: nothing. Out: all settings of the chain from picture to points, one group a step.
//! Frame and unit: stated at each field; sizes are in stripe widths where the physics scales with the stripe.

use super::Format;
use crate::fault::{Fault, Result};
use crate::stages::chain::config::ChainConfig;
use crate::stages::chain::measure::Measure;
use crate::stages::peak::Stripe;
use crate::stages::peak::params::PeakParams;
use crate::stages::stripe::choose_params::ChooseParams;
use crate::stages::stripe::lengthen::LengthenParams;
use crate::stages::stripe::point::Optics;
use crate::stages::stripe::spacing;
use crate::stages::support::params::SupportParams;
use crate::stages::{Thinning, ThresholdParams};

/// The rule that thins the bright pixels to a skeleton.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Chosen by the direction of the stripe.
    #[default]
    Auto,
    /// [`Thinning::ZhangSuen`], whatever the direction.
    ZhangSuen,
    /// [`Thinning::GuoHall`], whatever the direction.
    GuoHall,
}

impl Rule {
    /// The rule for a rig that sees its stripe move in this direction with depth.
    pub fn thinning(self, across: glam::Vec2) -> Thinning {
        match self {
            Rule::Auto => Thinning::across(across),
            Rule::ZhangSuen => Thinning::ZhangSuen,
            Rule::GuoHall => Thinning::GuoHall,
        }
    }
}

/// Settings of the extraction; `[extraction]` in station.toml.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Extraction {
    /// Measure the stripe's width and speckle and the noise of dark pixels in the first shots. They set the
    /// threshold's window and the sizes of the fit, and raise the brightness limits above the noise. Off: the
    /// numbers below are used unchanged.
    pub measure_stripe: bool,
    /// Remove from the cloud the scatter of the reported poses about a smooth path, as far as the surface shows that
    /// the camera did not move so. Such scatter makes lines of a scan lie higher or lower than their neighbours.
    /// Off: every shot lies where its pose was reported.
    pub straighten: bool,
    /// Correct the offset between the light's centre and the middle of a laser sheet of finite thickness. It occurs
    /// where the surface's brightness changes from shot to shot, and is corrected as far as the cloud shows it. Off:
    /// every point lies where the light's centre was.
    pub thick_sheet: bool,
    /// Region of the picture that is searched for the stripe: left, top, right and bottom as shares of its width and
    /// height, 0..=1. It serves to exclude a tool in the view or a place that always shines. Pixel coordinates do
    /// not change.
    pub region: [f64; 4],
    /// Offset and minimum in grey levels of an 8-bit picture; they are scaled for deeper ones.
    pub threshold: ThresholdParams,
    /// The thinning rule; `auto` takes the one for the direction in which the rig's stripe moves with depth
    /// ([`Thinning::across`]).
    pub thinning: Rule,
    /// How far the ends of lines are extended.
    pub lengthen: LengthenParams,
    /// Least distance between two fits across the stripe, in stripe widths (sigma), 0..=6; 0 fits every pixel of the
    /// skeleton. It matters where the stripe is wider than 2 px: its pixels across the stripe find the same centre.
    pub spacing: f32,
    /// Whether bright pixels need others near them ([`spacing::COMPANY`]). Not a setting: it follows from the noise.
    #[serde(skip)]
    pub company: bool,
    /// The sub-pixel fit across the stripe.
    pub peak: PeakParams,
    /// Conditions that a peak must meet to be accepted.
    pub choose: ChooseParams,
    /// How many neighbours a point needs in the shots around it.
    pub support: SupportParams,
}

impl Default for Extraction {
    fn default() -> Extraction {
        Extraction {
            measure_stripe: true,
            straighten: true,
            thick_sheet: true,
            region: WHOLE,
            // A peak fainter than 8 levels is rejected, so darker pixels need not be examined.
            threshold: ThresholdParams { minimum: 8, ..ThresholdParams::default() },
            thinning: Rule::default(),
            lengthen: LengthenParams::default(),
            spacing: 1.5,
            company: false,
            peak: PeakParams::default(),
            choose: ChooseParams::default(),
            support: SupportParams::default(),
        }
    }
}

/// The whole picture.
const WHOLE: [f64; 4] = [0.0, 0.0, 1.0, 1.0];
/// Least width and height of the region, share of the picture; a smaller one is taken for a slip of the mouse.
const LEAST_REGION: f64 = 0.02;

/// Least window of the threshold in stripe sigmas. The stripe fills a sixth of it, so the mean stays that of the
/// surroundings and the stripe's flanks stay above the threshold.
const WINDOW_WIDTHS: f32 = 24.0;
/// Standard deviations of a dark pixel by which light must exceed it. One pixel in 740 of pure noise does, and such
/// specks have no neighbours ([`spacing::COMPANY`]). With 4 instead, a stripe four times as bright as the noise
/// loses half of its points.
const ABOVE_NOISE: f32 = 3.0;
/// From this many standard deviations on, only one dark pixel in 30,000 is taken for light, and bright pixels need
/// no neighbours.
const FREE_OF_SPECKS: f32 = 4.0;

impl Extraction {
    /// The same settings for pictures whose dark pixels scatter by `noise` grey levels of an 8-bit picture:
    /// brightness limits are raised above the noise.
    pub fn in_noise(mut self, noise: f32) -> Extraction {
        let least = (ABOVE_NOISE * noise).round().min(255.0);
        self.threshold.offset = self.threshold.offset.max(least as i32);
        self.threshold.minimum = self.threshold.minimum.max(least as u16);
        self.choose.faintest = self.choose.faintest.max(least);
        self.company = (self.threshold.offset as f32) < FREE_OF_SPECKS * noise;
        if noise > self.peak.read_noise {
            self.peak.read_noise = noise.min(20.0);
        }
        self
    }

    /// The same settings for pictures with such a stripe: sizes of the fit, least window of the threshold, limits
    /// above the noise.
    pub fn for_stripe(self, stripe: &Stripe) -> Extraction {
        let mut e = self.in_noise(stripe.noise);
        let window = (WINDOW_WIDTHS * stripe.width_px) as u32 | 1;
        e.threshold.size = e.threshold.size.max(window.min(101));
        e.peak = e.peak.with(stripe);
        e
    }

    /// The region's pixels at this picture size, those whose centre lies in it: first column, first row, and one
    /// past the last column and row.
    pub fn region_px(&self, format: Format) -> [u32; 4] {
        let edge = |share: f64, size: u32| (share * f64::from(size) - 0.5).ceil().clamp(0.0, f64::from(size)) as u32;
        let ([left, top, right, bottom], (w, h)) = (self.region, (format.width, format.height));
        [edge(left, w), edge(top, h), edge(right, w), edge(bottom, h)]
    }

    /// The settings that a chain is built from; `scan`, `bench` and the peers use the same. Ends of lines are
    /// extended by multiples of `width_px`.
    pub fn chain(&self, format: Format, optics: Optics, width_px: f32) -> ChainConfig {
        let ThresholdParams { offset, minimum, .. } = self.threshold;
        // The settings are grey levels of 8 bits of one exposure; they are scaled to the pictures' depth, and to how
        // much more light their full scale holds.
        let level = f32::from(1u16 << (format.bits - 8)) / self.peak.levels.span;
        let threshold = ThresholdParams {
            offset: (offset as f32 * level).round() as i32,
            minimum: (f32::from(minimum) * level).round().min(65535.0) as u16,
            ..self.threshold
        };
        let company = if self.company { spacing::COMPANY } else { 0 };
        ChainConfig {
            threshold,
            thinning: self.thinning.thinning(optics.across()),
            lengthen: self.lengthen.word(width_px),
            spacing: spacing::word(self.spacing, width_px, optics.across()) | company,
            measure: Some(Measure { peak: self.peak, choose: self.choose, optics }),
            ..ChainConfig::new(format.width, format.height, format.bits)
        }
    }

    /// Refuses settings outside their ranges.
    pub fn check(&self) -> Result<()> {
        let [left, top, right, bottom] = self.region;
        let lies = |low: f64, high: f64| low >= 0.0 && high <= 1.0 && high - low >= LEAST_REGION;
        if !lies(left, right) || !lies(top, bottom) {
            return Err(Fault::usage(format!(
                "the region is {left}, {top} to {right}, {bottom}; left and top come before right and bottom, all of \
                 them in 0..=1, \
                 {LEAST_REGION} apart at least"
            ))
            .next("correct region of [extraction] in station.toml; [0, 0, 1, 1] is the whole picture"));
        }
        self.threshold.check()?;
        if !(-255..=255).contains(&self.threshold.offset) || self.threshold.minimum > 255 {
            return Err(Fault::usage(format!(
                "threshold offset {} and minimum {} are for 8-bit pictures: -255..=255 and 0..=255",
                self.threshold.offset, self.threshold.minimum
            ))
            .next("give them in 8-bit levels; deeper pictures scale them"));
        }
        self.lengthen.check()?;
        if !(0.0..=6.0).contains(&self.spacing) {
            return Err(Fault::usage(format!("spacing is {}; it must be in 0..=6 stripe widths", self.spacing))
                .next("correct [extraction] in station.toml"));
        }
        self.peak.check()?;
        self.choose.check()?;
        self.support.check()
    }
}
