//! In: nothing. Out: the station, its recordings and its recipes as pages list them.
//! Frame and unit: px, mm, days.

use super::{Mode, Problem};
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// The station.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct StationInfo {
    /// Its name.
    pub name: String,
    /// Where pictures come from.
    pub mode: Mode,
    /// Name and version of the program.
    pub program: String,
    /// How its robot writes poses; null: as matrices.
    pub robot: Option<String>,
    /// eye-in-hand or eye-to-hand; null: not stated.
    pub mount: Option<String>,
    /// What the work tolerates, mm.
    pub tolerance_mm: Option<f64>,
    /// Camera depths at which points are believed, mm.
    pub volume_mm: Option<[f64; 2]>,
    /// Frame of scans and of the poses that are found in them: base, axis or camera.
    pub work_frame: String,
    /// Frames that are fixed to others, in the robot's notation.
    pub frames: Vec<FrameInfo>,
    /// One a calibration that there is.
    pub calibrations: Vec<CalibrationState>,
    /// What is wrong with it; null: nothing.
    pub problem: Option<Problem>,
    /// Names of all settings of the extraction, with dots, and the station's values.
    #[ts(type = "Record<string, unknown>")]
    pub extraction: std::collections::BTreeMap<String, serde_json::Value>,
}

/// Where a frame is.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct FrameInfo {
    /// tool or camera.
    pub name: String,
    /// flange or base.
    pub on: String,
    /// Names of the numbers.
    pub labels: Vec<String>,
    /// mm, degrees or as the notation has them.
    pub numbers: Vec<f64>,
}

/// Whether the support file has pictures.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct SupportAsk {
    /// Somebody ticked it.
    #[serde(default)]
    pub pictures: bool,
}

/// A calibration of the station.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct CalibrationState {
    /// As files call it.
    pub kind: String,
    /// For people.
    pub words: String,
    /// good, usable, badly determined or refused.
    pub verdict: String,
    /// When it was measured.
    pub created: String,
    /// How long ago, days.
    pub days: f64,
    /// Expected error of a point at the working distance, mm.
    pub expected_mm: Option<f64>,
}

/// A recording.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct RecordingInfo {
    /// Path below the recordings' folder.
    pub name: String,
    /// What it calls itself.
    pub set: String,
    /// Moments in it.
    pub frames: usize,
    /// Size of its pictures, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// line, pointer; null where no laser is on.
    pub beam: Option<String>,
    /// It shows a board.
    pub board: bool,
    /// robot, linear or turntable.
    pub motion: String,
    /// Why it cannot be used; null: it can.
    pub problem: Option<Problem>,
}

/// A picture of a calibration board.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct BoardView {
    /// What it is called.
    pub name: String,
    /// Its file, in the job.
    pub file: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// The corners that were found, u and v, px.
    pub corners: Vec<[f64; 2]>,
    /// How far the board's normal leans away from the camera's axis, to the right and downwards in the picture,
    /// degrees, by the station's camera or else one as long as its picture is wide; null where too little of the
    /// board was found.
    pub lean_deg: Option<[f64; 2]>,
    /// Where the axis stood that the board rides on, counts; null without one, or where it is not known.
    pub count: Option<f64>,
}

/// Which picture of a recording of boards.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct ViewRef {
    /// The recording.
    pub recording: String,
    /// Its frame, from 0.
    pub frame: usize,
}

/// Which picture of a recording.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct PictureRef {
    /// The recording.
    pub recording: String,
    /// Its frame, from 0.
    pub frame: usize,
    /// laser or ambient; without: whichever there is.
    #[serde(default)]
    pub light: Option<String>,
    /// Columns of the answer, 16 to 4096; without: the picture's own.
    #[serde(default)]
    pub width: Option<u32>,
}

/// A recipe as text.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct RecipeText {
    /// Name of the file, without extension.
    pub name: String,
    /// What people call the part; read from the text.
    pub title: String,
    /// Ships with the program; it is copied when it is changed.
    pub shipped: bool,
    /// TOML; empty where it cannot be read at all.
    pub text: String,
    /// What is wrong with it; null: nothing.
    pub problem: Option<Problem>,
}

/// A recipe to be stored. Keys of a listed recipe beside the text may be sent along and are not read.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
pub struct RecipeAsk {
    /// TOML.
    pub text: String,
    /// It takes the place of the station's own recipe of that name.
    #[serde(default)]
    pub replace: bool,
}
