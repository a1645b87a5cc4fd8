//! In: stripe peaks on boards of measured pose. Out: the laser plane with covariance and verdict.
//! Frame and unit: camera frame, mm; peaks in px (docs/math.md, Laser plane).

pub(in crate::calibrate) mod agree;
mod checks;
pub mod options;
pub mod report;
pub mod solve;
pub(in crate::calibrate) mod terms;
pub mod views;
