//! In: a scene and a seed. Out: a simulated robot cell: arm, controller, camera, lasers, gripper, at the level of
//! their wires; and a judge of what was done.
//! Frame and unit: base frame; mm, radians; s of the cell's time.

mod camera;
#[allow(clippy::module_inception, reason = "the room's one thing")]
mod cell;
mod clock;
mod component;
pub mod controller;
mod judge;
mod kinematics;
mod log;
mod options;
mod serve;
mod trajectory;
mod world;

pub use cell::{Cell, Over};
pub use clock::Clock;
pub use kinematics::{ArmError, Joints, Unreachable, Vs060};
pub use log::{Entry, Event, Insertion};
pub use options::CellOptions;
pub use serve::{Faults, Served};
