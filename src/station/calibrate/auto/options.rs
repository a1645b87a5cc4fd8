//! In: nothing. Out: options and limits of a calibration whose moves the program chooses.
//! Frame and unit: mm.

use super::super::joint::run::JointRun;
use crate::fault::{Fault, Result};
use crate::recording::BoardSpec;
use std::path::PathBuf;

/// Options of [`super::procedure::calibrate_auto`].
#[derive(Clone, Debug)]
pub struct AutoRun {
    /// How pictures are measured and the result is judged.
    pub joint: JointRun,
    /// The board below the robot.
    pub board: BoardSpec,
    /// Where the recordings go: a folder that is new or empty.
    pub out: PathBuf,
    /// Target of the expected error of a scanned point, mm rms; above 0.
    pub target_mm: f64,
    /// Most poses at which pictures are taken, including those of the check and those without a found board;
    /// 20..=200.
    pub most: usize,
    /// Depths between which points will be scanned, mm. `None`: from a fifth below to a fifth above the first depth
    /// of the board.
    pub working: Option<[f64; 2]>,
    /// Number of poses among which each next one is chosen; 20..=2000.
    pub candidates: usize,
    /// Seed of the random poses: the same seed gives the same poses.
    pub seed: u64,
}

impl AutoRun {
    /// Refuses values outside the ranges that the fields state.
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
