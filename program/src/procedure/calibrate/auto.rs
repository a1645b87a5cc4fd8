//! In: a board below a robot, and when to end. Out: how the program calibrates the rig with motions that it chooses.
//! Frame and unit: mm.

use super::super::at::{At, Remark};
use super::super::word;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::fault::Result;
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{AutoRun, JointRun, Settings, mount_of};
use std::path::PathBuf;
use ts_rs::TS;

/// Most stops if the order states none.
const MOST: usize = 40;
/// Number of poses among which each next one is chosen; more make no better calibration.
const CANDIDATES: usize = 150;

/// A calibration that moves the robot itself.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
#[ts(optional_fields = nullable)]
pub struct AutoOrder {
    /// The board's description (docs/boards.md); over HTTP its name in the station's folder boards
    #[arg(long)]
    pub board: String,
    /// Target for the expected error of a scanned point, mm rms; the calibration ends when it is reached
    #[arg(long, value_name = "MM")]
    pub target_mm: f64,
    /// Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
    /// eye-in-hand with a note]
    #[arg(long, value_parser = word::parse::<Mount>)]
    #[serde(default)]
    #[schemars(schema_with = "word::schema::<Mount>")]
    #[ts(as = "Option<String>")]
    pub mount: Option<Mount>,
    /// Largest number of stops, 20 to 200 [default: 40]
    #[arg(long)]
    #[serde(default)]
    pub most: Option<usize>,
    /// Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
    #[arg(long, default_value = "auto", value_parser = word::parse::<Where>)]
    #[serde(default, with = "word")]
    #[schemars(schema_with = "word::schema::<Where>")]
    #[ts(as = "Option<String>")]
    pub on: Where,
}

impl AutoOrder {
    /// The run, with its pictures in the folder `out`.
    ///
    /// # Errors
    /// No such board; a number out of its range; the camera is elsewhere than the station's calibrations say.
    pub fn run(&self, at: &At, settings: &Settings, out: PathBuf) -> Result<AutoRun> {
        let mounted = mount_of(at.station, settings, self.mount)?;
        mounted.assumed.into_iter().for_each(|what| (at.remark)(Remark::Assumed(what)));
        let run = AutoRun {
            joint: JointRun::new(mounted.mount, asked(settings, None), &settings.extraction, self.on),
            board: at.names.board(&self.board)?,
            out,
            target_mm: self.target_mm,
            most: self.most.unwrap_or(MOST),
            working: settings.volume().map(|v| [v.near_mm, v.far_mm]),
            candidates: CANDIDATES,
            seed: 1,
        };
        run.check()?;
        Ok(run)
    }
}
