//! In: pictures of the pointer's spot. Out: its distances, and the surface that they show.
//! Frame and unit: camera and base frame; mm, degrees.

use super::at::At;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::fault::Result;
use sheetlight::rig::Rig;
use sheetlight::station::{RangeReport, RangeRun, Settings, measure_range};
use ts_rs::TS;

/// The recording of a touched surface.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct TouchOrder {
    /// Recording with a laser picture of the pointer's spot per frame
    pub recording: String,
    /// Pose file of the recording, without extension [default: the one in meta.json]
    #[arg(long)]
    pub poses: Option<String>,
}

impl TouchOrder {
    /// Measures; `one_surface`: all shots show one plane, whose normal is computed, too.
    ///
    /// # Errors
    /// An input that cannot be read, or no spot.
    pub fn measure(&self, at: &At, settings: &Settings, one_surface: bool) -> Result<RangeReport> {
        let recording = at.recording(&self.recording)?;
        at.check(&recording, self.poses.as_deref())?;
        let tool = settings.tool.map(|t| t.flange_from_tool);
        let run = RangeRun { poses: self.poses.clone(), one_surface, tool, ..RangeRun::default() };
        measure_range(&recording, &Rig::load(at.station)?, &run)
    }
}
