//! In: nothing. Out: what an operator can order, as sent to the API and stored in job.json.
//! Frame and unit: mm, degrees; positions in a height map's grid.

use super::FilterOrder;
use crate::procedure::calibrate::{CalibrateOrder, JointOrder};
use crate::procedure::{ScanOrder, TouchOrder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// A procedure with its inputs. Recordings are named by their path below the recordings' folder, scans by their
/// job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema, strum::IntoStaticStr)]
#[serde(tag = "procedure", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Order {
    /// Checks station, disk and adapters, and every GPU stage against its CPU twin.
    Check(Plain),
    /// Makes a cloud and a height map from a recording.
    Scan(ScanOrder),
    /// Stores a filtered copy of a finished scan.
    Filter(FilterOrder),
    /// Finds a recipe's part in finished scans; several scans are views of the same part.
    Find(FindOrder),
    /// Makes a recipe from a finished scan.
    Teach(TeachOrder),
    /// Measures the pointer's spots on a surface: distances, plane, normal.
    Touch(TouchOrder),
    /// Finds the exposure that suits the stripe in the camera's picture, and sets it.
    Tune(Plain),
    /// Calibrates from one recording; the result is stored in the station when it is accepted.
    Calibrate(CalibrateOrder),
    /// Calibrates camera, hand-eye, laser plane and pointer in one solve from any recordings of boards; stored in
    /// the station when accepted.
    Joint(JointOrder),
    /// The same with motions of the robot that the program chooses.
    Auto(AutoOrder),
    /// Inserts a component with the robot: touch, square, scan, find, approach, insert, retract.
    Insert(InsertOrder),
    /// Measures the time of a shot on this machine, with and without its GPU, and the pictures of a camera that are
    /// dropped.
    Benchmark(BenchmarkOrder),
}

/// No further input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plain {}

/// Inputs of the benchmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BenchmarkOrder {
    /// Frame rate of the camera whose drops are counted, Hz; null: 30.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub rate_hz: Option<f64>,
}

/// What to find, and in which scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FindOrder {
    /// Jobs that scanned.
    pub scans: Vec<String>,
    /// Name of the recipe.
    pub recipe: String,
    /// Two positions in the first scan's map, mm: the tool goes to the middle of the pins there; null: to the point
    /// that the recipe names.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub pins: Option<[[f64; 2]; 2]>,
}

/// A calibration that moves the robot itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AutoOrder {
    /// Name of the board's description in the station's folder `boards`.
    pub board: String,
    /// The calibration ends when the expected error of a scanned point is at most this, mm rms.
    pub target_mm: f64,
    /// Most stops, 20 to 200; null: 40.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub most: Option<usize>,
}

/// An insertion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InsertOrder {
    /// Name of the recipe.
    pub recipe: String,
    /// Length of the sweep about the picture's middle, mm; null: the field's short side.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub sweep_mm: Option<f64>,
    /// Speed of every motion, mm/s; null: the station's.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub speed_mm_s: Option<f64>,
    /// After an interruption, retract instead of continuing.
    #[serde(default)]
    pub back_out: bool,
}

/// A part taught by a few positions in a height map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TeachOrder {
    /// The job that scanned it.
    pub scan: String,
    /// Name of the recipe.
    pub name: String,
    /// Corners of the body before its rotation: x0 y0 x1 y1, mm in the grid.
    pub outline: [f64; 4],
    /// Its rotation about its centre, degrees.
    #[serde(default)]
    pub angle_deg: f64,
    /// Windows in the body, corners as for `outline`.
    #[serde(default)]
    pub windows: Vec<[f64; 4]>,
    /// Round holes: x, y, radius.
    #[serde(default)]
    pub holes: Vec<[f64; 3]>,
    /// Tolerance of the insertion in the plane, mm.
    pub tolerance_mm: f64,
    /// Tolerance of its rotation, degrees.
    pub tolerance_deg: f64,
    /// Distance of the tool above the insertion pose before and after the insertion, mm.
    pub approach_mm: f64,
    /// Replaces the station's recipe of that name.
    #[serde(default)]
    pub replace: bool,
}

impl Order {
    /// The name of the procedure in folders and pages.
    pub fn word(&self) -> &'static str {
        self.into()
    }
}
