//! In: nothing. Out: what the results of procedures consist of, as shown by pages and stored in job.json.
//! Frame and unit: mm, degrees, px; poses in the scan's frame.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use ts_rs::TS;

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct CheckLine {
    /// station, camera, robot, gpu, disk or clock.
    pub group: String,
    /// What was checked.
    pub name: String,
    /// good, poor (works, but read the finding), bad or absent.
    pub state: String,
    /// The finding, with the value and the limit.
    pub says: String,
}

/// Figures of a scan; scan.json has more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct ScanFigures {
    /// Shots processed, skipped ones included.
    pub shots: usize,
    /// Number of points in the cloud.
    #[ts(type = "number")]
    pub points: u64,
    /// Columns of the pictures, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Frame of the cloud: base, axis or flange.
    pub frame: String,
    /// Median of the points' standard deviations, mm.
    pub median_sigma_mm: Option<f64>,
    /// Fraction of the map's cells that were measured.
    pub coverage: Option<f64>,
    /// Cell size, mm.
    pub cell_mm: Option<f64>,
    /// Range that contains 98 % of the map's heights, mm.
    pub z_mm: Option<[f64; 2]>,
    /// Number of peaks by `fate`: kept, or the reason for rejection.
    #[ts(type = "Record<string, number>")]
    pub peaks: BTreeMap<String, u64>,
    /// Number of shots without a point.
    pub dark_shots: usize,
    /// Skipped shots: name and reason.
    pub skipped: Vec<(String, String)>,
    /// Time from the first shot to the finished cloud, s.
    pub seconds: f64,
    /// Shots per second of this run.
    pub shots_per_second: f64,
    /// The adapter; or this machine's processor, and why.
    pub ran_on: String,
    /// Seconds by activity of the main thread.
    #[ts(type = "Record<string, number>")]
    pub spent: BTreeMap<String, f64>,
    /// What a reader must know.
    pub remarks: Vec<String>,
}

/// The tool's poses for an insertion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Position {
    /// Name of the recipe.
    pub recipe: String,
    /// Frame of the poses.
    pub frame: String,
    /// Every gate passed.
    pub passed: bool,
    /// The gates that failed, in words.
    pub reasons: Vec<String>,
    /// Null if a gate failed.
    pub poses: Option<RobotPoses>,
    /// Standard deviation along x, y, z of the part, mm.
    pub sigma_mm: [f64; 3],
    /// Standard deviation of the rotation about these axes, degrees.
    pub sigma_deg: [f64; 3],
    /// Tolerance of the insertion in the plane, mm.
    pub tolerance_mm: f64,
    /// Tolerance of its rotation, degrees.
    pub tolerance_deg: f64,
    /// 3 sigma lie within both tolerances.
    pub within_tolerance: bool,
    /// Contributions to the standard deviation.
    pub terms: Vec<Term>,
    /// False: a contribution is unknown, so the sum is a lower bound.
    pub complete: bool,
    /// Each gate with its value and limit.
    pub gates: Vec<GateLight>,
    /// Score of the match.
    pub score: f64,
    /// Score of the next best pose.
    pub second_score: f64,
    /// Pose of the part in the scan's frame: row-major 4x4, mm.
    pub part: [f64; 16],
    /// Outlines of the drawing in the height map's grid, mm.
    pub outline: Vec<Vec<[f64; 2]>>,
    /// What else a reader must know.
    pub notes: Vec<String>,
}

/// The poses of one insertion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct RobotPoses {
    /// Hash of all numbers here: a confirmation identifies the shown poses by it.
    pub hash: String,
    /// The station's pose convention.
    pub convention: String,
    /// One label per number, with its unit.
    pub labels: Vec<String>,
    /// Above the insertion.
    pub approach: Vec<f64>,
    /// The inserted tool.
    pub insertion: Vec<f64>,
    /// Above the insertion, on the way back.
    pub retract: Vec<f64>,
    /// The insertion pose in every convention.
    pub notations: Vec<Notation>,
}

/// A pose in one vendor's convention.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Notation {
    /// Name of the convention.
    pub name: String,
    /// One label per number, with its unit.
    pub labels: Vec<String>,
    /// In the order of the labels.
    pub numbers: Vec<f64>,
}

/// A contribution to the uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Term {
    /// Name of the contribution.
    pub name: String,
    /// Standard deviation along x, y, z of the part, mm; null if unknown.
    pub sigma_mm: Option<[f64; 3]>,
    /// Standard deviation about these axes, degrees.
    pub sigma_deg: Option<[f64; 3]>,
    /// Explanation.
    pub note: String,
}

/// A gate and its result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct GateLight {
    /// The judged quantity, with its unit.
    pub name: String,
    /// The measured value.
    pub value: f64,
    /// The limit.
    pub limit: f64,
    /// The value keeps the limit.
    pub passed: bool,
}

impl From<&sheetlight::fault::Gate> for GateLight {
    fn from(g: &sheetlight::fault::Gate) -> GateLight {
        GateLight { name: g.name.into(), value: g.value, limit: g.limit, passed: g.passed }
    }
}

/// A completed insertion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Inserted {
    /// Time from the start to the confirmed position, s.
    pub time_to_position_s: Option<f64>,
    /// Number of confirmations until then.
    pub confirmations_to_position: Option<u32>,
    /// Total duration, work and waiting, s.
    pub seconds: f64,
    /// Number of confirmations in total.
    pub confirmations: u32,
    /// The found part; null if it was found before the program was restarted.
    pub found: Option<Position>,
}

/// A pose in which the tool is square to the touched surface, at its position in the last shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct SquareProposed {
    /// Tilt of the tool in the last shot, degrees.
    pub tilt_deg: f64,
    /// Standard deviation of the tilt, degrees.
    pub tilt_sigma_deg: f64,
    /// The robot's pose convention.
    pub convention: String,
    /// Labels of the numbers.
    pub labels: Vec<String>,
    /// Pose of the flange, base frame.
    pub flange: Vec<f64>,
    /// Pose of the tool then, base frame.
    pub tool: Vec<f64>,
}

/// The touched surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Touched {
    /// For each spot: picture, distance from the camera along its axis and its standard deviation, mm.
    pub spots: Vec<(String, f64, f64)>,
    /// The plane through the spots.
    pub surface: Option<SurfaceTouched>,
    /// How to make the tool square to the plane; null without a plane or without the station's tool.
    #[serde(default)]
    pub square: Option<SquareProposed>,
    /// Pictures without a distance: name and reason.
    pub missing: Vec<(String, String)>,
    /// What a reader must know.
    pub remarks: Vec<String>,
}

/// A plane through touched spots.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct SurfaceTouched {
    /// Unit normal towards the camera; base frame.
    pub normal: [f64; 3],
    /// Middle of the spots, base frame, mm.
    pub centre_mm: [f64; 3],
    /// Standard deviation of its tilt: in the worst direction, and at right angles to it, degrees.
    pub tilt_sigma_deg: [f64; 2],
    /// Distance of the spots from the plane, rms, mm.
    pub rms_mm: f64,
    /// Angle between its normal and the base's z axis, degrees.
    pub tilt_deg: f64,
    /// A spot that was excluded because it does not lie on the plane of the others.
    pub left_out: Option<String>,
}

/// Figures of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct CalibrationFigures {
    /// Kind of calibration, as named in files.
    pub kind: String,
    /// good, usable, badly determined or refused.
    pub verdict: String,
    /// Reasons for the verdict.
    pub reasons: Vec<String>,
    /// Advice for the next picture.
    pub advice: Vec<String>,
    /// Figures by name, with the unit in the name.
    #[ts(type = "Record<string, number>")]
    pub figures: BTreeMap<String, f64>,
    /// The same figures of the station's present calibration; empty if there is none.
    #[ts(type = "Record<string, number>")]
    pub former: BTreeMap<String, f64>,
    /// Residual of each picture; the page's heading states the unit.
    pub per_picture: Vec<(String, f64)>,
    /// Excluded pictures: name and reason.
    pub left_out: Vec<(String, String)>,
    /// It was stored in the station.
    pub accepted: bool,
}

/// Fates of a camera's pictures while the newest one was measured repeatedly.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct KeptUp {
    /// Adapter or processor.
    pub on: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Frame rate at which pictures were sent, Hz.
    pub rate_hz: f64,
    /// Number of pictures sent.
    #[ts(type = "number")]
    pub sent: u64,
    /// Number of these that have points.
    #[ts(type = "number")]
    pub measured: u64,
    /// Skipped because a newer one had arrived.
    #[ts(type = "number")]
    pub passed_over: u64,
    /// Lost for other reasons.
    #[ts(type = "number")]
    pub lost: u64,
    /// Time from the last byte to the points, p50 and p99, ms.
    pub ms: [f64; 2],
}

/// Jobs that found the same part repeatedly.
#[derive(Clone, Debug, PartialEq, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RepeatsAsk {
    /// Names of the jobs.
    pub jobs: Vec<String>,
}

/// Repeatability of a part's pose.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Repeats {
    /// Number of poses.
    pub places: usize,
    /// For x, y, z and rotation; empty for fewer than two poses.
    pub along: Vec<Spread>,
}

/// Repeatability along one axis, or of the rotation.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Spread {
    /// x, y, z of the frame, or turn.
    pub name: String,
    /// mm or degrees.
    pub unit: String,
    /// Standard deviation of the poses.
    pub scatter: f64,
    /// Root mean square of the standard deviations that the poses state.
    pub stated: f64,
    /// Range from the lowest to the highest value.
    pub apart: f64,
    /// Half width of the histogram, centred on the median.
    pub half: f64,
    /// Number of poses in each bar of the histogram.
    pub bars: Vec<u32>,
}

impl Repeats {
    /// The message that pages show.
    pub fn of(places: usize, found: Option<sheetlight::station::Repeats>) -> Repeats {
        let spread = |s: sheetlight::station::Spread| Spread {
            name: s.name.into(),
            unit: s.unit.into(),
            scatter: s.scatter,
            stated: s.stated,
            apart: s.apart,
            half: s.half,
            bars: s.bars,
        };
        Repeats { places, along: found.into_iter().flat_map(|r| r.along).map(spread).collect() }
    }
}

/// Time per shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct BenchRow {
    /// Adapter or processor.
    pub on: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Time of the whole chain, ms.
    pub ms_per_shot: f64,
}
