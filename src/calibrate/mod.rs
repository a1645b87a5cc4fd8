//! In: features of pictures, robot poses, laser peaks. Out: calibrations with covariance and verdict.
//! Frame and unit: stated in each file; mm, rad, px. One module per calibrated object; shared code lies beside
//! them.

pub mod axis;
pub mod boards;
pub mod camera;
pub mod components;
pub mod hand_eye;
pub mod homography;
pub mod joint;
pub mod laser_plane;
pub mod latency;
pub mod limits;
pub mod measured_pose;
pub mod pointer;
pub mod pose;
pub mod profile_sensor;
pub mod projection;
pub mod report;
pub mod scatter;
pub mod verify;
