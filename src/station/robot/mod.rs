//! A station's robot, opened with everything that its motion rules have to know.

mod carried;
mod guarded;

pub use carried::carried;
pub use guarded::guarded;
