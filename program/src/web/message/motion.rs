//! In: nothing. Out: the state of a robot that may be moved: which tab armed it, the motion that waits for
//! confirmation, messages of the job.
//! Frame and unit: base frame; mm, degrees as the labels say, mm/s, s.

use super::GateLight;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// A motion that waits for confirmation, as it is shown.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Asked {
    /// The job that proposes it.
    pub job: String,
    /// One or two words: touch, scan, approach, insert, retract, calibrate.
    pub step: String,
    /// What was found, one sentence per line.
    pub says: Vec<String>,
    /// The question.
    pub question: String,
    /// Identifies this motion: poses, speed, reason and number.
    pub hash: String,
    /// The gates that the motion must pass, all passed.
    pub gates: Vec<GateLight>,
    /// Number of motions that are confirmed together.
    pub motions: usize,
    /// Speed of the fastest of them, mm/s.
    pub speed_mm_s: f64,
    /// Convention in which the flange's pose is written.
    pub convention: String,
    /// One label per number, with its unit.
    pub labels: Vec<String>,
    /// Final pose of the flange.
    pub numbers: Vec<f64>,
    /// The button may stay pressed from the previous motion to this one.
    pub stays_down: bool,
    /// Time within which it must be confirmed after it was shown, s.
    pub within_s: f64,
}

/// The simulated cell, if there is one.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct SimulatedCell {
    /// Parts that have a component for the gripper.
    pub parts: Vec<String>,
    /// The part whose component the gripper holds.
    pub holds: String,
    /// True: the arm is over the calibration board; false: over the part.
    pub over_board: bool,
}

/// The robot's state for motions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, TS, JsonSchema)]
pub struct MotionState {
    /// A robot is configured.
    pub robot: bool,
    /// The program was started with permission to move it.
    pub may_move: bool,
    /// A short name of the tab that armed the robot; null: it is not armed.
    pub armed: Option<String>,
    /// A confirmed motion is under way.
    pub moving: bool,
    /// Why a person must look at the robot first; null: nobody must.
    pub look: Option<String>,
    /// The job that moves the robot, or the last one that did.
    pub job: Option<String>,
    /// The motion that waits for confirmation.
    pub asked: Option<Asked>,
    /// Messages of the job so far.
    pub said: Vec<String>,
    /// Longest silence of the held button during the last motion, ms; null: there was no motion.
    pub silence_ms: Option<f64>,
    /// For a calibration: number of stops, and the error expected after them, mm.
    pub expected: Vec<(usize, f64)>,
    /// Null if the robot is not the simulated one.
    pub simulated: Option<SimulatedCell>,
}

/// Arms or disarms the robot.
#[derive(Clone, Copy, Debug, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Arming {
    /// False: disarms it.
    pub armed: bool,
}

/// An action of a person in the simulated cell.
#[derive(Clone, Debug, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InTheCell {
    /// Puts the component of this part into the gripper; null: the gripper keeps its component.
    #[serde(default)]
    #[ts(optional = nullable)]
    pub holds: Option<String>,
    /// Jogs the arm over the calibration board; false: over the part.
    #[serde(default)]
    pub over_board: bool,
}
