//! In: nothing. Out: the input type of the solve: a picture of the stripe on a board of measured pose.
//! Frame and unit: camera frame, mm; peaks in px.

use crate::calibrate::measured_pose::MeasuredPose;
use crate::geometry::Vec2;
use crate::recording::BoardSpec;

/// One position at which the stripe was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripePeak {
    /// Position in the picture, px.
    pub pixel: Vec2,
    /// Standard deviation across the stripe, px.
    pub sigma_px: f64,
    /// Standard deviation of the stripe's intensity profile, px.
    pub width_px: f64,
}

/// One board with the stripe on it.
#[derive(Clone, Debug)]
pub struct StripeView {
    /// Pose of the board in the camera frame, as measured in the picture.
    pub pose: MeasuredPose,
    /// Print of the board: peaks at its edges are not used.
    pub board: BoardSpec,
    /// All stripe peaks of the picture, on the board and beside it.
    pub peaks: Vec<StripePeak>,
}
