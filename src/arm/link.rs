//! In: queries and allowed motions. Out: the interface of every link to a robot.
//! Frame and unit: base_from_flange, mm; times of this machine's monotonic clock.

use super::{Allowed, Reach, State, TimedPose};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use std::sync::Arc;

/// A variable that only a simulated controller has, and its content: it identifies a simulated one at any address.
pub const SIMULATED: [&str; 2] = ["@SIMULATED_BY", "sheetlight cell"];

/// A source of flange poses. Each has a separate connection, so that it can be read while the arm moves.
pub trait PoseSource: Send {
    /// The current pose; for poses from a file the next one.
    fn pose(&mut self) -> Result<TimedPose>;
}

/// Stops the arm, from any thread, while a motion is being executed over the link from which it was opened.
pub trait Halt: Send + Sync {
    /// Returns when the controller has accepted the order. Errors: the controller could not be reached or refused;
    /// look at the robot.
    fn halt(&self) -> Result<()>;
}

/// Switches outputs of a controller over a separate connection, so that neither a motion nor a broken link blocks
/// it.
pub trait Switch: Send {
    /// Returns when the controller has accepted the order. Errors: the controller could not be reached, or it
    /// refused; the state of the outputs is then unknown.
    fn put(&mut self, number: u16, on: bool) -> Result<()>;

    /// The state that the controller reports for an output. Errors: it does not answer, or refuses.
    fn is_on(&mut self, number: u16) -> Result<bool>;
}

/// A robot on a wire. Reading is always possible; links that only read refuse everything else.
pub trait Arm: PoseSource {
    /// The URI with which it was opened.
    fn name(&self) -> &str;

    /// Mode, motor, errors, frames.
    fn state(&mut self) -> Result<State>;

    /// Whether the controller reports that it is simulated. The address does not show it: a tunnel to a real
    /// controller also begins on this machine.
    fn simulated(&mut self) -> Result<bool> {
        Ok(false)
    }

    /// A usual assumption that the controller does not confirm, in words.
    fn unsaid(&self) -> Option<&'static str> {
        None
    }

    /// A second reader of poses over a separate connection.
    fn watch(&self) -> Result<Box<dyn PoseSource>>;

    /// What stops the arm, over a connection that no motion blocks. Errors: the link cannot move anything.
    fn stop(&self) -> Result<Arc<dyn Halt>> {
        Err(reads_only(self.name()))
    }

    /// Whether the controller can go there: reach and virtual fence.
    fn reach(&mut self, _to: &Rigid<Base, Flange>) -> Result<Reach> {
        Ok(Reach::Unasked)
    }

    /// Takes control of the arm, so that no other program moves it; sets tool and work frame to 0.
    fn take(&mut self) -> Result<()> {
        Err(reads_only(self.name()))
    }

    /// Returns control of the arm.
    fn give(&mut self) -> Result<()> {
        Ok(())
    }

    /// Executes one motion and returns when it has ended. Errors: it was not begun, or was stopped; the pose has to
    /// be read again. The kind is [`crate::fault::Kind::Refused`] if the controller answered with an error, and
    /// another one if the controller's action is unknown.
    fn make(&mut self, _allowed: Allowed) -> Result<()> {
        Err(reads_only(self.name()))
    }

    /// A switch for outputs of the controller (lasers, lamp, gripper). Errors: the link switches nothing.
    fn switch(&self) -> Result<Box<dyn Switch>> {
        Err(reads_only(self.name()))
    }

    /// Reads an input or an output of the controller.
    fn signal(&mut self, _number: u16) -> Result<bool> {
        Err(reads_only(self.name()))
    }
}

pub(super) fn reads_only(name: &str) -> Fault {
    Fault::refused(format!("{name}: this link only reads poses"))
        .cause("nothing can be moved or switched over it")
        .next("use a link that can, for example bcap://HOST:5007")
}
