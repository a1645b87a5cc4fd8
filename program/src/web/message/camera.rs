//! In: nothing. Out: a camera's settings and measures of its pictures, as pages see them.
//! Frame and unit: features by their standard names (ExposureTime in us); px; fractions of full scale and of the
//! stripe's length.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::capture::{Feature, Look, Range, Value, WANTED};
use ts_rs::TS;

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct CameraState {
    /// Its settings; empty if it has none, or while it is not connected.
    pub features: Vec<CameraFeature>,
}

/// One setting of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct CameraFeature {
    /// Name of the feature by the standard naming convention.
    pub name: String,
    /// Current value; null if it cannot be read.
    #[ts(type = "number | boolean | string | null")]
    pub value: Option<serde_json::Value>,
    /// us, dB, px, Hz; empty if it has none.
    pub unit: String,
    /// Lowest and highest value; null: unknown.
    pub range: Option<[f64; 2]>,
    /// The allowed values; empty if the feature is not an enumeration.
    pub words: Vec<String>,
    /// Whether it can be set now.
    pub writable: bool,
}

impl From<&Feature> for CameraFeature {
    fn from(f: &Feature) -> CameraFeature {
        let value = f.value.as_ref().filter(|v| **v != Value::Command);
        CameraFeature {
            name: f.name.clone(),
            value: value.and_then(|v| serde_json::to_value(v).ok()),
            unit: f.unit.clone(),
            range: if let Range::Between(low, high) = f.range { Some([low, high]) } else { None },
            words: if let Range::OneOf(words) = &f.range { words.clone() } else { Vec::new() },
            writable: f.writable && f.value != Some(Value::Command),
        }
    }
}

/// A setting to change.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetFeature {
    /// Name of the feature by the standard naming convention, e.g. ExposureTime.
    pub name: String,
    /// The value as text.
    pub value: String,
}

/// Measures of a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct PictureLook {
    /// Lowest, median, 99th percentile and highest grey level.
    pub levels: [u16; 4],
    /// Fraction of saturated pixels.
    pub saturated: f64,
    /// Null if no stripe is visible.
    pub stripe: Option<StripeSeen>,
}

/// Measures of a stripe across its direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct StripeSeen {
    /// The stripe is horizontal, so it is measured column by column.
    pub lying: bool,
    /// Level that 5 % of its peaks exceed, fraction of full scale.
    pub peak: f64,
    /// Range in which `peak` should lie.
    pub wanted: [f64; 2],
    /// Fraction of its peaks that are saturated.
    pub saturated: f64,
    /// Full width at half maximum, px, median.
    pub width_px: f64,
    /// Its peak relative to the level beside it, median.
    pub contrast: f64,
    /// Fraction of the lines without a stripe.
    pub dark: f64,
    /// The exposure is right.
    pub right: bool,
    /// The same for pieces along the stripe, from the left or the top: peak, width in px, contrast, dark fraction.
    /// The first three are 0 where the stripe is dark.
    pub pieces: Vec<[f64; 4]>,
}

impl From<&Look> for PictureLook {
    fn from(look: &Look) -> PictureLook {
        let stripe = look.stripe.as_ref().map(|s| StripeSeen {
            lying: s.lying,
            peak: s.peak,
            wanted: WANTED,
            saturated: s.saturated,
            width_px: s.width_px,
            contrast: s.contrast,
            dark: s.dark,
            right: look.right(),
            pieces: s.pieces.iter().map(|p| [p.peak, p.width_px, p.contrast, p.dark]).collect(),
        });
        PictureLook { levels: look.levels, saturated: look.saturated, stripe }
    }
}

/// Result of the automatic exposure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct ExposureSet {
    /// The exposure that was set, us.
    pub exposure_us: f64,
    /// Exposures tried: us, and the level of the stripe's peaks, fraction of full scale; null: no stripe.
    pub tried: Vec<(f64, Option<f64>)>,
    /// Measures of the pictures now.
    pub look: PictureLook,
    /// If no exposure is quite right: why this one is the best.
    pub remark: Option<String>,
}
