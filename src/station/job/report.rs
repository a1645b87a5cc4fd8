//! In: a job that has ended. Out: what came of it, how long it took and what a person had to do.
//! Frame and unit: s; mm, degrees.

use super::state::{JobState, Phase, Resumes};
use crate::find::Report;
use std::collections::BTreeMap;

/// How a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The component was let go at the insertion pose, and the tool is back up.
    Inserted,
    /// Nothing was inserted; the arm stands still.
    Stopped,
}

/// Content of report.json of a job.
#[derive(Clone, Debug, serde::Serialize)]
pub struct JobReport {
    /// How it ended.
    pub outcome: Outcome,
    /// Why it was stopped; empty otherwise.
    pub why: String,
    /// Where it came to.
    pub phase: Phase,
    /// How it goes on when it is taken up again.
    pub resumes: Resumes,
    /// Work and waits, s.
    pub seconds: f64,
    /// The same by step.
    pub seconds_by_phase: BTreeMap<Phase, f64>,
    /// From the beginning to the confirmed insertion pose, s.
    pub time_to_position_s: Option<f64>,
    /// Times a person was asked until then.
    pub confirmations_to_position: Option<u32>,
    /// Times a person was asked in all.
    pub confirmations: u32,
    /// What was found of the part, where it was looked for.
    pub found: Option<Report>,
}

impl JobReport {
    pub(super) fn of(state: &JobState, found: Option<Report>) -> JobReport {
        let outcome = if state.phase == Phase::Done { Outcome::Inserted } else { Outcome::Stopped };
        JobReport {
            outcome,
            why: state.why.clone(),
            phase: state.phase,
            resumes: state.resumes(),
            seconds: state.seconds,
            seconds_by_phase: state.seconds_by_phase.clone(),
            time_to_position_s: state.seconds_to_position,
            confirmations_to_position: state.confirmations_to_position,
            confirmations: state.confirmations,
            found,
        }
    }

    /// What a person may do with a job that was stopped.
    pub fn next(&self) -> &'static str {
        match self.resumes {
            Resumes::Over => "look at the cell, then begin a new job",
            Resumes::Up => "look at the cell; resumed it goes back up, nothing else",
            Resumes::On | Resumes::Anew => "look at the cell; resumed it measures again, backed out of it goes back up",
        }
    }
}
