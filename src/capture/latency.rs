//! In: a station's folder. Out: by how much its pictures' times are late against its poses', as it was calibrated.
//! Frame and unit: ms.

use crate::fault::{Fault, Result};
use std::path::Path;

/// The delay between camera and poses.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Latency {
    /// The pictures' times are late by so much: the pose of a picture is the one of so long before.
    pub delay_ms: f64,
    /// 1 sigma.
    pub sigma_ms: f64,
    /// When it was found, UTC.
    #[serde(default)]
    pub created: String,
    /// From what.
    #[serde(default)]
    pub recordings: Vec<String>,
}

/// A delay above this is no delay, ms.
const MOST: f64 = 1000.0;

impl Latency {
    /// Reads `calibration/latency.json` of a station; none where it was not calibrated.
    ///
    /// # Errors
    /// A file that is none.
    pub fn load(station: &Path) -> Result<Option<Latency>> {
        let path = station.join("calibration").join("latency.json");
        let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
        let bad = |what: String| {
            Fault::input(format!("{}: {what}", path.display()))
                .cause("the file was edited")
                .next("calibrate the latency again, or take the file away")
        };
        let latency: Latency = serde_json::from_str(&text).map_err(|e| bad(e.to_string()))?;
        if !(latency.delay_ms.abs() <= MOST && (0.0..=MOST).contains(&latency.sigma_ms)) {
            return Err(bad(format!("a delay of {} ms, sigma {} ms", latency.delay_ms, latency.sigma_ms)));
        }
        Ok(Some(latency))
    }

    /// Writes it into a station.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn store(&self, station: &Path) -> Result<()> {
        let folder = station.join("calibration");
        crate::files::make_folder(&folder)?;
        let text = serde_json::to_string_pretty(self).expect("plain data");
        crate::files::write(&folder.join("latency.json"), text.as_bytes())
    }
}
