//! In: nothing. Out: what a hand-eye solve comes to: the transform, its covariance, the residuals of each pair.
//! Frame and unit: see `closed`; mm, rad.

use super::camera_belief::CameraBelief;
use super::closed::{Agreement, Chain};
use super::options::Noise;
use crate::camera::{Intrinsics, PARAMETERS};
use crate::solve::End;
use nalgebra::DMatrix;
use nalgebra::SMatrix;

/// How one pair fits: its step from the expected to the seen board pose.
#[derive(Clone, Debug)]
pub struct PairResidual {
    /// Of the picture.
    pub name: String,
    /// In the fit; false: it disagreed and was left out.
    pub used: bool,
    /// Squared Mahalanobis distance, 6 degrees of freedom.
    pub distance2: f64,
    /// Board corners, rms: px in the picture and mm in space.
    pub px: f64,
    /// Board corners in space, rms, mm.
    pub mm: f64,
    /// The same with the pair left out of the fit.
    pub holdout_px: f64,
    /// Board corners in space with the pair left out of the fit, rms, mm.
    pub holdout_mm: f64,
}

/// What [`super::solve::solve`] found.
#[derive(Clone, Debug)]
pub struct HandEyeFit {
    /// The hand-eye transform and the board's place.
    pub chain: Chain,
    /// Covariance of 12 numbers: translation (mm) and left rotation (rad) of near_from_camera in
    /// the near frame, then of far_from_board in the far frame. Camera uncertainty included.
    pub covariance: DMatrix<f64>,
    /// The 12 numbers by the given camera's z: how the result follows the camera it was given.
    pub by_camera: SMatrix<f64, 12, PARAMETERS>,
    /// The camera that was given, as a belief about itself.
    pub camera: Intrinsics,
    /// What was believed of the given camera before these pictures.
    pub given: CameraBelief,
    /// The camera that all pixels and poses together speak for, and the covariance of the 12 numbers and of its
    /// parameters.
    pub joint_camera: Intrinsics,
    /// 12 + [`PARAMETERS`] rows and columns: the 12 numbers, then the camera's.
    pub joint_covariance: DMatrix<f64>,
    /// Squared Mahalanobis distance between the given camera and what these pictures say of it, and its freedom.
    pub camera_surprise: (f64, f64),
    /// As the residuals show it, or as it was stated.
    pub noise: Noise,
    /// One per pair, in the order given.
    pub pairs: Vec<PairResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// Whether it is a minimum.
    pub end: End,
    /// With what the pairs that were left out would fit the others, in words.
    pub left_out_fit: Option<String>,
    /// The closed form that it started from.
    pub start: Agreement,
}
