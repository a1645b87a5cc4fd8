//! In: a pinhole camera with its lens. Out: pixels of points, rays of pixels, named parameters.
//! Frame and unit: camera frame (x right, y down, z forward), mm; an integer pixel is a pixel centre.

mod covariance;
mod distortion;
mod flipped;
mod intrinsics;
mod parameters;
mod readout;

pub use covariance::{CameraCovariance, named};
pub use distortion::{Distortion, TERMS};
pub use flipped::Flip;
pub use intrinsics::Intrinsics;
pub use parameters::{ALWAYS_NAMED, LENS, NAMES, PARAMETERS, ParameterMatrix, Parameters, SKEW, difference_step};
pub use readout::Readout;

#[cfg(test)]
#[path = "tests.rs"]
mod tests;
