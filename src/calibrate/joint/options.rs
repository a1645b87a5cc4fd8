//! In: a user's settings for the joint solve. Out: the checked settings, and the assumed noise.
//! Frame and unit: mm; degrees where the name states them.

use crate::calibrate::hand_eye::options::Mount;
use crate::camera::{ALWAYS_NAMED, CameraCovariance, Parameters};
use crate::fault::{Fault, Result};

/// Noise of each source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Factor from a corner's stated sigma to its true one.
    pub feature: f64,
    /// Factor from a peak's stated sigma to its true one; includes the speckle that neighbours share.
    pub stripe: f64,
    /// Factor from a spot's stated sigma to its true one.
    pub spot: f64,
    /// Sigma of the robot's position, per axis, mm.
    pub robot_mm: f64,
    /// Sigma of the robot's orientation, per axis, rad.
    pub robot_rad: f64,
}

impl Noise {
    /// Start values before residuals are known: the stated sigmas, and a robot with the repeatability of its data
    /// sheet.
    pub fn usual() -> Noise {
        Noise { feature: 1.0, stripe: 1.0, spot: 1.0, robot_mm: 0.05, robot_rad: 2e-4 }
    }
    /// One value per part, in the order of [`super::shots::Part::ALL`].
    pub fn factors(&self) -> [f64; 5] {
        [self.feature, self.stripe, self.spot, self.robot_mm, self.robot_rad]
    }
    /// The inverse of [`Noise::factors`].
    pub(super) fn of(f: [f64; 5]) -> Noise {
        Noise { feature: f[0], stripe: f[1], spot: f[2], robot_mm: f[3], robot_rad: f[4] }
    }
}

/// The result of another calibration of the camera, from pictures that are not part of this solve.
#[derive(Clone, Debug)]
pub struct CameraPrior {
    /// The camera's parameters, in the order of [`crate::camera::NAMES`].
    pub mean: Parameters,
    /// Their covariance.
    pub covariance: CameraCovariance,
}

/// Settings of [`super::solve::solve`].
#[derive(Clone, Debug)]
pub struct JointOptions {
    /// What carries the camera.
    pub mount: Mount,
    /// The camera's free parameters, indices into [`crate::camera::NAMES`]; the others keep their values.
    pub camera_free: Vec<usize>,
    /// Prior for a camera that was calibrated from other pictures.
    pub camera_prior: Option<CameraPrior>,
    /// A part of a stop is excluded if its squared residuals over their degrees of freedom exceed this multiple of
    /// the usual value; 4..=1000. One good stop in a million exceeds 6.5 for six numbers, and 14 for two.
    pub gate: f64,
    /// Length of a corner's or a peak's residual, in sigmas, beyond which its pull no longer grows; 1.5..=20.
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
    /// Refuses values outside the ranges stated at the fields.
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
