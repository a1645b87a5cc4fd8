//! In: what is asked of an axis: stops with a board and a count. Out: what was found, and how far it puts a part wrong.
//! Frame and unit: camera frame, mm, rad, counts.

use crate::calibrate::measured_pose::MeasuredPose;
use crate::geometry::{Axis, AxisKind, Vec3, exp};
use crate::solve::End;
use nalgebra::DMatrix;

/// One stop of the axis with the board that rides on it.
#[derive(Clone, Debug)]
pub struct Stop {
    /// From the motion's zero.
    pub count: f64,
    /// The board before the camera, as the picture measured it.
    pub pose: MeasuredPose,
}

/// How one picture fits: its step from the expected to the seen board.
#[derive(Clone, Debug)]
pub struct StopResidual {
    /// Of the picture.
    pub name: String,
    /// From the motion's zero.
    pub count: f64,
    /// In the fit; false: it contradicts the others and was left out.
    pub used: bool,
    /// Board corners, rms, mm; and with the picture left out of the fit.
    pub mm: f64,
    /// Board corners with the picture left out of the fit, rms, mm.
    pub holdout_mm: f64,
    /// Squared distance from where the others predict it, in sigmas of both; 6 is usual.
    pub surprise: f64,
    /// How far the board's middle was from its expected place, camera frame, mm.
    pub off: Vec3,
}

/// What [`super::solve::solve`] found.
#[derive(Clone, Debug)]
pub struct AxisFit {
    /// The axis as found.
    pub axis: Axis,
    /// Of dx dy dz pitch and for a turntable px py pz, as [`crate::rig::Kind::parameters`] names them; camera
    /// uncertainty included.
    pub covariance: DMatrix<f64>,
    /// The same with the camera taken as exact.
    pub covariance_camera_exact: DMatrix<f64>,
    /// One a stop, in the order given.
    pub stops: Vec<StopResidual>,
    /// What the axis scatters by from stop to stop beyond what pixels explain, per axis: mm, and rad about the
    /// board's middle.
    pub sigma_mm: f64,
    /// Scatter of the turn from stop to stop about the board's middle, per axis, rad.
    pub sigma_rad: f64,
    /// Squared distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// What the variance was multiplied by, because scatter is known from few pictures.
    pub inflation: f64,
    /// Counts of the used stops, and the board's corners and middle in axis coordinates at count 0.
    pub counts: Vec<f64>,
    /// Corners of the board and then its middle, axis frame at count 0, mm.
    pub landmarks: [Vec3; 5],
    /// How far the used stops lie from a straight line as a bow over the whole way, mm, and its sigma; of a
    /// turntable over the turn seen.
    pub bend_mm: [f64; 2],
    /// Whether the counts seem to belong to the pictures.
    pub order: Order,
    /// Whether the fit is a minimum.
    pub end: End,
}

/// How the counts as they are compare with others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Order {
    /// Spread of the stops about their motion, mm.
    pub spread_mm: f64,
    /// The same with the counts the other way round.
    pub reversed_mm: f64,
    /// The least of counts dealt out at random.
    pub dealt_mm: f64,
}

impl AxisFit {
    /// Standard deviation of where a part that rides on the axis is put against where it stood in the middle of the
    /// way, rms over the stops (on a turntable over a whole turn) and the board's corners, mm: of the axis as a
    /// whole, and with its scatter from stop to stop and what its way bows by, which is used as straight.
    pub fn expected_error(&self, covariance: &DMatrix<f64>) -> [f64; 2] {
        let (low, high) =
            self.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        match self.axis.kind {
            AxisKind::Linear => self.error_over(covariance, (high - low) / 2.0),
            AxisKind::Turntable => self.error_over(covariance, std::f64::consts::PI / self.axis.pitch.abs()),
        }
    }

    /// The same over so many counts to both sides of the middle of the way.
    pub fn error_over(&self, covariance: &DMatrix<f64>, half: f64) -> [f64; 2] {
        let (low, high) =
            self.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        let middle = (low + high) / 2.0;
        let ridden = |p: &Vec3| match self.axis.kind {
            AxisKind::Linear => p + Vec3::x() * (self.axis.pitch * middle),
            AxisKind::Turntable => exp(&(Vec3::z() * (self.axis.pitch * middle))) * p,
        };
        // Of a straight way chance leaves a bow too, as large as its sigma along each axis.
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
