//! In: a recording of a board. Out: a camera without distortion.
//! Frame and unit: camera frame; pixels, mm.

use super::super::at::At;
use super::{Calibration, CameraOrder, OfBoards, Progress, Solved};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::camera::lens::Lens;
use sheetlight::fault::Result;
use ts_rs::TS;

/// Inputs of the calibration of a pinhole camera.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct PinholeOrder {
    /// Recording of a board
    pub recording: String,
    /// Distance at which the expected error is judged, mm
    #[arg(long, value_name = "MM")]
    pub working_mm: Option<f64>,
}

impl Calibration for PinholeOrder {
    fn recording(&self) -> &str {
        &self.recording
    }

    fn suits(_: &OfBoards) -> bool {
        true
    }

    fn solve(&self, at: &At, progress: Progress) -> Result<Solved> {
        let PinholeOrder { recording, working_mm } = self.clone();
        CameraOrder { recording, working_mm, lens: Lens::None, ..CameraOrder::default() }.solve(at, progress)
    }
}
