//! In: a job that has ended. Out: its outcome, its duration and the number of confirmations by a person.
//! Frame and unit: s; mm, degrees.

use super::state::{JobState, Phase, Resumes};
use crate::fault::Kind;
use crate::find::Report;
use std::collections::BTreeMap;

/// How a job ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Outcome {
    /// The component was released at the insertion pose, and the tool is back up.
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
    /// The kind of the fault that stopped it; `None` otherwise.
    #[serde(skip)]
    pub kind: Option<Kind>,
    /// The phase that it reached.
    pub phase: Phase,
    /// How it continues when it is resumed.
    pub resumes: Resumes,
    /// Duration of work and waits, s.
    pub seconds: f64,
    /// The same for each phase.
    pub seconds_by_phase: BTreeMap<Phase, f64>,
    /// Time from the beginning to the end of the approach, s.
    pub time_to_position_s: Option<f64>,
    /// Number of confirmations by a person until then.
    pub confirmations_to_position: Option<u32>,
    /// Number of confirmations in all.
    pub confirmations: u32,
    /// The part that was found; `None` if it was not searched for.
    pub found: Option<Report>,
}

impl JobReport {
    pub(super) fn of(state: &JobState, kind: Option<Kind>, found: Option<Report>) -> JobReport {
        let outcome = if state.phase == Phase::Done { Outcome::Inserted } else { Outcome::Stopped };
        JobReport {
            outcome,
            why: state.why.clone(),
            kind,
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

    /// What a person may do with a stopped job.
    pub fn next(&self) -> &'static str {
        match self.resumes {
            Resumes::Over => "look at the cell, then begin a new job",
            Resumes::Up => "look at the cell; resuming only moves the arm back up",
            Resumes::On | Resumes::Anew => {
                "look at the cell; resuming measures again, backing out moves the arm back up"
            }
        }
    }
}
