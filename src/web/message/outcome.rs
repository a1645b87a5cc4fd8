//! In: nothing. Out: what each procedure came to, as pages show it and job.json keeps it.
//! Frame and unit: mm, degrees, px; poses in the scan's frame.

use super::ExposureSet;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use ts_rs::TS;

/// What came of a job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(tag = "procedure", rename_all = "snake_case")]
pub enum Outcome {
    /// One line a check.
    Check {
        /// In the order in which they were made.
        lines: Vec<CheckLine>,
    },
    /// The scan's figures; its files lie in the job.
    Scan(Box<ScanFigures>),
    /// Where the tool goes, or why not.
    Find(Box<Position>),
    /// The recipe and its proof on the scan that it was taught from.
    Teach {
        /// Name of the recipe.
        recipe: String,
        /// Found on its own scan.
        proof: Box<Position>,
    },
    /// The surface that the pointer touched.
    Touch(Box<Touched>),
    /// The exposure that was set.
    Tune(Box<ExposureSet>),
    /// A calibration to be accepted.
    Calibrate(Box<CalibrationFigures>),
    /// All calibrations of a rig together, to be accepted.
    Joint(Box<CalibrationFigures>),
    /// The same by moves of the robot.
    Auto(Box<CalibrationFigures>),
    /// The component is in.
    Insert(Box<Inserted>),
    /// Times of a shot.
    Benchmark {
        /// One a size and processor.
        rows: Vec<BenchRow>,
        /// The same of other machines, as they were recorded.
        #[serde(default)]
        recorded: Vec<BenchRow>,
        /// What of a camera was measured and what was dropped, at half and at full resolution.
        #[serde(default)]
        kept_up: Vec<KeptUp>,
    },
}

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct CheckLine {
    /// station, camera, robot, gpu, disk or clock.
    pub group: String,
    /// What was looked at.
    pub name: String,
    /// good, poor (works, but read it), bad or absent.
    pub state: String,
    /// What was seen, with its number and limit.
    pub says: String,
}

/// What a scan came to; scan.json holds more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct ScanFigures {
    /// Shots done, those left out included.
    pub shots: usize,
    /// Points of the cloud.
    #[ts(type = "number")]
    pub points: u64,
    /// Size of the pictures, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Frame of the cloud: base, axis or flange.
    pub frame: String,
    /// Median of the points' own standard deviations, mm.
    pub median_sigma_mm: Option<f64>,
    /// Share of the map's cells that were measured.
    pub coverage: Option<f64>,
    /// Edge of a cell, mm.
    pub cell_mm: Option<f64>,
    /// Heights between which 98 % of the map lies, mm.
    pub z_mm: Option<[f64; 2]>,
    /// Peaks by fate.
    #[ts(type = "Record<string, number>")]
    pub peaks: BTreeMap<String, u64>,
    /// Shots without a point.
    pub dark_shots: usize,
    /// Shots left out: name and reason.
    pub skipped: Vec<(String, String)>,
    /// From the first shot to the closed cloud, s.
    pub seconds: f64,
    /// Shots a second of this run.
    pub shots_per_second: f64,
    /// Adapter, or this machine's processor and why.
    pub ran_on: String,
    /// Seconds by what the main thread did.
    #[ts(type = "Record<string, number>")]
    pub spent: BTreeMap<String, f64>,
    /// What a reader must know.
    pub remarks: Vec<String>,
}

/// Where the tool goes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct Position {
    /// Name of the recipe.
    pub recipe: String,
    /// Frame of the poses.
    pub frame: String,
    /// Every gate was passed.
    pub passed: bool,
    /// Which were not, in words.
    pub reasons: Vec<String>,
    /// Null where a gate was missed.
    pub poses: Option<RobotPoses>,
    /// One standard deviation along x, y, z of the part, mm.
    pub sigma_mm: [f64; 3],
    /// One standard deviation of the turns about them, degrees.
    pub sigma_deg: [f64; 3],
    /// What the insertion bears in the plane, mm.
    pub tolerance_mm: f64,
    /// What it bears as a turn, degrees.
    pub tolerance_deg: f64,
    /// 3 sigma within both.
    pub within_tolerance: bool,
    /// Where the sigma comes from.
    pub terms: Vec<Term>,
    /// False: a term is unknown, the sum is a lower bound.
    pub complete: bool,
    /// Each gate with its number and limit.
    pub gates: Vec<GateLight>,
    /// Score of the match, and of the next best.
    pub score: f64,
    /// Of the next best pose.
    pub second_score: f64,
    /// The part in the scan's frame: row-major 4x4, mm.
    pub part: [f64; 16],
    /// The drawing's outlines in the height map's grid, mm.
    pub outline: Vec<Vec<[f64; 2]>>,
    /// What else a reader must know.
    pub notes: Vec<String>,
}

/// The poses of one insertion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct RobotPoses {
    /// Changes with every number here: a confirmation names the poses that were shown by it.
    pub hash: String,
    /// The station's own notation.
    pub convention: String,
    /// One a number, with its unit.
    pub labels: Vec<String>,
    /// Above the insertion.
    pub approach: Vec<f64>,
    /// The tool at its place.
    pub insertion: Vec<f64>,
    /// Above it, on the way back.
    pub retract: Vec<f64>,
    /// The insertion in every notation.
    pub notations: Vec<Notation>,
}

/// A pose as one vendor writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct Notation {
    /// Name of the convention.
    pub name: String,
    /// One a number, with its unit.
    pub labels: Vec<String>,
    /// In the order of the labels.
    pub numbers: Vec<f64>,
}

/// A source of uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct Term {
    /// Its name.
    pub name: String,
    /// Along x, y, z of the part, mm; null where it is not known.
    pub sigma_mm: Option<[f64; 3]>,
    /// About them, degrees.
    pub sigma_deg: Option<[f64; 3]>,
    /// What it is.
    pub note: String,
}

/// A gate as a light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct GateLight {
    /// What is judged, with its unit.
    pub name: String,
    /// What was seen.
    pub value: f64,
    /// What it is held against.
    pub limit: f64,
    /// Kept.
    pub passed: bool,
}

impl From<&crate::fault::Gate> for GateLight {
    fn from(g: &crate::fault::Gate) -> GateLight {
        GateLight { name: g.name.into(), value: g.value, limit: g.limit, passed: g.passed }
    }
}

/// An insertion that came to its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct Inserted {
    /// From the beginning to the confirmed position, s.
    pub time_to_position_s: Option<f64>,
    /// Motions that were confirmed until then.
    pub confirmations_to_position: Option<u32>,
    /// Work and waits, s.
    pub seconds: f64,
    /// Motions that were confirmed.
    pub confirmations: u32,
    /// Where the part was found; null where it was found before the program was started again.
    pub found: Option<Position>,
}

/// A pose in which the tool stands square to what was touched, at the place where it stood at the last shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct SquareProposed {
    /// How far the tool leant at the last shot, degrees.
    pub tilt_deg: f64,
    /// One standard deviation of that.
    pub tilt_sigma_deg: f64,
    /// How the robot writes poses.
    pub convention: String,
    /// Names of the numbers.
    pub labels: Vec<String>,
    /// Where the flange goes, base frame.
    pub flange: Vec<f64>,
    /// Where the tool is then, base frame.
    pub tool: Vec<f64>,
}

/// What the pointer touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct Touched {
    /// Picture, distance from the camera along its axis and its standard deviation, mm.
    pub spots: Vec<(String, f64, f64)>,
    /// The plane through them.
    pub surface: Option<SurfaceTouched>,
    /// How to stand square to it; null without a surface or without the station's tool.
    #[serde(default)]
    pub square: Option<SquareProposed>,
    /// Pictures without a distance: name and reason.
    pub missing: Vec<(String, String)>,
    /// What a reader must know.
    pub remarks: Vec<String>,
}

/// A plane that was touched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct SurfaceTouched {
    /// Unit length, towards the camera; base frame.
    pub normal: [f64; 3],
    /// Middle of the spots, base frame, mm.
    pub centre_mm: [f64; 3],
    /// Standard deviation of its tilt: worst direction, and across it, degrees.
    pub tilt_sigma_deg: [f64; 2],
    /// How far the spots lie off it, rms, mm.
    pub rms_mm: f64,
    /// Angle between it and the base's z, degrees.
    pub tilt_deg: f64,
    /// A spot that does not lie on the plane of the others.
    pub left_out: Option<String>,
}

/// What a calibration came to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct CalibrationFigures {
    /// What was calibrated, as files call it.
    pub kind: String,
    /// good, usable, badly determined or refused.
    pub verdict: String,
    /// Why.
    pub reasons: Vec<String>,
    /// The next best picture.
    pub advice: Vec<String>,
    /// Named figures, unit in the name.
    #[ts(type = "Record<string, number>")]
    pub figures: BTreeMap<String, f64>,
    /// The same of the station's present one; empty without.
    #[ts(type = "Record<string, number>")]
    pub former: BTreeMap<String, f64>,
    /// Residual a picture; unit in the heading of the page.
    pub per_picture: Vec<(String, f64)>,
    /// Pictures that were not used: name and reason.
    pub left_out: Vec<(String, String)>,
    /// It was stored in the station.
    pub accepted: bool,
}

/// What became of a camera's pictures while the newest one was measured again and again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct KeptUp {
    /// What it ran on.
    pub on: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Pictures a second that were sent.
    pub rate_hz: f64,
    /// Pictures that were sent.
    #[ts(type = "number")]
    pub sent: u64,
    /// Of these with points.
    #[ts(type = "number")]
    pub measured: u64,
    /// Passed over, because a newer one had come.
    #[ts(type = "number")]
    pub passed_over: u64,
    /// Lost otherwise.
    #[ts(type = "number")]
    pub lost: u64,
    /// From the last byte to the points, p50 and p99, ms.
    pub ms: [f64; 2],
}

/// Jobs that found one part again and again.
#[derive(Clone, Debug, PartialEq, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct RepeatsAsk {
    /// Their names.
    pub jobs: Vec<String>,
}

/// How places of one part repeat.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Repeats {
    /// Of how many.
    pub places: usize,
    /// x, y, z, turn; empty of fewer than two.
    pub along: Vec<Spread>,
}

/// How they repeat along one axis, or in the turn.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Spread {
    /// x, y, z of the frame, or turn.
    pub name: String,
    /// mm or degrees.
    pub unit: String,
    /// One standard deviation of the places.
    pub scatter: f64,
    /// What they state of themselves, root mean square.
    pub stated: f64,
    /// From the first to the last of them.
    pub apart: f64,
    /// The histogram reaches so far to both sides of the median.
    pub half: f64,
    /// Places in each of its bars.
    pub bars: Vec<u32>,
}

impl Repeats {
    /// As pages show them.
    pub fn of(places: usize, found: Option<crate::station::Repeats>) -> Repeats {
        let spread = |s: crate::station::Spread| Spread {
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

/// The time of a shot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
pub struct BenchRow {
    /// What it ran on.
    pub on: String,
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Of the whole chain, ms.
    pub ms_per_shot: f64,
}
