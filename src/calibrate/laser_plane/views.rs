//! In: nothing. Out: a picture of the stripe on a board of measured pose, as the solve takes it.
//! Frame and unit: camera frame, mm; peaks in px.

use crate::calibrate::measured_pose::MeasuredPose;
use crate::geometry::Vec2;
use crate::recording::BoardSpec;

/// One place where the stripe was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripePeak {
    /// px.
    pub pixel: Vec2,
    /// Standard deviation across the stripe, px.
    pub sigma_px: f64,
    /// Standard deviation of the stripe's own profile, px.
    pub width_px: f64,
}

/// One board with the stripe on it.
#[derive(Clone, Debug)]
pub struct StripeView {
    /// The board before the camera, as the picture measured it.
    pub pose: MeasuredPose,
    /// How it is printed: peaks at its edges do not count.
    pub board: BoardSpec,
    /// The stripe's peaks in the whole picture, on the board and beside it.
    pub peaks: Vec<StripePeak>,
}
