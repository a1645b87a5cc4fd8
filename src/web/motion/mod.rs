//! In: a robot, a camera, tabs that operate. Out: jobs that move the robot, each motion shown and confirmed by a held
//! button; what lets go halts.
//! Frame and unit: base frame; mm, mm/s, s.

mod desk;
mod grants;
mod person;
mod session;
mod simulated;

pub use desk::{Desk, Links};
pub use person::Person;
pub use session::Session;
pub use simulated::{SimulatedRobot, board};
