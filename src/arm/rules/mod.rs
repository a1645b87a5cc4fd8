//! In: motions that someone asks for, the robot's state, a person's confirmation. Out: motions that were allowed,
//! made once, watched while they are made; a log of all that was asked and made, with its reason.
//! Frame and unit: base frame; mm, degrees; docs/robots.md has the rules. No safety device: that stays with the
//! controller.

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
