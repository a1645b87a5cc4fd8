//! In: nothing. Out: the station, its recordings and its recipes as pages list them.
//! Frame and unit: px, mm, days.

use super::{Mode, Problem};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// The station.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct StationInfo {
    /// Its name.
    pub name: String,
    /// Source of the pictures.
    pub mode: Mode,
    /// Name and version of the program.
    pub program: String,
    /// The robot's pose convention; null: poses are written as matrices.
    pub robot: Option<String>,
    /// eye-in-hand or eye-to-hand; null: not stated.
    pub mount: Option<String>,
    /// Tolerance of the work, mm.
    pub tolerance_mm: Option<f64>,
    /// Range of camera depths in which points are accepted, mm.
    pub volume_mm: Option<[f64; 2]>,
    /// Frame of scans and of poses found in them: base, axis or camera.
    pub work_frame: String,
    /// Fixed frames relative to others, in the robot's convention.
    pub frames: Vec<FrameInfo>,
    /// One entry per existing calibration.
    pub calibrations: Vec<CalibrationState>,
    /// What is wrong with the station; null: nothing.
    pub problem: Option<Problem>,
    /// Dotted names of all extraction settings, with the station's values.
    #[ts(type = "Record<string, unknown>")]
    pub extraction: std::collections::BTreeMap<String, serde_json::Value>,
}

/// Pose of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct FrameInfo {
    /// tool or camera.
    pub name: String,
    /// The frame it is relative to: flange or base.
    pub on: String,
    /// Labels of the numbers.
    pub labels: Vec<String>,
    /// mm, degrees, or units of the convention.
    pub numbers: Vec<f64>,
}

/// Whether the support file includes pictures.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupportAsk {
    /// A person ticked the option.
    #[serde(default)]
    pub pictures: bool,
}

/// A calibration of the station.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct CalibrationState {
    /// Name in files.
    pub kind: String,
    /// Name for people.
    pub words: String,
    /// good, usable, badly determined or refused.
    pub verdict: String,
    /// When it was measured.
    pub created: String,
    /// Its age, days.
    pub days: f64,
    /// Expected error of a point at the working distance, mm.
    pub expected_mm: Option<f64>,
}

/// A recording.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct RecordingInfo {
    /// Path below the recordings' folder.
    pub name: String,
    /// The name stated in its meta.json.
    pub set: String,
    /// Number of frames.
    pub frames: usize,
    /// Columns of its pictures, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// line or pointer; null if no laser is on.
    pub beam: Option<String>,
    /// It shows a calibration board.
    pub board: bool,
    /// robot, linear or turntable.
    pub motion: String,
    /// The procedures that it suits: scan, touch, joint, or targets of a calibration.
    pub suits: Vec<String>,
    /// Why it cannot be used; null: it can.
    pub problem: Option<Problem>,
}

/// A picture of a calibration board.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct BoardView {
    /// Name of the picture.
    pub name: String,
    /// Its file in the job's folder.
    pub file: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// The detected corners, u and v, px.
    pub corners: Vec<[f64; 2]>,
    /// Tilt of the board's normal from the camera's axis, to the right and downwards in the picture, degrees. Uses
    /// the station's camera, or else a focal length equal to the picture's width in px. Null if too little of the
    /// board was found.
    pub lean_deg: Option<[f64; 2]>,
    /// Position of the axis that carries the board, counts; null without an axis, or if unknown.
    pub count: Option<f64>,
}

/// A picture of a recording of boards.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewRef {
    /// The recording.
    pub recording: String,
    /// Frame number, counted from 0.
    pub frame: usize,
}

/// A picture of a recording.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PictureRef {
    /// The recording.
    pub recording: String,
    /// Frame number, counted from 0.
    pub frame: usize,
    /// laser or ambient; null: whichever exists.
    #[serde(default)]
    pub light: Option<String>,
    /// Columns of the answer, 16 to 4096; null: as the picture.
    #[serde(default)]
    pub width: Option<u32>,
}

/// A recipe as text.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct RecipeText {
    /// Name of the file, without extension.
    pub name: String,
    /// Name of the part for people; read from the text.
    pub title: String,
    /// The recipe ships with the program; it is copied when it is changed.
    pub shipped: bool,
    /// TOML; empty if the file cannot be read at all.
    pub text: String,
    /// What is wrong with it; null: nothing.
    pub problem: Option<Problem>,
}

/// A recipe to be stored. Other keys of a listed recipe may be sent too; they are ignored.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
pub struct RecipeAsk {
    /// TOML.
    pub text: String,
    /// Replaces the station's recipe of that name.
    #[serde(default)]
    pub replace: bool,
}
