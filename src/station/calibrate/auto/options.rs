//! In: nothing. Out: how a rig is calibrated by moves of the program's choice, within which limits.
//! Frame and unit: mm.

use super::super::joint::run::JointRun;
use crate::fault::{Fault, Result};
use crate::recording::BoardSpec;
use std::path::PathBuf;

/// How [`super::procedure::calibrate_auto`] is run.
#[derive(Clone, Debug)]
pub struct AutoRun {
    /// How pictures are measured and the result is judged.
    pub joint: JointRun,
    /// The board below the robot.
    pub board: BoardSpec,
    /// Where the recordings go: a folder that is new or empty.
    pub out: PathBuf,
    /// Expected error of a scanned point at which it is enough, mm rms; above 0.
    pub target_mm: f64,
    /// Poses at which pictures are taken at most, those of the check and those from which the board is not found
    /// included; 20..=200.
    pub most: usize,
    /// Depths between which points will be scanned, mm; where nobody states them a fifth to both sides of the board
    /// as it is first seen.
    pub working: Option<[f64; 2]>,
    /// Poses among which each next one is chosen; 20..=2000.
    pub candidates: usize,
    /// Same seed, same poses.
    pub seed: u64,
}

impl AutoRun {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        self.joint.asked.check()?;
        let ranges = [
            ("target_mm", self.target_mm, 1e-6, 1e3),
            ("most", self.most as f64, 20.0, 200.0),
            ("candidates", self.candidates as f64, 20.0, 2000.0),
        ];
        match ranges.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed"))
                    .next("choose a value in that range"))
            }
            None => Ok(()),
        }
    }
}
