//! In: what a person may choose about a joint solve. Out: the choice, checked; the noise that is assumed.
//! Frame and unit: mm, degrees where the name says so.

use crate::calibrate::hand_eye::options::Mount;
use crate::camera::{ALWAYS_NAMED, CameraCovariance, Parameters};
use crate::fault::{Fault, Result};

/// What each source scatters by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Times a corner's stated sigma is its true one.
    pub feature: f64,
    /// Times a peak's stated sigma is its true one, speckle that neighbours share included.
    pub stripe: f64,
    /// Times a spot's stated sigma is its true one.
    pub spot: f64,
    /// The robot's position, per axis, mm.
    pub robot_mm: f64,
    /// The robot's orientation, per axis, rad.
    pub robot_rad: f64,
}

impl Noise {
    /// Before any residual is known: sigmas as they are stated, a robot of its data sheet's repeatability.
    pub fn usual() -> Noise {
        Noise { feature: 1.0, stripe: 1.0, spot: 1.0, robot_mm: 0.05, robot_rad: 2e-4 }
    }
    /// One a part, in the order of [`super::shots::Part::ALL`].
    pub fn factors(&self) -> [f64; 5] {
        [self.feature, self.stripe, self.spot, self.robot_mm, self.robot_rad]
    }
    /// From the same.
    pub(super) fn of(f: [f64; 5]) -> Noise {
        Noise { feature: f[0], stripe: f[1], spot: f[2], robot_mm: f[3], robot_rad: f[4] }
    }
}

/// What another calibration says of the camera, from pictures that are not among those solved here.
#[derive(Clone, Debug)]
pub struct CameraPrior {
    /// Its values, in the order of [`crate::camera::NAMES`].
    pub mean: Parameters,
    /// Their covariance.
    pub covariance: CameraCovariance,
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
    /// A part of a stop is left out where its squared residual, in sigmas and over its degrees of freedom, stands
    /// this far out; 4..=1000. Of six numbers one good stop in a million exceeds 6.5, of two 14.
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
