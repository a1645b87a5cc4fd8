//! In: the progress of a job. Out: job.json, written before and after every motion or switching.
//! Frame and unit: base frame, mm; times UTC.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Vec3};
use crate::rig::{sealed, unsealed};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

/// The next step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// The pointer touches the board in several places.
    Touch,
    /// The camera views the board squarely, and the line sweeps over the part.
    Scan,
    /// The part is searched for in the scan.
    Find,
    /// The tool goes above the part.
    Approach,
    /// The component is inserted, and the gripper releases it.
    Insert,
    /// The tool goes back up.
    Retract,
    /// Everything is done.
    Done,
    /// The tool came back up without an insertion; nothing more is done.
    #[serde(rename = "backed_out")]
    BackedOut,
}

/// How a job continues when it is resumed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Resumes {
    /// With the next phase.
    On,
    /// It measures again, from the arm's present pose.
    Anew,
    /// At the part only the path back up is known to be free.
    Up,
    /// It cannot be resumed.
    Over,
}

/// A job on disk.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JobState {
    /// Version of this file: 2. Version 1 had no `stopped`: a stopped job had lost its phase.
    pub format: u32,
    /// Hash of the recipe's text and the station's calibrations: the poses are valid only with these.
    #[serde(default)]
    pub made_from: String,
    /// The next phase, or the one in which the job was stopped.
    pub phase: Phase,
    /// It was stopped by a person, a gate or a fault; `why` has the reason.
    pub stopped: bool,
    /// A motion was begun and its end was not recorded: the arm's pose is unknown.
    pub moving: bool,
    /// Flange pose at the job's beginning.
    pub start: Rigid<Base, Flange>,
    /// A point of the touched board and its unit normal, pointing away from it.
    pub surface: Option<[Vec3; 2]>,
    /// How often the step of the sweep was halved because a pose was too uncertain.
    #[serde(default)]
    pub halvings: u32,
    /// The shifts of the sweep, one for each time that the part extended beyond the scan's edge; base frame, mm.
    #[serde(default)]
    pub moved_mm: Vec<Vec3>,
    /// Time of the end of the scan, s since 1970.
    pub scanned_at: Option<f64>,
    /// Flange poses of approach, insertion and retract.
    pub poses: Option<[Rigid<Base, Flange>; 3]>,
    /// The gripper has released the component.
    pub released: bool,
    /// Number of confirmations by a person.
    pub confirmations: u32,
    /// Seconds of work so far, including waits for a person.
    pub seconds: f64,
    /// The same for each phase.
    #[serde(default)]
    pub seconds_by_phase: BTreeMap<Phase, f64>,
    /// The same until the approach motion had ended.
    pub seconds_to_position: Option<f64>,
    /// Number of confirmations until then.
    pub confirmations_to_position: Option<u32>,
    /// Reason of the stop; empty if it was not stopped.
    pub why: String,
}

const NAME: &str = "job.json";
const FORMAT: u32 = 2;
/// The reason of a job that came back up with its component.
pub(super) const BACKED_OUT: &str = "backed out: nothing was inserted";
const ANEW: &str = "look at the robot, then begin a new job in another folder";

impl JobState {
    /// A job that begins at the arm's present pose.
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

    /// The job in a folder; `None` if the folder holds none.
    ///
    /// # Errors
    /// A job.json that cannot be read or was changed: the arm is moved by its content.
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

    /// How the job continues when it is resumed.
    pub fn resumes(&self) -> Resumes {
        let interrupted = self.stopped || self.moving;
        match self.phase {
            Phase::Done | Phase::BackedOut => Resumes::Over,
            Phase::Retract => Resumes::Up,
            Phase::Insert if interrupted => Resumes::Up,
            // If it was stopped before that motion, the arm stands where the scan ended.
            Phase::Approach if self.moving => Resumes::Up,
            _ if interrupted => Resumes::Anew,
            _ => Resumes::On,
        }
    }

    /// Discards what was measured.
    pub(super) fn measure_anew(&mut self) {
        (self.phase, self.surface, self.poses, self.scanned_at) = (Phase::Touch, None, None, None);
        (self.halvings, self.moved_mm) = (0, vec![]);
    }

    /// Accepts only the recipe and the calibrations from which its poses were made; the way back up is allowed with
    /// any.
    ///
    /// # Errors
    /// The job was begun with another recipe or other calibrations.
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

    /// Writes job.json.
    pub fn store(&self, folder: &Path) -> Result<()> {
        crate::files::write(&folder.join(NAME), sealed(self).as_bytes())
    }
}

/// Converts a file of format 1 to the present format. A stopped job had lost its phase there; its poses at the part
/// are known from the approach on.
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
