//! In: a board's poses at stops of a linear axis or turntable. Out: the axis with covariance and verdict.
//! Frame and unit: camera frame, mm, rad, counts (docs/math.md, Axis).

mod checks;
pub mod fit;
mod noise;
pub mod report;
pub mod solve;
mod start;
mod terms;
