//! Selects the pictures that would gain most from a camera of their own. Everything is linearised in the camera's
//! parameters, so that thousands of selections can be compared.

use super::chance::ln_sets;
use super::pictures::Set;
use crate::calibrate::camera::repeat::Told;
use nalgebra::{DMatrix, DVector};

/// Number of start selections that are followed to their best neighbour, and rounds of that.
const STARTS: usize = 12;
const ROUNDS: usize = 30;
/// Relative regularisation of a change's information: the part that the shared parameters explain equally well does
/// not count.
const RIDGE: f64 = 1e-9;

/// Information of the pictures about a change of some of them, with the shared parameters free.
pub struct Linear {
    /// Per picture: information about its change, the part of it that the shared parameters can absorb, and its
    /// gradient.
    own: Vec<DMatrix<f64>>,
    shared: Vec<DMatrix<f64>>,
    pull: Vec<DVector<f64>>,
}

/// Information of the priors, for residuals of this variance.
pub fn beforehand(set: &Set, variance: f64) -> DMatrix<f64> {
    let free = set.free();
    DMatrix::from_diagonal(&DVector::from_iterator(
        free.len(),
        free.iter().map(|&i| set.usual(i).map_or(0.0, |usual| variance / (usual * usual))),
    ))
}

impl Linear {
    /// `directions`: derivatives of the free parameters by the change. `told`: at the optimum of the shared
    /// parameters.
    pub fn new(told: &[Told], prior: &DMatrix<f64>, directions: &DMatrix<f64>) -> Option<Linear> {
        let all = told.iter().fold(prior.clone(), |sum, t| sum + &t.0);
        let lower = all.cholesky()?.l();
        let along: Vec<DMatrix<f64>> = told.iter().map(|t| &t.0 * directions).collect();
        Some(Linear {
            own: along.iter().map(|a| directions.transpose() * a).collect(),
            shared: along.iter().map(|a| lower.solve_lower_triangular(a)).collect::<Option<_>>()?,
            pull: told.iter().map(|t| directions.transpose() * &t.1).collect(),
        })
    }

    /// Decrease of the sum of squares by a change of these pictures.
    pub fn gain(&self, other: &[bool]) -> f64 {
        let those = || (0..other.len()).filter(|&i| other[i]);
        let sum = |all: &[DMatrix<f64>]| those().map(|i| &all[i]).sum::<DMatrix<f64>>();
        if !other.contains(&true) {
            return 0.0;
        }
        let (own, shared) = (sum(&self.own), sum(&self.shared));
        let pull: DVector<f64> = those().map(|i| &self.pull[i]).sum();
        let ridge = DMatrix::from_diagonal(&(own.diagonal() * RIDGE));
        let left = &own - shared.transpose() * &shared + ridge;
        left.cholesky().map_or(0.0, |c| pull.dot(&c.solve(&pull)).max(0.0))
    }

    /// The likeliest selection of at most half of the pictures: its gain is weighed against the pictures' scatter and
    /// the number of such selections.
    pub fn best(&self, variance: f64) -> Vec<bool> {
        let n = self.own.len();
        let numbers = self.own[0].nrows().min(2) as f64;
        let alone = |i: usize| (0..n).map(|k| k == i).collect::<Vec<bool>>();
        let all: f64 = (0..n).map(|i| self.gain(&alone(i))).sum();
        let (least, freedom) = (variance * n as f64 * numbers, n as f64 * numbers);
        let belief = |other: &[bool]| {
            let left = (all - self.gain(other)).max(least);
            -0.5 * freedom * left.ln() - ln_sets(other)
        };
        let mut starts: Vec<Vec<bool>> = vec![(0..n).map(|i| i % 2 == 1).collect()];
        for first in 0..n {
            starts.extend(
                (1..=n / 2)
                    .filter(|k| first + k <= n)
                    .map(|k| (0..n).map(|i| (first..first + k).contains(&i)).collect::<Vec<bool>>()),
            );
        }
        let mut starts: Vec<(f64, Vec<bool>)> = starts.into_iter().map(|s| (belief(&s), s)).collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        starts.truncate(STARTS);
        let climbed = starts.into_iter().map(|(mut here, mut other)| {
            for _ in 0..ROUNDS {
                let next = (0..n).map(|i| toggled(&other, i)).filter(|o| is_smaller_part(o)).map(|o| (belief(&o), o));
                match next.max_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some(next) if next.0 > here => (here, other) = next,
                    _ => break,
                }
            }
            (here, other)
        });
        climbed.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(vec![false; n], |best| best.1)
    }
}

fn toggled(other: &[bool], i: usize) -> Vec<bool> {
    let mut next = other.to_vec();
    next[i] = !next[i];
    next
}

/// Whether at least one and at most half of the pictures are selected.
pub fn is_smaller_part(other: &[bool]) -> bool {
    let count = other.iter().filter(|o| **o).count();
    count > 0 && 2 * count <= other.len()
}
