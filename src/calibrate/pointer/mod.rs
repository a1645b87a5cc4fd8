//! In: the pointer's spots on boards of measured pose. Out: its beam with covariance and verdict; distances by that
//! beam.
//! Frame and unit: camera frame, mm; spots in px (docs/math.md, Pointer).

pub mod beam;
mod fit;
mod patch;
pub mod range;
pub mod report;
pub mod solve;
pub mod spot;
