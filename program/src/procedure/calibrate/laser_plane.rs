//! In: a recording of boards with the stripe on them. Out: the laser plane.
//! Frame and unit: camera frame, mm.

use super::super::at::At;
use super::super::word;
use super::{Calibration, OfBoards, Progress, Solved, open_one, range};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::laser_plane::options::LaserPlaneOptions;
use sheetlight::fault::Result;
use sheetlight::raster::Channel;
use sheetlight::recording::Beam;
use sheetlight::rig::Rig;
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{LaserPlaneRun, Settings, calibrate_laser_plane};
use ts_rs::TS;

/// Inputs of the calibration of the laser plane.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct LaserPlaneOrder {
    /// Recording with an ambient and a laser picture per frame
    pub recording: String,
    /// Frames that are not used, counted from 0
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    #[serde(default)]
    pub leave_out: Vec<usize>,
    /// Nearest depth at which the result is judged, mm [default: station.toml's, else where boards were lit]
    #[arg(long, value_name = "MM", requires = "far_mm")]
    pub near_mm: Option<f64>,
    /// Farthest depth at which the result is judged, mm
    #[arg(long, value_name = "MM", requires = "near_mm")]
    pub far_mm: Option<f64>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = word::parse::<Where>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Where>")]
    #[ts(as = "Option<String>")]
    pub on: Where,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
}

impl Calibration for LaserPlaneOrder {
    fn recording(&self) -> &str {
        &self.recording
    }

    fn suits(boards: &OfBoards) -> bool {
        boards.beam != Some(Beam::Pointer)
    }

    fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
        let mut recording = open_one(at, &self.recording, &self.leave_out)?;
        recording.channel = self.channel;
        let (settings, rig) = (Settings::load(at.station)?, Rig::load_to_calibrate(at.station)?);
        let run = LaserPlaneRun {
            solver: LaserPlaneOptions::default(),
            asked: asked(&settings, range(self.near_mm, self.far_mm)?),
            extraction: settings.extraction.clone(),
            place: self.on,
        };
        let c = calibrate_laser_plane(&recording, &rig, &run, progress)?;
        let p = c.calibration.value;
        let value = format!(
            "laser plane: normal {:.6} {:.6} {:.6}, offset {:.4} mm (camera frame)",
            p.normal.x, p.normal.y, p.normal.z, p.offset
        );
        Ok(Solved::of(c, value))
    }
}
