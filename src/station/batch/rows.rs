//! What came of a recording: result.json in the folder of its results, and a line for whoever runs the batch. Poses are
//! in the robot's notation, lengths in mm, angles in degrees.

use super::repeats::Placed;
use super::shots::ShotRow;
use crate::fault::{Fault, Kind};
use crate::find::Report;
use std::collections::BTreeMap;

/// Why a recording came to nothing, or to no pose.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// What happened.
    pub what: String,
    /// The likely cause.
    pub cause: String,
    /// The next step.
    pub next: String,
}

impl From<&Fault> for Problem {
    fn from(f: &Fault) -> Problem {
        Problem { what: f.what.clone(), cause: f.cause.clone(), next: f.next.clone() }
    }
}

/// What came of one recording. It holds nothing that differs from run to run.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BatchRow {
    /// Version of this file: 1.
    pub format: u32,
    /// The folder's name: a hash of all that the results are made from.
    pub result: String,
    /// SHA-256 of the recording.
    pub input: String,
    /// Why it came to nothing, or to no pose; none: it did.
    pub problem: Option<Problem>,
    /// Frame of the cloud.
    pub frame: Option<String>,
    /// Shots done.
    pub shots: Option<u64>,
    /// Points of the cloud.
    pub points: Option<u64>,
    /// Median of the points' own standard deviations, mm.
    pub median_sigma_mm: Option<f64>,
    /// Share of the map's cells that were measured.
    pub coverage: Option<f64>,
    /// Other figures of the scan; the unit stands in the name.
    pub figures: BTreeMap<String, f64>,
    /// Name of the recipe; none: nothing was looked for.
    pub recipe: Option<String>,
    /// Where the part lies.
    pub found: Option<FoundAt>,
    /// The scan shot by shot.
    pub shot_rows: Vec<ShotRow>,
}

/// A place that was found, whether or not its gates let a pose pass.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FoundAt {
    /// Every gate was passed.
    pub passed: bool,
    /// Of the match.
    pub score: f64,
    /// The part in the scan's frame, row-major 4x4, mm.
    pub part: [f64; 16],
    /// One standard deviation along x, y, z of the part, mm.
    pub sigma_mm: [f64; 3],
    /// Of the turns about them, degrees.
    pub sigma_deg: [f64; 3],
    /// The insertion pose as the robot writes it; none where a gate was missed.
    pub insertion: Option<Vec<f64>>,
}

impl FoundAt {
    /// Of what the search reports.
    pub(super) fn of(r: &Report) -> FoundAt {
        FoundAt {
            passed: r.passed,
            score: r.found.score,
            part: r.base_from_part.to_rows(),
            sigma_mm: r.sigma_mm,
            sigma_deg: r.sigma_deg,
            insertion: r.poses.as_ref().map(|p| p.insertion.numbers.clone()),
        }
    }

    /// As repeats are reckoned of it.
    pub fn placed(&self) -> Option<Placed> {
        Placed::of(&self.part, self.sigma_mm, self.sigma_deg)
    }
}

/// How far a recording came.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum State {
    /// Scanned, and the part found where one is looked for.
    Done,
    /// Scanned to a result that says why there is no cloud or no pose.
    Refused,
    /// Not scanned: the recording is missing or changed. Another run tries it again.
    Failed,
}

/// What one run reports of a recording: a line of JSON.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Line {
    /// Its folder as the manifest names it.
    pub recording: String,
    /// How far it came.
    pub state: State,
    /// Whether this run made it; false: it was there.
    pub made: bool,
    /// Folder of the results, within the batch's.
    pub results: Option<String>,
    /// Points of the cloud.
    pub points: Option<u64>,
    /// Median of the points' own standard deviations, mm.
    pub median_sigma_mm: Option<f64>,
    /// Where the part lies.
    pub found: Option<FoundAt>,
    /// Why it came to nothing, or to no pose.
    pub problem: Option<Problem>,
}

impl Line {
    /// Of a recording with results.
    pub fn of(recording: &str, results: String, row: &BatchRow, made: bool) -> Line {
        let state = if row.problem.is_none() { State::Done } else { State::Refused };
        Line {
            recording: recording.into(),
            state,
            made,
            results: Some(results),
            points: row.points,
            median_sigma_mm: row.median_sigma_mm,
            found: row.found.clone(),
            problem: row.problem.clone(),
        }
    }

    /// Of one without.
    pub fn failed(recording: &str, fault: &Fault) -> Line {
        Line {
            recording: recording.into(),
            state: State::Failed,
            made: false,
            results: None,
            points: None,
            median_sigma_mm: None,
            found: None,
            problem: Some(Problem::from(fault)),
        }
    }
}

/// Whether such a fault follows from the recording, so that it is a result; what a machine or a disk brings about is
/// none.
pub(super) fn is_a_result(fault: &Fault) -> bool {
    matches!(fault.kind, Kind::Refused | Kind::Input | Kind::Usage)
}
