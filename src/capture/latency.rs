//! In: a station's folder. Out: by how much its pictures' times are late against its poses', as it was calibrated, of
//! which camera and which poses.
//! Frame and unit: ms.

use crate::fault::{Fault, Result};
use crate::recording::Sources;
use crate::rig::{sealed, unsealed};
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
    /// Of which camera against whose poses; none: its recording does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sources: Option<Sources>,
}

/// A delay above this is no delay, ms.
const MOST: f64 = 1000.0;
const AGAIN: &str = "find it again: sheetlight calibrate latency; or take calibration/latency.json away";

impl Latency {
    /// Reads `calibration/latency.json` of a station; none where it was not calibrated.
    ///
    /// # Errors
    /// A file that is none, or that was changed.
    pub fn load(station: &Path) -> Result<Option<Latency>> {
        let path = station.join("calibration").join("latency.json");
        let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
        let latency: Latency = unsealed(&text, &path.display().to_string()).map_err(|e| e.next(AGAIN))?;
        if !(latency.delay_ms.abs() <= MOST && (0.0..=MOST).contains(&latency.sigma_ms)) {
            let [delay, sigma] = [latency.delay_ms, latency.sigma_ms];
            return Err(Fault::input(format!("{}: a delay of {delay} ms, sigma {sigma} ms", path.display()))
                .cause(format!("a delay is at most {MOST} ms"))
                .next(AGAIN));
        }
        Ok(Some(latency))
    }

    /// Whether it is the delay between this camera and these poses. Where one of both does not say what it is of, it
    /// is believed.
    ///
    /// # Errors
    /// It is of another camera, or of another robot's or axis' poses.
    pub fn of(&self, sources: Option<&Sources>) -> Result<()> {
        let (Some(mine), Some(theirs)) = (&self.sources, sources) else { return Ok(()) };
        if mine == theirs {
            return Ok(());
        }
        let words = |s: &Sources| format!("{} against {}", s.camera, s.poses.as_deref().unwrap_or("no poses"));
        Err(Fault::refused(format!(
            "the station's latency is of {}, the pictures are of {}",
            words(mine),
            words(theirs)
        ))
        .cause("a camera, a controller or its address was exchanged; another one has another delay")
        .next(AGAIN))
    }

    /// Writes it into a station.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn store(&self, station: &Path) -> Result<()> {
        let folder = station.join("calibration");
        crate::files::make_folder(&folder)?;
        crate::files::write(&folder.join("latency.json"), sealed(self).as_bytes())
    }
}
