//! In: residuals at a minimum, with their derivatives by the unknowns and by the robot's errors. Out: the unknowns'
//! step and covariance averaged over what the robot's noise may be, and that noise.
//! Frame and unit: see `likelihood`; docs/math.md, Plate (7).
//!
//! Twelve profiles have 15 degrees of freedom for two variances. Their most likely values are often too small, one of
//! them zero, and the covariance with them is too small as well. So each pair of values counts by its likelihood.

use crate::calibrate::profile_sensor::likelihood::{Row, UNKNOWNS};
use nalgebra::{SMatrix, SVector};

/// Ratio of neighbouring sigmas that are tried.
const RATIO: f64 = 1.6;
/// Smallest and largest sigma of the robot's position that is tried, mm.
const POSITION_MM: [f64; 2] = [0.002, 10.0];
/// Smallest and largest sigma of the robot's orientation that is tried, rad: 0.0005 to 2 degrees.
const TURN: [f64; 2] = [9e-6, 0.035];

type Nine = SVector<f64, UNKNOWNS>;
type Covariance = SMatrix<f64, UNKNOWNS, UNKNOWNS>;

/// Mean over the robot's noise.
pub struct Averaged {
    /// From the state of the residuals.
    pub step: Nine,
    pub covariance: Covariance,
    /// Sigma of the robot's position, mm, and orientation, rad: root of the mean variance.
    pub robot: [f64; 2],
}

/// One profile: its residuals, and the covariance of their own.
pub struct Profile<const K: usize> {
    pub row: Row<K>,
    pub own: SMatrix<f64, K, K>,
}

/// The unknowns under one noise of the robot, and the logarithm of the restricted likelihood of that noise.
struct Guess {
    likelihood: f64,
    step: Nine,
    covariance: Covariance,
    robot: [f64; 2],
}

/// Averages over a grid of sigmas that are equally likely in their logarithms. `None` where the profiles do not
/// determine the unknowns.
pub fn average<const K: usize>(profiles: &[Profile<K>]) -> Option<Averaged> {
    let ladder =
        |[low, high]: [f64; 2]| std::iter::successors(Some(low), |s| Some(s * RATIO)).take_while(move |s| *s <= high);
    let pairs = ladder(POSITION_MM).flat_map(|a| ladder(TURN).map(move |b| [a, b]));
    let guesses = pairs.map(|robot| guess(profiles, robot)).collect::<Option<Vec<_>>>()?;
    let best = guesses.iter().map(|g| g.likelihood).fold(f64::NEG_INFINITY, f64::max);
    let weights: Vec<f64> = guesses.iter().map(|g| (g.likelihood - best).exp()).collect();
    let sum: f64 = weights.iter().sum();
    let each = || guesses.iter().zip(weights.iter().map(|w| w / sum));
    let step: Nine = each().map(|(g, w)| g.step * w).sum();
    let covariance = each().map(|(g, w)| (g.covariance + (g.step - step) * (g.step - step).transpose()) * w).sum();
    let robot = [0, 1].map(|k| each().map(|(g, w)| w * g.robot[k].powi(2)).sum::<f64>().sqrt());
    Some(Averaged { step, covariance, robot })
}

fn guess<const K: usize>(profiles: &[Profile<K>], robot: [f64; 2]) -> Option<Guess> {
    let (mut h, mut g) = (Covariance::zeros(), Nine::zeros());
    let (mut squares, mut ln_root) = (0.0, 0.0);
    for p in profiles {
        let variance = p.row.robot.iter().zip(robot).fold(p.own, |sum, (by, s)| sum + by * by.transpose() * (s * s));
        let root = variance.cholesky()?.l();
        let (r, j) = (root.solve_lower_triangular(&p.row.residual)?, root.solve_lower_triangular(&p.row.by)?);
        h += j.transpose() * j;
        g += j.transpose() * r;
        squares += r.norm_squared();
        ln_root += root.diagonal().iter().map(|d| d.ln()).sum::<f64>();
    }
    let normal = h.cholesky()?;
    let step = -normal.solve(&g);
    let ln_normal = normal.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    // squares + g · step is the misfit after the step.
    let likelihood = -ln_root - ln_normal - 0.5 * (squares + g.dot(&step));
    Some(Guess { likelihood, step, covariance: normal.inverse(), robot })
}
