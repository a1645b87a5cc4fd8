//! In: nothing. Out: a job as stored on disk and shown by pages, and the events sent while it runs.
//! Frame and unit: times in UTC, RFC 3339.

use super::{Bar, MotionState, Order, Outcome};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::fault::{Fault, Kind};
use ts_rs::TS;

/// State of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobState {
    /// Waits for earlier jobs.
    Queued,
    /// Is running.
    Running,
    /// Ended with a result.
    Done,
    /// Ended with a fault.
    Failed,
    /// Ended by the operator; finished steps are stored.
    Stopped,
    /// The program ended while it ran; it can be resumed or abandoned.
    CutOff,
}

/// What to do if the disk is full.
const MAKE_ROOM: &str = "take old jobs away on the page Replay (the × behind each), or free space otherwise; then \
                         resume this job, or order it again";

/// A fault as pages show it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Problem {
    /// usage, input, refused, output or device.
    pub kind: String,
    /// What happened, with the value and the limit.
    pub what: String,
    /// Likely cause; may be empty.
    pub cause: String,
    /// Next step; may be empty.
    pub next: String,
}

impl From<&Fault> for Problem {
    fn from(f: &Fault) -> Problem {
        let kind = match f.kind {
            Kind::Usage => "usage",
            Kind::Input => "input",
            Kind::Refused => "refused",
            Kind::Output => "output",
            Kind::Device => "device",
        };
        // Operators cannot pass --out; they have jobs.
        let next = if f.is_full_disk() { MAKE_ROOM } else { &f.next };
        Problem { kind: kind.into(), what: f.what.clone(), cause: f.cause.clone(), next: next.into() }
    }
}

/// One run of a procedure; `job.json` in its folder holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Job {
    /// Version of job.json: 1.
    pub format: u32,
    /// Name of the job's folder, e.g. `0007-scan`.
    pub id: String,
    /// What was ordered.
    pub order: Order,
    /// State of the job.
    pub state: JobState,
    /// Steps done (shots, pictures, checks).
    pub done: usize,
    /// Steps in total; null while unknown.
    pub of: Option<usize>,
    /// When it was ordered.
    pub created: String,
    /// Run time, s.
    pub seconds: f64,
    /// Why it failed.
    pub problem: Option<Problem>,
    /// The result.
    pub outcome: Option<Outcome>,
    /// Steps of an interrupted run are stored: resuming continues from them.
    pub resumable: bool,
}

/// An event sent over a page's WebSocket.
#[derive(Clone, Debug, Serialize, TS, JsonSchema)]
#[serde(tag = "event", content = "data", rename_all = "snake_case")]
pub enum Event {
    /// Sent first, and again after events were missed: the complete state.
    State {
        /// The bar.
        bar: Bar,
        /// Newest first, at most 200.
        jobs: Vec<Job>,
        /// The robot's state for motions.
        motion: Box<MotionState>,
    },
    /// Sent once a second, and when something in the bar changes.
    Bar(Bar),
    /// A job began, went on or ended.
    Job(Box<Job>),
    /// Arming, the motion that waits for confirmation, messages of a job.
    Motion(Box<MotionState>),
    /// A job was removed.
    Gone(String),
}
