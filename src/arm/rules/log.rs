//! In: what was requested of the arm and its outcome. Out: one line of JSON for each, on disk before anything
//! moves.
//! Frame and unit: base_from_flange as 16 numbers, mm; mm/s; times UTC.

use super::plan::Proposal;
use crate::fault::Result;
use std::path::{Path, PathBuf};

/// The log of a robot's motions; lines are only appended.
#[derive(Clone, Debug, Default)]
pub struct MotionLog {
    path: Option<PathBuf>,
}

#[derive(serde::Serialize)]
struct Line<'a> {
    at: String,
    event: &'a str,
    name: &'a str,
    why: &'a str,
    hash: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    to: Option<Vec<[f64; 16]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_mm_s: Option<f64>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    reasons: Vec<String>,
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    unjudged: &'a [String],
}

impl MotionLog {
    /// A log that is written to a file.
    pub fn file(path: &Path) -> MotionLog {
        MotionLog { path: Some(path.to_owned()) }
    }

    fn add(&self, line: &Line) -> Result<()> {
        let Some(path) = &self.path else { return Ok(()) };
        crate::files::append_line(path, &serde_json::to_string(line).expect("plain data"))
    }

    /// Logs an event of a proposal: asked, refused, begun, not begun, done, stopped.
    pub fn note(&self, event: &str, of: &Proposal, reasons: Vec<String>) -> Result<()> {
        let asked = event == "asked";
        let plan = &of.plan;
        self.add(&Line {
            at: jiff::Timestamp::now().to_string(),
            event,
            name: &plan.name,
            why: &plan.why,
            hash: &of.hash,
            to: asked.then(|| plan.legs.iter().map(|leg| leg.to.to_rows()).collect()),
            speed_mm_s: asked.then(|| plan.legs.iter().map(|leg| leg.speed_mm_s).fold(0.0, f64::max)),
            reasons,
            unjudged: if asked { &of.unjudged } else { &[] },
        })
    }
}
