//! In: boards' features in pictures, the parameters that are held. Out: camera and boards' poses that explain them best, and how far
//! the camera is known.
//! Frame and unit: camera_from_board, mm, rad; px (docs/math.md, Camera calibration (7), (9)).

use super::bundle::{Bundle, Corner, State};
use super::repeat::{repeat, widened};
use crate::camera::{Intrinsics, PARAMETERS, ParameterMatrix, Parameters};
use crate::solve::{LmOptions, Loss, Solution, lm};

/// The corners with what stays the same from one choice of lens terms to the next.
pub(in crate::calibrate) struct Fit<'a> {
    pub corners: &'a [Vec<Corner>],
    pub like: &'a Intrinsics,
    pub loss: Loss,
}

impl Fit<'_> {
    fn bundle(&self, held: &[usize]) -> Bundle<'_> {
        let free = (0..PARAMETERS).filter(|i| !held.contains(i)).collect();
        Bundle { pictures: self.corners, like: self.like, free }
    }
    pub fn with(&self, held: &[usize], from: State, options: LmOptions) -> Solution<State> {
        lm(&self.bundle(held), from, &LmOptions { hold: held.to_vec(), ..options })
    }
    /// The optimum with these parameters held.
    pub fn fine(&self, held: &[usize], from: State) -> Solution<State> {
        let estimate_scale = self.loss != Loss::Squares;
        self.with(held, from, LmOptions { loss: self.loss, estimate_scale, ..LmOptions::default() })
    }
    pub fn camera(&self, solution: &Solution<State>) -> Intrinsics {
        self.like.with_parameters(&solution.state.0)
    }
    /// Of the intrinsic parameters, as the pictures repeat.
    pub fn covariance(&self, solution: &Solution<State>) -> Option<ParameterMatrix> {
        self.belief(solution).map(|b| b.0)
    }
    /// The same, and the factors on the standard deviations that are in it ([`repeat`]).
    pub fn belief(&self, solution: &Solution<State>) -> Option<(ParameterMatrix, Parameters)> {
        let whole = solution.scaled_covariance()?;
        let mut covariance: ParameterMatrix = whole.fixed_view::<PARAMETERS, PARAMETERS>(0, 0).into();
        let free = (0..PARAMETERS).filter(|&i| covariance[(i, i)] > 0.0).collect();
        let bundle = Bundle { pictures: self.corners, like: self.like, free };
        let factors = repeat(&bundle, solution).unwrap_or(Parameters::repeat(1.0));
        widened(&mut covariance, &factors);
        Some((covariance, factors))
    }
}
