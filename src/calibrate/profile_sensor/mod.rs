//! In: profiles of a line-profile sensor, robot poses. Out: the sensor's pose on the flange from a target that stands
//! still: a ball, or a flat plate.
//! Frame and unit: flange_from_sensor; mm, rad (docs/math.md, Ball, Plate).

pub mod ball;
pub mod found;
mod likelihood;
pub mod missing;
pub mod plane;
mod ranges;
mod selection;
