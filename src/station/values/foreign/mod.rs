//! Camera calibrations as other programs write them: OpenCV, ROS, Kalibr, MATLAB, HALCON.

mod cameras;
mod halcon;
mod keys;
mod lens;
mod projection;
mod tree;
mod write;

pub use cameras::camera;
pub use write::{Format, written};
