//! In: nothing. Out: what the calibration on any target yields.
//! Frame and unit: flange_from_sensor; mm, rad.

use crate::geometry::{Flange, Rigid, Sensor};
use crate::solve::End;
use nalgebra::DMatrix;

/// Residuals of one profile.
#[derive(Clone, Debug)]
pub struct ProfileResidual {
    /// Name of the profile.
    pub name: String,
    /// True if the profile is in the fit; false if it was excluded.
    pub used: bool,
    /// Number of points on the target, and number of points in the profile.
    pub points: [usize; 2],
    /// Distance from the fitted target, mm: of a ball the length of the residual of centre and radius, of a plate the
    /// rms of the points' distances.
    pub mm: f64,
    /// The same with the profile excluded from the fit, mm; infinite if the others determine no fit.
    pub holdout_mm: f64,
    /// Squared Mahalanobis distance.
    pub distance2: f64,
    /// Why it was excluded, where it was never compared with the others.
    pub why: Option<String>,
}

/// What every target yields.
#[derive(Clone, Debug)]
pub struct SensorFit {
    /// Pose of the sensor on the flange, mm.
    pub flange_from_sensor: Rigid<Flange, Sensor>,
    /// tx ty tz (mm) rx ry rz (rad, left, flange frame), then three numbers of the target: 9x9.
    pub covariance: DMatrix<f64>,
    /// Sigma of a profile point, mm.
    pub point_sigma: f64,
    /// Sigma of the robot's position, estimated from the target, per axis, mm.
    pub robot_sigma: f64,
    /// One entry per profile, in the order given.
    pub profiles: Vec<ProfileResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// Whether the fit is a minimum.
    pub end: End,
}
