//! In: what a job has come to. Out: job.json, written before and after everything that changes the world.
//! Frame and unit: base frame, mm; times UTC.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use std::collections::BTreeMap;
use std::path::Path;

/// What is done next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// The pointer touches the board in several places.
    Touch,
    /// The sensor looks squarely, and the line sweeps over the part.
    Scan,
    /// The part is looked for in the scan.
    Find,
    /// The tool goes above the part.
    Approach,
    /// The component goes in, and the gripper lets it go.
    Insert,
    /// The tool goes back up.
    Retract,
    /// Everything is done.
    Done,
    /// It ended without insertion; nothing more is done.
    Stopped,
}

/// A job on disk.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JobState {
    /// Version of this file: 1.
    pub format: u32,
    /// What is done next.
    pub phase: Phase,
    /// A motion was begun and its end was not written down: nobody knows where the arm is.
    pub moving: bool,
    /// Where the arm stood when the job was begun.
    pub start: Rigid<Base, Flange>,
    /// Of the touched board: a point and the unit normal away from it.
    pub surface: Option<[Vec3; 2]>,
    /// When the scan was finished, s since 1970.
    pub scanned_at: Option<f64>,
    /// Flange at approach, insertion and retract.
    pub poses: Option<[Rigid<Base, Flange>; 3]>,
    /// The gripper has let the component go.
    pub released: bool,
    /// Times that a person was asked and said yes.
    pub confirmations: u32,
    /// Seconds of work so far, the waits for a person included.
    pub seconds: f64,
    /// The same by phase.
    #[serde(default)]
    pub seconds_by_phase: BTreeMap<Phase, f64>,
    /// The same until the insertion pose was confirmed.
    pub seconds_to_position: Option<f64>,
    /// Confirmations until then.
    pub confirmations_to_position: Option<u32>,
    /// Why it was stopped; empty while it was not.
    pub why: String,
}

const NAME: &str = "job.json";

impl JobState {
    /// A job that begins where the arm stands.
    pub fn new(start: Rigid<Base, Flange>) -> JobState {
        JobState {
            format: 1,
            phase: Phase::Touch,
            moving: false,
            start,
            surface: None,
            scanned_at: None,
            poses: None,
            released: false,
            confirmations: 0,
            seconds: 0.0,
            seconds_by_phase: BTreeMap::new(),
            seconds_to_position: None,
            confirmations_to_position: None,
            why: String::new(),
        }
    }

    /// The job in a folder; `None` where none was begun there.
    ///
    /// # Errors
    /// A job.json that cannot be read.
    pub fn load(folder: &Path) -> Result<Option<JobState>> {
        let path = folder.join(NAME);
        let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
        let state: JobState = serde_json::from_str(&text).map_err(|e| {
            Fault::input(format!("{}: is not a job: {e}", path.display()))
                .cause("it was edited, or another version wrote it")
                .next("look at the robot, then begin a new job in another folder")
        })?;
        if state.format != 1 {
            return Err(Fault::input(format!("{}: format {}, 1 is read", path.display(), state.format))
                .cause("another version wrote it")
                .next("begin a new job in another folder"));
        }
        Ok(Some(state))
    }

    /// Writes it down.
    pub fn store(&self, folder: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self).expect("plain data");
        crate::files::write(&folder.join(NAME), text.as_bytes())
    }
}
