//! In: what a person may choose about a joint solve. Out: the choice, checked.
//! Frame and unit: mm, degrees where the name says so.

use crate::calibrate::hand_eye::options::Mount;
use crate::camera::{ALWAYS_NAMED, ParameterCovariance, Parameters};
use crate::fault::{Fault, Result};

/// What another calibration says of the camera, from pictures that are not among those solved here.
#[derive(Clone, Debug)]
pub struct CameraPrior {
    /// Its values, in the order of [`crate::camera::NAMES`].
    pub mean: Parameters,
    /// Their covariance.
    pub covariance: ParameterCovariance,
}

/// Settings of [`super::solve::solve`].
#[derive(Clone, Debug)]
pub struct JointOptions {
    /// Who carries the camera.
    pub mount: Mount,
    /// The camera's free parameters, indices into [`crate::camera::NAMES`]; the others keep their values.
    pub camera_free: Vec<usize>,
    /// Of a camera that was calibrated from other pictures.
    pub camera_prior: Option<CameraPrior>,
    /// A part of a stop is left out where its squared residual, in sigmas and over its degrees of freedom, stands this far
    /// out; 4..=1000. Of six numbers one good stop in a million exceeds 6.5, of two 14.
    pub gate: f64,
    /// Length of a corner's or a peak's residual, in sigmas, from which it pulls no harder; 1.5..=20.
    pub huber: f64,
}

impl Default for JointOptions {
    fn default() -> Self {
        JointOptions {
            mount: Mount::EyeInHand,
            camera_free: (0..ALWAYS_NAMED).collect(),
            camera_prior: None,
            gate: 9.0,
            huber: 3.0,
        }
    }
}

impl JointOptions {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let ranges = [("gate", self.gate, 4.0, 1000.0), ("huber", self.huber, 1.5, 20.0)];
        match ranges.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed"))
                    .next("choose a value in that range"))
            }
            None => Ok(()),
        }
    }
}
