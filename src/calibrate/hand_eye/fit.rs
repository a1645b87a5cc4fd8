//! In: nothing. Out: the result of a hand-eye solve: the transform, its covariance, the residuals of each pair.
//! Frame and unit: see `closed`; mm, rad.

use super::camera_belief::CameraBelief;
use super::closed::{Agreement, Chain};
use super::options::Noise;
use crate::camera::{Intrinsics, PARAMETERS};
use crate::solve::End;
use nalgebra::DMatrix;
use nalgebra::SMatrix;

/// Residuals of one pair: the step from the expected to the seen board pose.
#[derive(Clone, Debug)]
pub struct PairResidual {
    /// Name of the picture.
    pub name: String,
    /// True if the pair is in the fit; false if it disagreed and was excluded.
    pub used: bool,
    /// Squared Mahalanobis distance, 6 degrees of freedom.
    pub distance2: f64,
    /// Residual at the board's landmarks in the picture, rms, px.
    pub px: f64,
    /// Residual at the board's landmarks in space, rms, mm.
    pub mm: f64,
    /// `px` with the pair excluded from the fit.
    pub holdout_px: f64,
    /// `mm` with the pair excluded from the fit.
    pub holdout_mm: f64,
}

/// What [`super::solve::solve`] found.
#[derive(Clone, Debug)]
pub struct HandEyeFit {
    /// The hand-eye transform and the board's pose on its carrier.
    pub chain: Chain,
    /// Covariance of 12 parameters: translation (mm) and left rotation (rad) of near_from_camera in the near frame,
    /// then of far_from_board in the far frame. Includes the camera's uncertainty.
    pub covariance: DMatrix<f64>,
    /// Derivatives of the 12 parameters by the given camera's z: how the result follows that camera.
    pub by_camera: SMatrix<f64, 12, PARAMETERS>,
    /// The given camera.
    pub camera: Intrinsics,
    /// Belief about the given camera before these pictures.
    pub given: CameraBelief,
    /// The camera fitted jointly to all pixels and poses.
    pub joint_camera: Intrinsics,
    /// Joint covariance, 12 + [`PARAMETERS`] rows and columns: the 12 parameters, then those of the joint camera.
    pub joint_covariance: DMatrix<f64>,
    /// Squared Mahalanobis distance between the given camera and the camera by these pictures, and its degrees of
    /// freedom.
    pub camera_surprise: (f64, f64),
    /// Noise estimated from the residuals, or as stated.
    pub noise: Noise,
    /// One per pair, in the order given.
    pub pairs: Vec<PairResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// Whether the fit is a minimum.
    pub end: End,
    /// What would make the excluded pairs fit the others, in words.
    pub left_out_fit: Option<String>,
    /// The closed form that the fit started from.
    pub start: Agreement,
}
