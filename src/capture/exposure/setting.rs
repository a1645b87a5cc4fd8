//! In: the features of a camera. Out: the one that sets its exposure, with range and value.
//! Frame and unit: exposure in us.

use crate::capture::feature::{Feature, Range, Value};
use crate::capture::picture::PictureSource;
use crate::fault::{Fault, Result};

/// The exposure of a camera as it is set now.
pub(super) struct Setting {
    /// The camera's name for it.
    pub name: String,
    /// Shortest and longest exposure, us.
    pub range: [f64; 2],
    /// Present exposure, us; none if the camera does not report it.
    pub us: Option<f64>,
}

/// The fault for a source whose exposure cannot be set.
pub fn unexposed(name: &str) -> Fault {
    Fault::usage(format!("{name}: has no ExposureTime to set"))
        .cause("a pipe, a folder, a file, or a camera whose exposure is set elsewhere")
        .next("set the exposure there; sheetlight camera snap reports the stripe")
}

impl Setting {
    /// Reads it.
    ///
    /// # Errors
    /// A source without such a feature; a camera that does not answer.
    pub fn of(source: &mut dyn PictureSource) -> Result<Setting> {
        let features = source.features()?;
        Setting::among(&features).ok_or_else(|| unexposed(&source.name()))
    }

    /// The setting among the features of a camera.
    pub fn among(features: &[Feature]) -> Option<Setting> {
        let names = ["ExposureTime", "ExposureTimeAbs"];
        let feature = names.iter().find_map(|n| features.iter().find(|f| f.name == *n))?;
        let range = if let Range::Between(low, high) = feature.range { [low, high] } else { [1.0, 1e6] };
        let us = match feature.value {
            Some(Value::Float(v)) => Some(v),
            Some(Value::Integer(v)) => Some(v as f64),
            _ => None,
        };
        Some(Setting { name: feature.name.clone(), range, us })
    }

    /// Sets the exposure, and gives the one that the camera then reports.
    ///
    /// # Errors
    /// The camera refuses it, or does not report its exposure.
    pub fn set(&self, source: &mut dyn PictureSource, us: f64) -> Result<f64> {
        source.set(&self.name, &format!("{us}"))?;
        Setting::of(source)?.us.filter(|us| *us > 0.0).ok_or_else(|| {
            Fault::input(format!("{}: does not report the exposure that it was set to", source.name()))
                .cause("the camera's feature cannot be read")
                .next("see its features with: sheetlight camera show")
        })
    }
}
