//! In: profiles of a ball by a line-profile sensor, robot poses. Out: the sensor's pose on the flange.
//! Frame and unit: flange_from_sensor; mm, rad (docs/math.md, Ball).

mod circle;
pub mod evaluate;
pub mod options;
mod rows;
pub mod solve;
