//! In: profiles of a flat plate by a line-profile sensor, robot poses. Out: the sensor's pose on the flange.
//! Frame and unit: flange_from_sensor; mm, rad (docs/math.md, Plate).

mod average;
pub mod evaluate;
mod line;
mod next;
pub mod options;
mod rows;
pub mod solve;
mod start;
mod weak;
