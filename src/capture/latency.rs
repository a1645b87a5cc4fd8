//! In: a station's folder. Out: the calibrated delay of its pictures' times against its poses', with the camera and
//! the poses that it belongs to.
//! Frame and unit: ms.

use crate::fault::{Fault, Result};
use crate::recording::Sources;
use crate::rig::{sealed, unsealed};
use std::path::Path;

/// The delay between camera and poses.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Latency {
    /// Delay of the pictures' times: a picture belongs to the pose of this time earlier.
    pub delay_ms: f64,
    /// Standard deviation of the delay.
    pub sigma_ms: f64,
    /// Time of the calibration, UTC.
    #[serde(default)]
    pub created: String,
    /// Recordings that it was computed from.
    #[serde(default)]
    pub recordings: Vec<String>,
    /// Camera and poses that it belongs to; none if its recording does not state them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sources: Option<Sources>,
}

/// Largest accepted delay, ms.
const MOST: f64 = 1000.0;
const AGAIN: &str = "find it again: sheetlight calibrate latency; or take calibration/latency.json away";

impl Latency {
    /// Reads `calibration/latency.json` of a station; none if it was not calibrated.
    ///
    /// # Errors
    /// A file of another kind, or an edited one.
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

    /// Checks that it is the delay between this camera and these poses. If either side does not state its sources,
    /// it is accepted.
    ///
    /// # Errors
    /// It belongs to another camera, or to poses of another robot or axis.
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

    /// Writes it to a station.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn store(&self, station: &Path) -> Result<()> {
        let folder = station.join("calibration");
        crate::files::make_folder(&folder)?;
        crate::files::write(&folder.join("latency.json"), sealed(self).as_bytes())
    }
}
