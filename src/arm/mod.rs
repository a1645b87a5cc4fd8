//! In: the address of a robot's controller (a URI). Out: its state, its pose with the time it was read, execution
//! of allowed motions. One trait for all links; a link that only reads is never armed.
//! Frame and unit: poses base_from_flange; mm, radians; speeds mm/s.

mod denso;
mod file;
mod link;
mod motion;
mod outputs;
pub mod rules;
mod state;
mod switchboard;
pub mod ur;
mod uri;

pub use link::{Arm, Halt, PoseSource, SIMULATED, Switch};
pub use motion::{Allowed, Motion, Pace, Way};
pub use outputs::Outputs;
pub use state::{ControllerError, Mode, Reach, State, TimedPose};
pub use switchboard::Switchboard;
pub use uri::{RobotUri, open};
