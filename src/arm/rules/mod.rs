//! In: requested motions, the robot's state, a person's confirmation. Out: allowed motions, each executed once and
//! watched meanwhile; a log of all requests and motions with their reasons.
//! Frame and unit: base frame; mm, degrees. docs/robots.md has the rules. This is not a safety device: that remains
//! the controller's task.

mod carried;
mod clocks;
#[cfg(test)]
mod documented;
mod gates;
mod guard;
mod limits;
mod log;
mod pace;
mod plan;
mod standing;
mod stop;
mod straight;
mod tolerances;
mod watch;

pub use carried::Carried;
pub use gates::{Situation, gates};
pub use guard::Guard;
pub use limits::{Limits, MOST_SPEED_MM_S, Space};
pub use log::MotionLog;
pub use plan::{Confirmation, Evidence, Plan, Proposal};
pub use stop::StopButton;
pub use straight::Straight;
