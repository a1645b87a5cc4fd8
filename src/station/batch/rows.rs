//! What came of a batch: one row a recording. Poses are in the robot's notation, lengths in mm, angles in degrees.

use super::repeats::{Placed, Repeats};
use crate::find::Report;
use std::path::PathBuf;

/// What came of one recording.
#[derive(Clone, Debug, serde::Serialize)]
pub struct BatchRow {
    /// Its folder.
    pub recording: PathBuf,
    /// Folder of its scan, within the batch's.
    pub scan: String,
    /// Why it came to nothing, or to no place; none: it did.
    pub problem: Option<String>,
    /// Points of the cloud.
    pub points: Option<u64>,
    /// Median of the points' own standard deviations, mm.
    pub median_sigma_mm: Option<f64>,
    /// Share of the map's cells that were measured.
    pub coverage: Option<f64>,
    /// From the first shot to the closed cloud, s.
    pub seconds: Option<f64>,
    /// Where the part lies.
    pub found: Option<FoundAt>,
}

/// A place that was found, whether or not its gates let a pose pass.
#[derive(Clone, Debug, serde::Serialize)]
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

/// A batch that was run.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Batch {
    /// Version of this file: 1.
    pub format: u32,
    /// Name of the recipe; none: nothing was looked for.
    pub recipe: Option<String>,
    /// One a recording, in their order.
    pub rows: Vec<BatchRow>,
    /// Of the places that were found; none of fewer than two.
    pub repeats: Option<Repeats>,
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
    pub(super) fn placed(&self) -> Option<Placed> {
        Placed::of(&self.part, self.sigma_mm, self.sigma_deg)
    }
}
