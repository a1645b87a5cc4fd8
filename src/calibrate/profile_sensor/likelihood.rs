//! In: measurements of a target in profiles, robot poses, sigmas of both. Out: the state of maximum likelihood with
//! its covariance, distances from it, and the robot's variance components.
//! Frame and unit: nine unknowns: the sensor on the flange (tx ty tz mm, rx ry rz rad, left), three of the target.

use crate::calibrate::components::Components;
use crate::geometry::{Base, Flange, Rigid};
use crate::solve::{End, LmOptions, Loss, Problem, Residuals, lm};
use nalgebra::{DMatrix, DVector, SMatrix, SVector};

/// Number of unknowns: the sensor's pose and the target's place.
pub const UNKNOWNS: usize = 9;

/// A target that stands still. A profile of it yields K numbers.
pub trait Target<const K: usize> {
    /// The unknowns.
    type State: Copy;
    /// What a profile yields.
    type Measured;
    /// The state after a step.
    fn moved(&self, s: &Self::State, step: &[f64]) -> Self::State;
    /// What a profile tells at a state.
    fn row(&self, s: &Self::State, item: &Item<'_, Self::Measured>) -> Row<K>;
    /// Covariance of the K numbers for a point variance of 1 mm².
    fn own(&self, measured: &Self::Measured) -> SMatrix<f64, K, K>;
    /// The least variance of each part of the robot's noise.
    fn floors(&self) -> &'static [f64];
}

/// A profile's measurement and the robot's pose.
pub struct Item<'a, M> {
    pub measured: &'a M,
    pub pose: &'a Rigid<Base, Flange>,
}

impl<M> Clone for Item<'_, M> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<M> Copy for Item<'_, M> {}

/// Residuals of one profile.
pub struct Row<const K: usize> {
    pub residual: SVector<f64, K>,
    /// Derivatives by the unknowns.
    pub by: SMatrix<f64, K, UNKNOWNS>,
    /// Derivatives by the robot's errors: one matrix for each part of its noise.
    pub robot: Vec<SMatrix<f64, K, 3>>,
}

/// Sigma of a profile point, mm, and of each part of the robot's noise, in its unit.
#[derive(Clone, Debug)]
pub struct Noise {
    pub point: f64,
    pub robot: Vec<f64>,
}

/// A minimum, its covariance, and the sum of the squared Mahalanobis distances there.
pub struct Solved<S> {
    pub state: S,
    pub covariance: DMatrix<f64>,
    pub cost: f64,
    pub end: End,
}

struct Fit<'a, const K: usize, T: Target<K>> {
    target: &'a T,
    items: &'a [Item<'a, T::Measured>],
    whiteners: Vec<SMatrix<f64, K, K>>,
}

impl<const K: usize, T: Target<K>> Problem for Fit<'_, K, T> {
    type State = T::State;
    fn width(&self) -> usize {
        UNKNOWNS
    }
    fn moved(&self, s: &T::State, d: &[f64]) -> T::State {
        self.target.moved(s, d)
    }
    fn residuals(&self, s: &T::State, out: &mut Residuals) -> Option<()> {
        for (item, w) in self.items.iter().zip(&self.whiteners) {
            let Row { residual, by, .. } = self.target.row(s, item);
            out.group((w * residual).as_slice(), &[0, 1, 2, 3, 4, 5, 6, 7, 8], (w * by).transpose().as_slice());
        }
        Some(())
    }
}

/// Covariance of one profile's numbers: its points' noise and the robot's.
pub fn covariance_of<const K: usize, T: Target<K>>(
    target: &T,
    s: &T::State,
    item: &Item<'_, T::Measured>,
    n: &Noise,
) -> SMatrix<f64, K, K> {
    let own = target.own(item.measured) * (n.point * n.point);
    let parts = target.row(s, item).robot;
    parts.iter().zip(&n.robot).fold(own, |sum, (by, sigma)| sum + by * by.transpose() * (sigma * sigma))
}

/// The state of least misfit near a start, with the noise as it acts at the start, determined or not; how it ended.
pub fn nearest<const K: usize, T: Target<K>>(
    target: &T,
    items: &[Item<'_, T::Measured>],
    start: &T::State,
    n: &Noise,
    loss: Loss,
) -> Option<(crate::solve::Solution<T::State>, End)> {
    let whiteners = items
        .iter()
        .map(|i| covariance_of(target, start, i, n).cholesky()?.l().try_inverse())
        .collect::<Option<Vec<_>>>()?;
    let options = LmOptions { loss, ..Default::default() };
    lm(&Fit { target, items, whiteners }, *start, &options).ended()
}

/// Fits the unknowns from a start. `None` where the profiles do not determine them.
pub fn fit<const K: usize, T: Target<K>>(
    target: &T,
    items: &[Item<'_, T::Measured>],
    start: &T::State,
    n: &Noise,
    loss: Loss,
) -> Option<Solved<T::State>> {
    let (s, end) = nearest(target, items, start, n, loss)?;
    let cost = s.lengths.iter().map(|l| l * l).sum();
    Some(Solved { state: s.state, covariance: s.covariance?, cost, end })
}

/// One step of the estimate of the robot's variance components; returns sigmas.
pub fn robot_sigmas<const K: usize, T: Target<K>>(
    target: &T,
    items: &[Item<'_, T::Measured>],
    s: &T::State,
    n: &Noise,
) -> Option<Vec<f64>> {
    let m = K * items.len();
    let mut model = Components {
        residual: DVector::zeros(m),
        jacobian: DMatrix::zeros(m, UNKNOWNS),
        known: DMatrix::zeros(m, m),
        parts: vec![DMatrix::zeros(m, m); n.robot.len()],
    };
    for (i, item) in items.iter().enumerate() {
        let row = target.row(s, item);
        model.residual.rows_mut(K * i, K).copy_from(&row.residual);
        model.jacobian.view_mut((K * i, 0), (K, UNKNOWNS)).copy_from(&row.by);
        let own = target.own(item.measured) * (n.point * n.point);
        model.known.view_mut((K * i, K * i), (K, K)).copy_from(&own);
        for (part, by) in model.parts.iter_mut().zip(&row.robot) {
            part.view_mut((K * i, K * i), (K, K)).copy_from(&(by * by.transpose()));
        }
    }
    let theta: Vec<f64> = n.robot.iter().map(|s| s * s).collect();
    Some(model.step(&theta, target.floors())?.into_iter().map(f64::sqrt).collect())
}

/// Squared Mahalanobis distance. The covariance of the fit is subtracted for a used profile, because it pulled the
/// fit towards itself, and added for any other.
pub fn distance2<const K: usize, T: Target<K>>(
    target: &T,
    s: &Solved<T::State>,
    item: &Item<'_, T::Measured>,
    n: &Noise,
    used: bool,
) -> f64 {
    let Row { residual: r, by: j, .. } = target.row(&s.state, item);
    let own = covariance_of(target, &s.state, item, n);
    let c: SMatrix<f64, UNKNOWNS, UNKNOWNS> = s.covariance.fixed_view::<UNKNOWNS, UNKNOWNS>(0, 0).into();
    let fitted = j * c * j.transpose();
    let total = if used { own - fitted } else { own + fitted };
    let solve = |m: SMatrix<f64, K, K>| m.cholesky().map(|c| r.dot(&c.solve(&r)));
    solve(total).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}

/// Sum of the squared Mahalanobis distances of all profiles, each limited to the gate.
pub fn misfit<const K: usize, T: Target<K>>(
    target: &T,
    items: &[Item<'_, T::Measured>],
    s: &T::State,
    n: &Noise,
    gate: f64,
) -> f64 {
    let one = |i: &Item<'_, T::Measured>| {
        let r = target.row(s, i).residual;
        let own = covariance_of(target, s, i, n).cholesky();
        own.map_or(f64::INFINITY, |c| r.dot(&c.solve(&r)).min(gate))
    };
    items.iter().map(one).sum()
}
