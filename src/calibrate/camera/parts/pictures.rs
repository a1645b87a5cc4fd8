//! The pictures of a set for the comparison of its parts: their corners, and their information about the camera and
//! the board's shape with each picture's pose eliminated.

use crate::calibrate::boards::shape::Basis;
use crate::calibrate::camera::bundle::{Bent, Corner, State};
use crate::calibrate::camera::fit::Fit;
use crate::calibrate::camera::intrinsics::{Observation, SolveOptions, Solved, measured, one_board};
use crate::calibrate::camera::repeat::Told;
use crate::camera::{Intrinsics, PARAMETERS, Parameters};
use crate::geometry::{Board, Camera, Rigid};
use crate::solve::{Loss, robust_scale};

pub type Pose = Rigid<Camera, Board>;

/// Usual size of a coefficient of the board's shape, as a share of half of the board's length. It exceeds any real
/// deviation of print and plate.
const USUAL_SHAPE: f64 = 0.01;

/// All pictures, and the free parameters: the camera's estimated ones, and the board's shape if all pictures show one
/// board.
pub struct Set {
    corners: Vec<Vec<Corner>>,
    pub like: Intrinsics,
    loss: Loss,
    bent: Option<Bent>,
    pub held: Vec<usize>,
}

/// Fitted camera, shape and poses.
#[derive(Clone)]
pub struct Stand {
    pub camera: Parameters,
    pub shape: Vec<f64>,
    pub poses: Vec<Pose>,
}

/// Some pictures fitted with one camera, each with its best pose.
pub struct Look {
    pub poses: Vec<Pose>,
    pub told: Vec<Told>,
    /// Lengths of the residuals over the corners' sigmas.
    lengths: Vec<Vec<f64>>,
}

impl Set {
    pub fn new(pictures: &[Observation], solved: &Solved, options: &SolveOptions) -> (Set, Stand) {
        let bent = one_board(pictures).map(|basis| Bent { basis, usual: [USUAL_SHAPE * basis.size(); 2] });
        let known = solved.shape.as_ref().map(|s| s.coefficients.clone());
        let shape = bent.map_or(Vec::new(), |_| known.unwrap_or_else(|| vec![0.0; Basis::LEN]));
        let set = Set {
            corners: pictures.iter().map(|o| measured(o, options.weigh)).collect(),
            like: solved.intrinsics,
            loss: options.loss,
            bent,
            held: solved.held.clone(),
        };
        let stand = Stand { camera: solved.intrinsics.parameters(), shape, poses: solved.camera_from_board.clone() };
        (set, stand)
    }

    /// Number of pictures.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// The free parameters: the camera's, then the shape's.
    pub fn free(&self) -> Vec<usize> {
        let all = PARAMETERS + self.bent.map_or(0, |_| Basis::LEN);
        (0..all).filter(|i| !self.held.contains(i)).collect()
    }

    /// Prior of the shape: the usual size of a free parameter; `None` for the camera's.
    pub fn usual(&self, parameter: usize) -> Option<f64> {
        Some(self.bent?.usual_of(parameter.checked_sub(PARAMETERS)?))
    }

    /// Number of observed coordinates.
    pub fn coordinates(&self) -> usize {
        2 * self.corners.iter().map(Vec::len).sum::<usize>()
    }

    /// Typical sigma of the corners of these pictures, px.
    pub fn sigma_px(&self, which: &[usize]) -> f64 {
        let mut sigmas: Vec<f64> = which.iter().flat_map(|&i| &self.corners[i]).map(|c| c.2).collect();
        sigmas.sort_by(f64::total_cmp);
        sigmas.get(sigmas.len() / 2).copied().unwrap_or(0.0)
    }

    /// Fits the poses of these pictures; `None` if a board is not visible to this camera.
    pub fn look(&self, which: &[usize], camera: &Parameters, shape: &[f64], poses: &[Pose]) -> Option<Look> {
        let corners: Vec<Vec<Corner>> = which.iter().map(|&i| self.corners[i].clone()).collect();
        let fit = Fit { corners: &corners, like: &self.like, loss: self.loss, bent: self.bent };
        let poses = which.iter().map(|&i| poses[i]).collect();
        let placed = fit.placed(State { camera: *camera, shape: shape.to_vec(), poses })?;
        let told = fit.told(&self.held, &placed)?;
        let mut all = placed.lengths.iter().copied();
        let lengths = corners.iter().map(|c| all.by_ref().take(c.len()).collect()).collect();
        Some(Look { poses: placed.state.poses, told, lengths })
    }

    /// Cost of each picture: its squared residuals, with reduced weight beyond the loss's threshold.
    pub fn costs(&self, look: &Look, scale: f64) -> Vec<f64> {
        let cost = |r: &f64| self.loss.at((r / scale).powi(2)).0;
        look.lengths.iter().map(|l| l.iter().map(cost).sum()).collect()
    }
}

impl Look {
    /// Typical residual over the corners' sigmas.
    pub fn scale(&self) -> f64 {
        robust_scale(&mut self.lengths.iter().flatten().copied().collect::<Vec<_>>(), 2).max(1e-6)
    }
}
