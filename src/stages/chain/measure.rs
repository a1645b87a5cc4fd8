//! In: nothing. Out: what is measured at the skeleton's pixels, and with which rig.
//! Frame and unit: px, grey levels; each part says.

use crate::stages::peak::params::PeakParams;
use crate::stages::stripe::choose_params::ChooseParams;
use crate::stages::stripe::point::Optics;

/// What the chain does with the skeleton's pixels.
#[derive(Clone, Debug)]
pub struct Measure {
    /// How the sub-pixel peak is found.
    pub peak: PeakParams,
    /// Which peaks are believed.
    pub choose: ChooseParams,
    /// Camera and laser plane, camera frame.
    pub optics: Optics,
}
