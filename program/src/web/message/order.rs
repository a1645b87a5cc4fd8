//! In: nothing. Out: what an operator can order, and what comes of it, as sent over the API and stored in job.json.
//! Frame and unit: mm, degrees; positions in a height map's grid.

use super::{BenchRow, CalibrationFigures, CheckLine, ExposureSet, Inserted, KeptUp, Position, ScanFigures, Touched};
use crate::procedure::calibrate::{AutoOrder, CalibrateOrder, JointOrder};
use crate::procedure::{FilterOrder, FindOrder, InsertOrder, ScanOrder, TouchOrder};
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

/// Result of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(tag = "procedure", rename_all = "snake_case")]
pub enum Outcome {
    /// Results of the checks.
    Check {
        /// In the order of the checks.
        lines: Vec<CheckLine>,
    },
    /// Figures of the scan; its files are in the job's folder.
    Scan(Box<ScanFigures>),
    /// The tool's poses, or why there are none.
    Find(Box<Position>),
    /// The recipe, and a test on the scan that it was taught from.
    Teach {
        /// Name of the recipe.
        recipe: String,
        /// Result of finding the part in that scan.
        proof: Box<Position>,
    },
    /// The surface that the pointer touched.
    Touch(Box<Touched>),
    /// The exposure that was set.
    Tune(Box<ExposureSet>),
    /// A calibration, to be accepted.
    Calibrate(Box<CalibrationFigures>),
    /// All calibrations of a rig together, to be accepted.
    Joint(Box<CalibrationFigures>),
    /// The same with motions of the robot.
    Auto(Box<CalibrationFigures>),
    /// The component is inserted.
    Insert(Box<Inserted>),
    /// Times per shot.
    Benchmark {
        /// One row per size and processor.
        rows: Vec<BenchRow>,
        /// Recorded rows of other machines.
        #[serde(default)]
        recorded: Vec<BenchRow>,
        /// Measured and dropped pictures of a camera, at half and at full resolution.
        #[serde(default)]
        kept_up: Vec<KeptUp>,
    },
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
