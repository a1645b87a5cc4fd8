//! A station's robot, opened with all inputs of its motion rules.

mod carried;
mod guarded;

pub use carried::carried;
pub use guarded::guarded;
