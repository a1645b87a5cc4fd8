//! In: a recording of boards with the pointer's spot on them. Out: the beam.
//! Frame and unit: camera frame, mm.

use super::super::at::At;
use super::super::word;
use super::{Calibration, OfBoards, Progress, Solved, open_one, range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::pointer::solve::PointerOptions;
use sheetlight::calibrate::pointer::spot::SpotOptions;
use sheetlight::fault::Result;
use sheetlight::raster::Channel;
use sheetlight::recording::Beam;
use sheetlight::rig::Rig;
use sheetlight::station::volume::asked;
use sheetlight::station::{PointerRun, Settings, calibrate_pointer};
use ts_rs::TS;

/// Inputs of the calibration of the pointer's beam.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct PointerOrder {
    /// Recording with an ambient and a laser picture per frame
    pub recording: String,
    /// Frames that are not used, counted from 0
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    #[serde(default)]
    pub leave_out: Vec<usize>,
    /// Nearest depth at which the result is judged, mm [default: station.toml's, else where spots were]
    #[arg(long, value_name = "MM", requires = "far_mm")]
    pub near_mm: Option<f64>,
    /// Farthest depth at which the result is judged, mm
    #[arg(long, value_name = "MM", requires = "near_mm")]
    pub far_mm: Option<f64>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
}

impl Calibration for PointerOrder {
    fn recording(&self) -> &str {
        &self.recording
    }

    fn suits(boards: &OfBoards) -> bool {
        boards.beam != Some(Beam::Line)
    }

    fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
        let mut recording = open_one(at, &self.recording, &self.leave_out)?;
        recording.channel = self.channel;
        let (settings, rig) = (Settings::load(at.station)?, Rig::load_to_calibrate(at.station)?);
        let run = PointerRun {
            spots: SpotOptions::default(),
            solver: PointerOptions::default(),
            asked: asked(&settings, range(self.near_mm, self.far_mm)?),
        };
        let c = calibrate_pointer(&recording, &rig, &run, progress)?;
        let (o, d) = (c.calibration.value.origin, c.calibration.value.direction);
        let value = format!(
            "pointer: through {:.4} {:.4} {:.4} mm along {:.7} {:.7} {:.7} (camera frame)",
            o.x, o.y, o.z, d.x, d.y, d.z
        );
        Ok(Solved::of(c, value))
    }
}
