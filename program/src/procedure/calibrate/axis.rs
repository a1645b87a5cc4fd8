//! In: a recording of a board that is mounted on a linear axis or turntable. Out: its direction and pitch, or its
//! axis.
//! Frame and unit: camera frame; mm, rad a count.

use super::super::at::At;
use super::super::word;
use super::{Calibration, OfBoards, Progress, Solved, open_one};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::fault::Result;
use sheetlight::geometry::{Axis, AxisKind};
use sheetlight::raster::Channel;
use sheetlight::rig::Rig;
use sheetlight::station::volume::asked;
use sheetlight::station::{AxisRun, Settings, calibrate_axis};
use ts_rs::TS;

/// Inputs of the calibration of a linear axis or turntable.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct AxisOrder {
    /// Recording of a board on the axis, with a picture and a count per frame
    pub recording: String,
    /// Frames that are not used, counted from 0
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    #[serde(default)]
    pub leave_out: Vec<usize>,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = word::parse::<Channel>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Channel>")]
    #[ts(as = "Option<String>")]
    pub channel: Channel,
}

impl Calibration for AxisOrder {
    fn recording(&self) -> &str {
        &self.recording
    }

    fn suits(boards: &OfBoards) -> bool {
        boards.axis
    }

    fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
        let mut recording = open_one(at, &self.recording, &self.leave_out)?;
        recording.channel = self.channel;
        let (settings, rig) = (Settings::load(at.station)?, Rig::load_to_calibrate(at.station)?);
        let run = AxisRun { asked: asked(&settings, None), ..AxisRun::default() };
        let c = calibrate_axis(&recording, &rig, &run, progress)?;
        let value = described(&c.calibration.value);
        Ok(Solved::of(c, value))
    }
}

fn described(a: &Axis) -> String {
    let (d, p) = (a.direction(), a.origin());
    match a.kind {
        AxisKind::Linear => format!(
            "linear axis: {:.8} mm a {} along {:.6} {:.6} {:.6} (camera frame)",
            a.pitch,
            a.unit.name(),
            d.x,
            d.y,
            d.z
        ),
        AxisKind::Turntable => format!(
            "turntable: {:.8} degrees a {} about {:.6} {:.6} {:.6} through {:.4} {:.4} {:.4} mm (camera frame)",
            a.pitch.to_degrees(),
            a.unit.name(),
            d.x,
            d.y,
            d.z,
            p.x,
            p.y,
            p.z
        ),
    }
}
