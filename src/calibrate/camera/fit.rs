//! In: boards' features in pictures, the parameters that are held. Out: the camera, board's shape and boards' poses
//! that fit them best, and the camera's covariance.
//! Frame and unit: camera_from_board, mm, rad; px (docs/math.md, Camera calibration (7), (9)).

use super::bundle::{Bent, Bundle, Corner, State};
use super::repeat::{Told, each, repeat, widened};
use crate::calibrate::boards::shape::{Basis, Shape};
use crate::camera::{Intrinsics, PARAMETERS, ParameterMatrix, Parameters};
use crate::solve::{LmOptions, Loss, Outcome, Solution, lm};

/// The corners, with the settings that do not change between choices of lens terms.
#[derive(Clone, Copy)]
pub(in crate::calibrate) struct Fit<'a> {
    pub corners: &'a [Vec<Corner>],
    pub like: &'a Intrinsics,
    pub loss: Loss,
    /// `None` for a board that is taken as drawn.
    pub bent: Option<Bent>,
}

impl Fit<'_> {
    fn bundle(&self, held: &[usize]) -> Bundle<'_> {
        let shared = PARAMETERS + self.bent.map_or(0, |_| Basis::LEN);
        let free = (0..shared).filter(|i| !held.contains(i)).collect();
        Bundle { pictures: self.corners, like: self.like, bent: self.bent, free }
    }
    pub fn with(&self, held: &[usize], from: State, options: LmOptions) -> Outcome<State> {
        lm(&self.bundle(held), from, &LmOptions { hold: held.to_vec(), ..options })
    }
    /// The optimum with these parameters held.
    pub fn fine(&self, held: &[usize], from: State) -> Outcome<State> {
        let estimate_scale = self.loss != Loss::Squares;
        self.with(held, from, LmOptions { loss: self.loss, estimate_scale, ..LmOptions::default() })
    }
    /// The same, only as accurate as the choice of terms needs.
    pub fn rough(&self, held: &[usize], from: State) -> Option<Solution<State>> {
        let estimate_scale = self.loss != Loss::Squares;
        let options = LmOptions { loss: self.loss, estimate_scale, tolerance: 1e-5, ..LmOptions::default() };
        self.with(held, from, options).so_far()
    }
    /// The same with all parameters held except the poses.
    pub fn placed(&self, from: State) -> Option<Solution<State>> {
        let all: Vec<usize> = (0..self.bundle(&[]).shared()).collect();
        self.rough(&all, from)
    }
    /// The information of every picture about the free parameters.
    pub fn told(&self, held: &[usize], solution: &Solution<State>) -> Option<Vec<Told>> {
        each(&self.bundle(held), solution)
    }
    pub fn camera(&self, solution: &Solution<State>) -> Intrinsics {
        self.like.with_parameters(&solution.state.camera)
    }
    pub fn shape(&self, solution: &Solution<State>) -> Option<Shape> {
        self.bundle(&[]).shape(&solution.state)
    }
    /// Covariance of the intrinsic parameters, including the pictures' repeatability.
    pub fn covariance(&self, solution: &Solution<State>) -> Option<ParameterMatrix> {
        self.belief(solution).map(|b| b.0)
    }
    /// The same, and the factors on the standard deviations that it contains ([`repeat`]).
    pub fn belief(&self, solution: &Solution<State>) -> Option<(ParameterMatrix, Parameters)> {
        let whole = solution.scaled_covariance()?;
        let mut covariance: ParameterMatrix = whole.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into();
        let held: Vec<usize> = (0..PARAMETERS).filter(|&i| covariance[(i, i)] <= 0.0).collect();
        let factors = repeat(&self.bundle(&held), solution).unwrap_or(Parameters::repeat(1.0));
        widened(&mut covariance, &factors);
        Some((covariance, factors))
    }
}
