//! In: what a job has come to. Out: job.json, written before and after everything that changes the world.
//! Frame and unit: base frame, mm; times UTC.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use crate::rig::{sealed, unsealed};
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
    /// Of the recipe's text and the station's calibrations: its poses are good with these only.
    #[serde(default)]
    pub made_from: String,
    /// What is done next.
    pub phase: Phase,
    /// A motion was begun and its end was not written down: nobody knows where the arm is.
    pub moving: bool,
    /// Where the arm stood when the job was begun.
    pub start: Rigid<Base, Flange>,
    /// Of the touched board: a point and the unit normal away from it.
    pub surface: Option<[Vec3; 2]>,
    /// So often the step of its sweep was halved, because a pose was not known well enough.
    #[serde(default)]
    pub halvings: u32,
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
const ANEW: &str = "look at the robot, then begin a new job in another folder";

impl JobState {
    /// A job that begins where the arm stands.
    pub fn new(start: Rigid<Base, Flange>) -> JobState {
        JobState {
            format: 1,
            made_from: String::new(),
            phase: Phase::Touch,
            moving: false,
            start,
            surface: None,
            halvings: 0,
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
    /// A job.json that cannot be read, or that is not as it was written: the arm is moved by what it says.
    pub fn load(folder: &Path) -> Result<Option<JobState>> {
        let path = folder.join(NAME);
        let Some(text) = crate::files::read_text_if_there(&path)? else { return Ok(None) };
        let state: JobState = unsealed(&text, &path.display().to_string()).map_err(|e| e.next(ANEW))?;
        if state.format != 1 {
            return Err(Fault::input(format!("{}: format {}, 1 is read", path.display(), state.format))
                .cause("another version wrote it")
                .next(ANEW));
        }
        Ok(Some(state))
    }

    /// Goes on only with the recipe and the calibrations that its poses were made from; back up it may go with any.
    ///
    /// # Errors
    /// Another recipe or other calibrations.
    pub fn goes_on_with(&self, made_from: &str) -> Result<()> {
        let way_up = matches!(self.phase, Phase::Retract | Phase::Done | Phase::Stopped)
            || (self.moving && matches!(self.phase, Phase::Approach | Phase::Insert));
        if way_up || self.made_from == made_from {
            return Ok(());
        }
        let name = |hash: &str| if hash.is_empty() { "none".into() } else { format!("{hash:.12}") };
        Err(Fault::input(format!(
            "the job was begun with another recipe or other calibrations: {}, now {}",
            name(&self.made_from),
            name(made_from)
        ))
        .cause("another --recipe or --station, or one of them was changed since")
        .next("put them back, or begin a new job in another folder"))
    }

    /// Writes it down.
    pub fn store(&self, folder: &Path) -> Result<()> {
        crate::files::write(&folder.join(NAME), sealed(self).as_bytes())
    }
}
