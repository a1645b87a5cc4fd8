//! In: nothing. Out: settings of the measurement at the skeleton pixels, and the rig. Frame and unit: px, grey levels;
//! stated at each part.

use crate::stages::peak::params::PeakParams;
use crate::stages::stripe::choose_params::ChooseParams;
use crate::stages::stripe::point::Optics;

/// What the chain computes at the skeleton pixels.
#[derive(Clone, Debug)]
pub struct Measure {
    /// Settings of the sub-pixel peaks.
    pub peak: PeakParams,
    /// Tests that peaks must pass.
    pub choose: ChooseParams,
    /// Camera and laser plane, in the camera frame.
    pub optics: Optics,
}
