//! In: nothing. Out: what an operator can order, as the API takes it and job.json keeps it.
//! Frame and unit: mm, degrees; places in a height map's grid.

use super::FilterOrder;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use ts_rs::TS;

/// A procedure with what it needs. Recordings by their path below the recordings' folder, scans by their job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(tag = "procedure", rename_all = "snake_case")]
pub enum Order {
    /// Station, disk and adapters; every stage of the GPU against its twin.
    Check(Plain),
    /// A recording to cloud and height map.
    Scan(ScanOrder),
    /// A finished scan less what filters take away, as a scan of its own.
    Filter(FilterOrder),
    /// A recipe's part in finished scans: several are looks at the same part.
    Find(FindOrder),
    /// A recipe from a finished scan.
    Teach(TeachOrder),
    /// The pointer's spots on a surface: distances, plane, normal.
    Touch(TouchOrder),
    /// The exposure that suits the stripe in the camera's picture; it stays set.
    Tune(Plain),
    /// A calibration from a recording; it is stored when it is accepted.
    Calibrate(CalibrateOrder),
    /// Camera, hand-eye, laser plane and pointer from any recordings of boards, in one solve; stored when it is
    /// accepted.
    Joint(JointOrder),
    /// The same by moves of the robot that the program chooses.
    Auto(AutoOrder),
    /// A part with the robot: touch, square, scan, find, approach, insert, retract.
    Insert(InsertOrder),
    /// The time of a shot on this machine, with and without its GPU; what is dropped of a camera.
    Benchmark(BenchmarkOrder),
}

/// Nothing is to be said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct Plain {}

/// What is measured of this machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct BenchmarkOrder {
    /// Pictures a second of the camera whose drops are counted; null: 30.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub rate_hz: Option<f64>,
}

/// Which recording is scanned, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct ScanOrder {
    /// Which one.
    pub recording: String,
    /// Edge of a cell, mm; null: what the points bear.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub cell_mm: Option<f64>,
    /// auto, gpu or cpu; null: auto.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub on: Option<String>,
    /// Leave out shots that cannot be read.
    #[serde(default)]
    pub skip_bad: bool,
    /// Settings other than the station's: keys of [extraction] in station.toml, with dots, and their values.
    #[serde(default)]
    #[ts(type = "Record<string, unknown>")]
    pub settings: BTreeMap<String, serde_json::Value>,
}

/// What is looked for, and where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct FindOrder {
    /// Jobs that scanned.
    pub scans: Vec<String>,
    /// Name of the recipe.
    pub recipe: String,
    /// Two places in the first scan's map, mm: the tool goes where the middle of the pins there says; null: where the
    /// recipe says.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub pins: Option<[[f64; 2]; 2]>,
}

/// What was touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct TouchOrder {
    /// Which recording of the pointer.
    pub recording: String,
}

/// What is calibrated, from what.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct CalibrateOrder {
    /// What.
    pub target: Target,
    /// From which recording.
    pub recording: String,
    /// Frames to leave out, from 0.
    #[serde(default)]
    pub leave_out: Vec<usize>,
}

/// What is calibrated together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct JointOrder {
    /// Recordings of boards.
    pub recordings: Vec<String>,
}

/// A calibration that drives itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct AutoOrder {
    /// Name of the board's description in the station's folder boards.
    pub board: String,
    /// Expected error of a scanned point at which it is enough, mm rms.
    pub target_mm: f64,
    /// Stops at most, 20 to 200; null: 40.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub most: Option<usize>,
}

/// An insertion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct InsertOrder {
    /// Name of the recipe.
    pub recipe: String,
    /// The line sweeps over so much about the picture's middle, mm; null: the field's short side.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub sweep_mm: Option<f64>,
    /// Speed of every motion, mm/s; null: the station's.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub speed_mm_s: Option<f64>,
    /// Where it was cut off it goes back up instead of on.
    #[serde(default)]
    pub back_out: bool,
}

/// What is calibrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, TS)]
#[serde(rename_all = "snake_case")]
pub enum Target {
    /// Camera and lens.
    Camera,
    /// The camera on the flange.
    HandEye,
    /// The sheet of light.
    LaserPlane,
    /// The pointer's beam.
    Pointer,
    /// A linear axis or turntable that moves parts before a camera that stands still.
    Axis,
}

/// A part, by a few places in a height map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct TeachOrder {
    /// The job that scanned it.
    pub scan: String,
    /// What the recipe is called.
    pub name: String,
    /// Corners of the body before it is turned: x0 y0 x1 y1, mm in the grid.
    pub outline: [f64; 4],
    /// Its turn about its centre, degrees.
    #[serde(default)]
    pub angle_deg: f64,
    /// Windows in the body, corners as above.
    #[serde(default)]
    pub windows: Vec<[f64; 4]>,
    /// Round holes: x, y, radius.
    #[serde(default)]
    pub holes: Vec<[f64; 3]>,
    /// What the insertion bears in the plane, mm.
    pub tolerance_mm: f64,
    /// What it bears as a turn, degrees.
    pub tolerance_deg: f64,
    /// The tool's way above the insertion pose before and after, mm.
    pub approach_mm: f64,
    /// It takes the place of the station's own recipe of that name.
    #[serde(default)]
    pub replace: bool,
}

impl Order {
    /// The word that folders and pages call it by.
    pub fn word(&self) -> &'static str {
        match self {
            Order::Check(_) => "check",
            Order::Scan(_) => "scan",
            Order::Filter(_) => "filter",
            Order::Find(_) => "find",
            Order::Teach(_) => "teach",
            Order::Touch(_) => "touch",
            Order::Tune(_) => "tune",
            Order::Calibrate(_) => "calibrate",
            Order::Joint(_) => "joint",
            Order::Auto(_) => "auto",
            Order::Insert(_) => "insert",
            Order::Benchmark(_) => "benchmark",
        }
    }
}
