//! In: a person's choices for a simulated cell. Out: the same, checked.
//! Frame and unit: mm, degrees; see each field.

use sheetlight::arm::Outputs;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::BoardSpec;
use sheetlight::simulate::{RigSpec, SceneSpec};

/// Content of the cell and its accuracy.
#[derive(Clone, Debug)]
pub struct CellOptions {
    /// The scene before the robot.
    pub scene: SceneSpec,
    /// A calibration board beside the scene.
    pub board: Option<BoardSpec>,
    /// The arm starts over the board, as jogged there by an operator for calibration; otherwise over the scene.
    pub over_board: bool,
    /// The sensor is fixed in the cell and the flange carries board and scene before it.
    pub eye_to_hand: bool,
    /// The design of the sensor.
    pub rig: RigSpec,
    /// Seed of specimen, poses and noise; 0 is the nominal design.
    pub seed: u64,
    /// Seconds of the cell per real second, 0.1 to 1000.
    pub speed: f64,
    /// Repeatability: deviation of the arm's true pose from the reported one, 1 sigma per axis, mm, 0 to 1 ...
    pub noise_mm: f64,
    /// ... and degrees, 0 to 1.
    pub noise_deg: f64,
    /// Largest error of each link length of the arm, mm, 0 to 2 ...
    pub arm_error_mm: f64,
    /// ... and of each joint's zero, degrees, 0 to 1.
    pub arm_error_deg: f64,
    /// Largest tilt of the scene relative to the base, degrees, 0 to 15.
    pub tilt_deg: f64,
    /// Name of the part whose component is in the gripper; `None`: the first part that has holes.
    pub holds: Option<String>,
    /// Frame rate of the camera, pictures per second of the cell, 1 to 2000.
    pub fps: f64,
    /// Delay of the time stamps of the camera's pictures, ms, -1000 to 1000.
    pub camera_delay_ms: f64,
    /// Numbers of the outputs for lasers, lamp and gripper.
    pub outputs: Outputs,
}

impl CellOptions {
    /// A cell with a scene, and a good arm's values for all other options.
    pub fn of(scene: SceneSpec, seed: u64) -> CellOptions {
        CellOptions {
            scene,
            board: None,
            over_board: false,
            eye_to_hand: false,
            rig: RigSpec::paper(),
            seed,
            speed: 1.0,
            noise_mm: 0.02,
            noise_deg: 0.004,
            arm_error_mm: 0.0,
            arm_error_deg: 0.0,
            tilt_deg: 2.0,
            holds: None,
            fps: 100.0,
            camera_delay_ms: 0.0,
            outputs: Outputs::default(),
        }
    }

    /// Returns an error for a number outside the range that its field states.
    pub fn check(&self) -> Result<()> {
        if self.over_board && self.board.is_none() {
            return Err(Fault::usage("the arm shall begin over the board, but there is no board")
                .next("name one with --board (sheetlight board writes it)"));
        }
        if self.eye_to_hand && (self.board.is_none() || self.over_board) {
            return Err(Fault::usage(
                "the flange shall carry a board before the sensor, but no board is given or the arm shall begin over \
                 it",
            )
            .next("give a board, and omit --over-board"));
        }
        let limits = [
            ("speed", self.speed, 0.1, 1000.0),
            ("noise in mm", self.noise_mm, 0.0, 1.0),
            ("noise in degrees", self.noise_deg, 0.0, 1.0),
            ("arm error in mm", self.arm_error_mm, 0.0, 2.0),
            ("arm error in degrees", self.arm_error_deg, 0.0, 1.0),
            ("tilt in degrees", self.tilt_deg, 0.0, 15.0),
            ("fps", self.fps, 1.0, 2000.0),
            ("camera delay in ms", self.camera_delay_ms, -1e3, 1e3),
        ];
        match limits.iter().find(|(_, v, low, high)| !(*low..=*high).contains(v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, allowed {low}..={high}")).next("correct the option"))
            }
            None => Ok(()),
        }
    }
}
