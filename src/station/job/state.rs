//! In: what a job has come to. Out: job.json, written before and after everything that changes the world.
//! Frame and unit: base frame, mm; times UTC.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use crate::rig::{sealed, unsealed};
use serde_json::Value;
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
    /// The tool came back up without an insertion; nothing more is done.
    #[serde(rename = "backed_out")]
    BackedOut,
}

/// How a job goes on when it is taken up again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Resumes {
    /// With the phase that is next.
    On,
    /// It measures anew, from where the arm stands.
    Anew,
    /// Down at the part there is only one way that is known to be free: back up.
    Up,
    /// Not at all.
    Over,
}

/// A job on disk.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JobState {
    /// Version of this file: 2. In 1 there was no `stopped`: a job that was stopped had forgotten its phase.
    pub format: u32,
    /// Of the recipe's text and the station's calibrations: its poses are good with these only.
    #[serde(default)]
    pub made_from: String,
    /// What is done next, or what it was stopped in.
    pub phase: Phase,
    /// It was stopped: by a person, a gate or a fault; `why` says it.
    pub stopped: bool,
    /// A motion was begun and its end was not written down: nobody knows where the arm is.
    pub moving: bool,
    /// Where the arm stood when the job was begun.
    pub start: Rigid<Base, Flange>,
    /// Of the touched board: a point and the unit normal away from it.
    pub surface: Option<[Vec3; 2]>,
    /// So often the step of its sweep was halved, because a pose was not known well enough.
    #[serde(default)]
    pub halvings: u32,
    /// So far its sweep was moved each time that the part went on beyond the rim of the scan; base frame, mm.
    #[serde(default)]
    pub moved_mm: Vec<Vec3>,
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
const FORMAT: u32 = 2;
/// Why a job ended that came back up with its component.
pub(super) const BACKED_OUT: &str = "backed out: nothing was inserted";
const ANEW: &str = "look at the robot, then begin a new job in another folder";

impl JobState {
    /// A job that begins where the arm stands.
    pub fn new(start: Rigid<Base, Flange>) -> JobState {
        JobState {
            format: FORMAT,
            made_from: String::new(),
            phase: Phase::Touch,
            stopped: false,
            moving: false,
            start,
            surface: None,
            halvings: 0,
            moved_mm: vec![],
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
        let at = path.display().to_string();
        let mut value: Value = unsealed(&text, &at).map_err(|e| e.next(ANEW))?;
        let format = value["format"].as_u64();
        match format {
            Some(1) => former(&mut value),
            Some(n) if n == u64::from(FORMAT) => {}
            _ => {
                let is = format.map_or_else(|| "none".into(), |n| n.to_string());
                return Err(Fault::input(format!("{at}: format {is}, 1 and {FORMAT} are read"))
                    .cause("another version wrote it")
                    .next(ANEW));
            }
        }
        let state = serde_json::from_value(value).map_err(|e| {
            Fault::input(format!("{at}: cannot be understood: {e}"))
                .cause("edited by hand, or another version wrote it")
                .next(ANEW)
        })?;
        Ok(Some(state))
    }

    /// How it goes on when it is taken up again.
    pub fn resumes(&self) -> Resumes {
        let interrupted = self.stopped || self.moving;
        match self.phase {
            Phase::Done | Phase::BackedOut => Resumes::Over,
            Phase::Retract => Resumes::Up,
            Phase::Insert if interrupted => Resumes::Up,
            // Stopped before it went there, it stands where the scan ended.
            Phase::Approach if self.moving => Resumes::Up,
            _ if interrupted => Resumes::Anew,
            _ => Resumes::On,
        }
    }

    /// Forgets what was measured.
    pub(super) fn measure_anew(&mut self) {
        (self.phase, self.surface, self.poses, self.scanned_at) = (Phase::Touch, None, None, None);
        (self.halvings, self.moved_mm) = (0, vec![]);
    }

    /// Goes on only with the recipe and the calibrations that its poses were made from; back up it may go with any.
    ///
    /// # Errors
    /// Another recipe or other calibrations.
    pub fn goes_on_with(&self, made_from: &str) -> Result<()> {
        let way_up = matches!(self.resumes(), Resumes::Up | Resumes::Over);
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

/// Makes a file of format 1 one of today. A job that was stopped there had forgotten its phase: poses at the part are
/// known from the
/// approach on.
fn former(value: &mut Value) {
    let was_stopped = value["phase"] == "stopped";
    if was_stopped {
        let at_the_part = !value["poses"].is_null();
        value["phase"] = match (value["why"] == BACKED_OUT, at_the_part) {
            (true, _) => "backed_out",
            (false, true) => "retract",
            (false, false) => "touch",
        }
        .into();
    }
    value["stopped"] = was_stopped.into();
    value["format"] = FORMAT.into();
}
