//! In: pictures' features, robot poses, laser peaks. Out: calibrations with covariance and verdict.
//! Frame and unit: stated in each file; mm, rad, px.

pub mod board_print;
pub mod boards;
pub mod camera;
mod camera_pictures;
pub mod camera_report;
pub mod components;
pub mod hand_eye;
pub mod hand_eye_camera;
pub mod hand_eye_checks;
pub mod hand_eye_closed;
pub mod hand_eye_expected;
mod hand_eye_noise;
pub mod hand_eye_report;
mod hand_eye_terms;
pub mod hand_eye_turns;
pub mod homography;
pub mod intrinsics;
pub mod intrinsics_quality;
pub mod laser_plane;
pub mod laser_plane_report;
mod laser_plane_terms;
pub mod lens;
pub mod limits;
pub mod measured_pose;
pub mod pointer;
pub mod pointer_range;
pub mod pointer_report;
pub mod pose;
pub mod profile_files;
pub mod profile_hand_eye;
pub mod projection;
pub mod report;
pub mod spot;
pub mod verify;
pub mod zhang;
