//! In: a robot, a camera, tabs that operate. Out: jobs that move the robot, each motion shown and confirmed by a
//! held button; releasing the button halts the arm.
//! Frame and unit: base frame; mm, mm/s, s.

mod arming;
mod brake;
mod button;
mod desk;
mod grants;
mod person;
mod session;
mod simulated;
mod state;

#[cfg(test)]
pub use button::SILENCE;
pub use desk::{Desk, Links};
#[cfg(test)]
pub use grants::{HELD, LONGEST};
pub use person::Person;
pub use session::Session;
pub use simulated::{SimulatedRobot, board};
