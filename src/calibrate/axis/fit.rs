//! In: the stops of an axis, each with a board and a count. Out: the fitted axis, and the position error that it
//! causes at a part.
//! Frame and unit: camera frame, mm, rad, counts.

use crate::calibrate::measured_pose::MeasuredPose;
use crate::geometry::{Axis, AxisKind, Vec3, exp};
use crate::solve::End;
use nalgebra::DMatrix;

/// One stop of the axis with the board that is mounted on it.
#[derive(Clone, Debug)]
pub struct Stop {
    /// Count from the motion's zero.
    pub count: f64,
    /// Pose of the board in the camera frame, as measured in the picture.
    pub pose: MeasuredPose,
}

/// Residual of one picture: the step from the expected board to the seen one.
#[derive(Clone, Debug)]
pub struct StopResidual {
    /// Name of the picture.
    pub name: String,
    /// Count from the motion's zero.
    pub count: f64,
    /// True if the picture is in the fit; false if it contradicts the others and was excluded.
    pub used: bool,
    /// Residual at the board corners, rms, mm.
    pub mm: f64,
    /// Residual at the board corners with the picture excluded from the fit, rms, mm.
    pub holdout_mm: f64,
    /// Squared distance from the position that the others predict, in sigmas of both; 6 is usual.
    pub surprise: f64,
    /// Offset of the board's middle from its expected position, camera frame, mm.
    pub off: Vec3,
}

/// What [`super::solve::solve`] found.
#[derive(Clone, Debug)]
pub struct AxisFit {
    /// The fitted axis.
    pub axis: Axis,
    /// Covariance of dx dy dz pitch and, for a turntable, px py pz, named as in [`crate::rig::Kind::parameters`];
    /// includes the camera's uncertainty.
    pub covariance: DMatrix<f64>,
    /// The same covariance with the camera taken as exact.
    pub covariance_camera_exact: DMatrix<f64>,
    /// One entry per stop, in the order given.
    pub stops: Vec<StopResidual>,
    /// Scatter of the position from stop to stop beyond what the pixels explain, per axis, mm.
    pub sigma_mm: f64,
    /// Scatter of the rotation from stop to stop about the board's middle, per axis, rad.
    pub sigma_rad: f64,
    /// Squared distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// Factor on the variance, because the scatter is estimated from few pictures.
    pub inflation: f64,
    /// Counts of the used stops.
    pub counts: Vec<f64>,
    /// Corners of the board and, last, its middle, axis frame at count 0, mm.
    pub landmarks: [Vec3; 5],
    /// Bow of the used stops over the whole travel, as deviation from a straight line, and its sigma, mm. For a
    /// turntable: over the observed rotation.
    pub bend_mm: [f64; 2],
    /// Whether the counts seem to belong to the pictures.
    pub order: Order,
    /// Whether the fit is a minimum.
    pub end: End,
}

/// The fit with the stated counts compared with other orders of the counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Spread of the stops about their motion with the stated counts, mm.
    pub spread_mm: f64,
    /// The spread with the counts in reverse order, mm.
    pub reversed_mm: f64,
    /// The smallest spread of random permutations of the counts, mm.
    pub dealt_mm: f64,
}

impl AxisFit {
    /// Standard deviation of the position of a part on the axis, relative to its position at the middle of the
    /// travel. It is the rms over the travel (on a turntable over a full turn) and the board's corners, mm. First by
    /// the covariance of the axis alone; second with its scatter from stop to stop and the bow, which the straight
    /// model ignores.
    pub fn expected_error(&self, covariance: &DMatrix<f64>) -> [f64; 2] {
        let (low, high) =
            self.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        match self.axis.kind {
            AxisKind::Linear => self.error_over(covariance, (high - low) / 2.0),
            AxisKind::Turntable => self.error_over(covariance, std::f64::consts::PI / self.axis.pitch.abs()),
        }
    }

    /// The same over this many counts to both sides of the middle of the travel.
    pub fn error_over(&self, covariance: &DMatrix<f64>, half: f64) -> [f64; 2] {
        let (low, high) =
            self.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        let middle = (low + high) / 2.0;
        let ridden = |p: &Vec3| match self.axis.kind {
            AxisKind::Linear => p + Vec3::x() * (self.axis.pitch * middle),
            AxisKind::Turntable => exp(&(Vec3::z() * (self.axis.pitch * middle))) * p,
        };
        // Even for a straight travel chance leaves a bow, as large as its sigma along each axis.
        let [bow, chance] = self.bend_mm;
        let bow2 = (bow * bow - 3.0 * chance * chance).max(0.0);
        let (mut sum, mut bent, mut n) = (0.0, 0.0, 0.0);
        for k in -4..=4 {
            let errors = self.axis.errors(half * f64::from(k) / 4.0);
            for p in self.landmarks.iter().map(ridden) {
                let j = DMatrix::from_fn(3, errors.len(), |i, k| errors[k].at(&p)[i]);
                let c = &j * covariance * j.transpose();
                sum += c.trace().max(0.0);
                bent += bow2 * (f64::from(k) / 4.0).powi(4);
                n += 1.0;
            }
        }
        let (own, bent) = (sum / n, bent / n);
        let arm2 = self.landmarks.iter().map(|p| (p - self.landmarks[4]).norm_squared()).sum::<f64>() / 5.0;
        let scatter = 3.0 * self.sigma_mm.powi(2) + 2.0 * self.sigma_rad.powi(2) * arm2;
        [own.sqrt(), (own + scatter + bent).sqrt()]
    }
}
