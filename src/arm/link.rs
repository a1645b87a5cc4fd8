//! In: questions and allowed motions. Out: what every link to a robot answers.
//! Frame and unit: base_from_flange, mm; times of this machine's monotonic clock.

use super::{Allowed, Reach, State, TimedPose};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use std::sync::Arc;

/// The variable that only a simulated controller has, and what it holds: so a link knows it, whatever its address.
pub const SIMULATED: [&str; 2] = ["@SIMULATED_BY", "sheetlight cell"];

/// Something that says where a flange is. Each has a connection of its own, so that one can be read while the arm
/// moves.
pub trait PoseSource: Send {
    /// The pose now; for poses from a file the next one.
    fn pose(&mut self) -> Result<TimedPose>;
}

/// Stops the arm, from any thread, while a motion is under way on the link that it came from.
pub trait Halt: Send + Sync {
    /// Returns when the controller has taken the order. Errors: it could not be told; look at the robot.
    fn halt(&self) -> Result<()>;
}

/// Switches outputs of a controller over a connection of its own: neither a motion nor a link that was cut is in its
/// way.
pub trait Switch: Send {
    /// Returns when the controller has taken the order. Errors: it could not be told, or it refused; nobody knows then
    /// what is on.
    fn put(&mut self, number: u16, on: bool) -> Result<()>;

    /// What the controller says of an output. Errors: it does not answer, or refuses.
    fn is_on(&mut self, number: u16) -> Result<bool>;
}

/// A robot on a wire. Reading is always possible; what changes the world is refused by links that only read.
pub trait Arm: PoseSource {
    /// The URI that it was opened with.
    fn name(&self) -> &str;

    /// Mode, motor, errors, frames.
    fn state(&mut self) -> Result<State>;

    /// The controller says that it is a simulated one. An address says nothing: a tunnel to a real one begins on this
    /// machine too.
    fn simulated(&mut self) -> Result<bool> {
        Ok(false)
    }

    /// What people take for granted and the controller does not say, in words.
    fn unsaid(&self) -> Option<&'static str> {
        None
    }

    /// A second reader of poses over a connection of its own.
    fn watch(&self) -> Result<Box<dyn PoseSource>>;

    /// What stops it, over a connection that no motion blocks. Errors: a link that cannot move anything.
    fn stop(&self) -> Result<Arc<dyn Halt>> {
        Err(reads_only(self.name()))
    }

    /// Whether the controller would go there: reach and virtual fence.
    fn reach(&mut self, _to: &Rigid<Base, Flange>) -> Result<Reach> {
        Ok(Reach::Unasked)
    }

    /// Takes the arm, so that no other program moves it; tool and work frame are 0 from then on.
    fn take(&mut self) -> Result<()> {
        Err(reads_only(self.name()))
    }

    /// Gives the arm back.
    fn give(&mut self) -> Result<()> {
        Ok(())
    }

    /// Makes one motion and returns when it has ended. Errors: it was not begun, or was stopped; the pose has to be
    /// read again. Of kind [`crate::fault::Kind::Refused`] where the controller answered with an error, of another
    /// where nobody knows what it did.
    fn make(&mut self, _allowed: Allowed) -> Result<()> {
        Err(reads_only(self.name()))
    }

    /// What switches outputs of the controller (lasers, lamp, gripper). Errors: a link that switches nothing.
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
