//! In: nothing. Out: what pages see of a robot that may be moved: who armed it, the motion that waits for a person,
//! what was said.
//! Frame and unit: base frame; mm, degrees as the labels say, mm/s, s.

use super::GateLight;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// A motion that waits for a person, as it is shown.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Asked {
    /// The job that asks.
    pub job: String,
    /// One or two words: touch, scan, approach, insert, retract, calibrate.
    pub step: String,
    /// What was found, a sentence a line.
    pub says: Vec<String>,
    /// The question.
    pub question: String,
    /// Names this motion and no other: poses, speed, reason and number.
    pub hash: String,
    /// What it has to keep, all of it kept.
    pub gates: Vec<GateLight>,
    /// Motions that are confirmed as one.
    pub motions: usize,
    /// The fastest of them, mm/s.
    pub speed_mm_s: f64,
    /// How the flange's pose is written.
    pub convention: String,
    /// One a number, with its unit.
    pub labels: Vec<String>,
    /// Where the flange ends.
    pub numbers: Vec<f64>,
    /// The button may stay down from the motion before to this one.
    pub stays_down: bool,
    /// It has to be confirmed within so long after it was shown, s.
    pub within_s: f64,
}

/// The simulated cell, where there is one.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct SimulatedCell {
    /// Parts whose component the gripper can hold.
    pub parts: Vec<String>,
    /// Whose it holds.
    pub holds: String,
    /// The arm stands over the part, or over the calibration board.
    pub over_board: bool,
}

/// The robot as it may be moved from here.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS)]
pub struct MotionState {
    /// A robot was named.
    pub robot: bool,
    /// The program was started with leave to move it.
    pub may_move: bool,
    /// A short name of the tab that armed it; null: it is not armed.
    pub armed: Option<String>,
    /// A confirmed motion is under way.
    pub moving: bool,
    /// Why somebody has to look at the robot first; null: nobody has to.
    pub look: Option<String>,
    /// The job that moves it, or the last one that did.
    pub job: Option<String>,
    /// What waits for a person.
    pub asked: Option<Asked>,
    /// What the job said so far.
    pub said: Vec<String>,
    /// While the last motion was made: the longest that nothing was heard of the held button, ms; null: none was made.
    pub silence_ms: Option<f64>,
    /// Of a calibration: stops so far, expected error then, mm.
    pub expected: Vec<(usize, f64)>,
    /// Null: the robot is none of ours.
    pub simulated: Option<SimulatedCell>,
}

/// Arms, or gives the arm back.
#[derive(Clone, Copy, Debug, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct Arming {
    /// False: gives it back.
    pub armed: bool,
}

/// What a person does in the simulated cell.
#[derive(Clone, Debug, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct InTheCell {
    /// Puts the component that belongs to this part into the gripper; null: what it holds stays.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub holds: Option<String>,
    /// Jogs the arm over the calibration board, else over the part.
    #[serde(default)]
    pub over_board: bool,
}
