//! In: simulated stations, rendered recordings and photographs with known truth. Out: whether each calibration is as
//! good as it can be, says how good it is, and refuses what cannot be calibrated.
//! Frame and unit: mm, degrees, px, as each file says.

#[path = "../common/mod.rs"]
mod common;

mod axis_judge;
mod ball_judge;
mod camera_judge;
mod foreign_boards;
mod hand_eye_judge;
mod joint;
mod laser_plane_judge;
mod legacy_charuco;
mod mixed_sets;
mod photographs;
mod plane_judge;
mod pointer_judge;
mod second_look;
