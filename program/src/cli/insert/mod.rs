//! In: command-line options for insertions. Out: the procedure on recordings, and the job with a robot.
//! Frame and unit: base frame, mm.

pub mod guide;
pub mod job;
pub(in crate::cli) mod moving;
pub mod robot;
pub mod sweep;
