//! In: nothing. Out: a camera's settings and what its pictures show, as pages see them.
//! Frame and unit: features by their standard names (ExposureTime in us); px; shares of full scale and of the
//! stripe's length.

use crate::capture::{Feature, Look, Range, Value, WANTED};
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct CameraState {
    /// What it can be set to; empty where nothing can, or while it is not there.
    pub features: Vec<CameraFeature>,
}

/// One setting of a camera.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct CameraFeature {
    /// By the naming convention.
    pub name: String,
    /// What it is; null where it cannot be read.
    #[ts(type = "number | boolean | string | null")]
    pub value: Option<serde_json::Value>,
    /// us, dB, px, Hz; empty where it has none.
    pub unit: String,
    /// Lowest and highest; null: none that is known.
    pub range: Option<[f64; 2]>,
    /// One of these; empty: not a list.
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

/// A setting to be made.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct SetFeature {
    /// By the naming convention, e.g. ExposureTime.
    pub name: String,
    /// As text.
    pub value: String,
}

/// What a picture shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct PictureLook {
    /// Lowest, median, 99th percentile, highest level.
    pub levels: [u16; 4],
    /// Share of saturated pixels.
    pub saturated: f64,
    /// Null where no line of the picture shows a stripe.
    pub stripe: Option<StripeSeen>,
}

/// A stripe, looked at across.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct StripeSeen {
    /// It lies: it is looked at column by column.
    pub lying: bool,
    /// Level that a twentieth of its peaks are above, share of full scale.
    pub peak: f64,
    /// Where that is to stand.
    pub wanted: [f64; 2],
    /// Share of its peaks that are saturated.
    pub saturated: f64,
    /// Full width at half height, px, median.
    pub width_px: f64,
    /// Its peak against the level beside it, median.
    pub contrast: f64,
    /// Share of the lines without a stripe.
    pub dark: f64,
    /// Exposure is right.
    pub right: bool,
    /// The same in pieces along it, from the left or the top: peak, width in px, contrast, dark share; the first
    /// three are 0 where it is dark.
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

/// An exposure that was looked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct ExposureSet {
    /// us; it is set.
    pub exposure_us: f64,
    /// What was tried: us, and where the stripe's peaks stood, share of full scale; null: no stripe.
    pub tried: Vec<(f64, Option<f64>)>,
    /// What pictures show now.
    pub look: PictureLook,
    /// Where no exposure is quite right: why this one is the best.
    pub remark: Option<String>,
}
