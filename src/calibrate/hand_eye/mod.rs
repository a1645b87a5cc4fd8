//! In: board poses and the robot's poses. Out: where the camera sits on the flange (or in the base), with covariance.
//! Frame and unit: see `closed`; mm, rad (docs/math.md, Hand-eye).

pub mod camera_belief;
pub mod chance;
pub mod checks;
pub mod closed;
pub mod expected;
pub mod fit;
mod noise;
pub mod options;
pub mod otherwise;
pub mod report;
pub mod solve;
mod terms;
pub mod turns;
