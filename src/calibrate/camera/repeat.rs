//! In: a camera solved from several pictures. Out: the scatter of its parameters from picture to picture relative to
//! the scatter by the corners' noise: one factor on each standard deviation.
//! Frame and unit: the camera's parameters (order: [`crate::camera::NAMES`]). docs/math.md, Camera calibration (9).

use super::bundle::{Bundle, State};
use crate::camera::{PARAMETERS, Parameters};
use crate::solve::Solution;
use nalgebra::{DMatrix, DVector, Matrix6, OMatrix, U6, Vector6};

/// Weight, in pictures, of the prior that all parameters repeat equally well: few pictures determine little about
/// each one.
const ALIKE: f64 = 2.0;
/// Largest leverage of one picture in a direction: a parameter that one picture alone determines cannot be checked by
/// others.
const LEVERAGE: f64 = 0.99;

/// Information about the free parameters from one picture with an unknown pose, and its gradient.
pub(super) type Told = (DMatrix<f64>, DVector<f64>);

/// Corners of one picture are not independent: blur, light and the board's bending move them together. The pictures
/// are therefore the units that repeat. The pull of each on the solution, corrected for its own leverage \[bell02\],
/// is compared with the pull that independent corner errors would cause. Never below 1. `None` for fewer than 3
/// pictures, or if something is not determined.
pub(super) fn repeat(bundle: &Bundle<'_>, solution: &Solution<State>) -> Option<Parameters> {
    let told = each(bundle, solution)?;
    let (n, p) = (told.len() as f64, bundle.free.len());
    if told.len() < 3 || p == 0 {
        return None;
    }
    let information: DMatrix<f64> = told.iter().map(|t| &t.0).sum();
    let variance = solution.sigma0 * solution.sigma0;
    let mut all = information.clone();
    for (i, usual) in bundle.usual() {
        let row = bundle.free.iter().position(|&f| f == i)?;
        all[(row, row)] += variance / (usual * usual);
    }
    let root = all.cholesky()?.inverse().cholesky()?.l();
    let pulls: Vec<DVector<f64>> = told.iter().map(|t| pulled(t, &root) / variance.sqrt()).collect();
    // Share of each direction that the pictures determine: below 1 for parameters with a prior near zero.
    let share = root.transpose() * information * &root;
    let alike = pulls.iter().map(|u| u.norm_squared()).sum::<f64>() / share.trace();
    let covariance = &root * share * root.transpose();
    if !alike.is_finite() {
        return None;
    }
    // A variance from few pictures is uncertain itself; errors divided by it have the long tails of Student's
    // distribution.
    let freedom = n - 1.0 + ALIKE;
    let tails = freedom / (freedom - 2.0);
    let mut out = Parameters::repeat(1.0);
    for (row, &i) in bundle.free.iter().enumerate().filter(|(_, i)| **i < PARAMETERS) {
        let moved = pulls.iter().map(|u| root.row(row).transpose().dot(u).powi(2)).sum::<f64>();
        let seen = ((n - 1.0) * moved / covariance[(row, row)] + ALIKE * alike) / freedom;
        out[i] = (1.0 + tails * (seen - 1.0).max(0.0)).sqrt();
    }
    Some(out)
}

/// Pull of a picture in coordinates where all pictures together have unit information (`root` of the covariance): (1
/// - W)^-1/2 u, with W the picture's share of that information.
fn pulled((own, pull): &Told, root: &DMatrix<f64>) -> DVector<f64> {
    let share = (root.transpose() * own * root).symmetric_eigen();
    let free = share.eigenvalues.map(|w| 1.0 / (1.0 - w.clamp(0.0, LEVERAGE)).sqrt());
    &share.eigenvectors * free.component_mul(&(share.eigenvectors.transpose() * (root.transpose() * pull)))
}

/// The information of every picture at a solution.
pub(super) fn each(bundle: &Bundle<'_>, solution: &Solution<State>) -> Option<Vec<Told>> {
    let State { camera, shape, poses } = &solution.state;
    let camera = bundle.like.with_parameters(camera);
    let mut weights = solution.weights.iter();
    let p = bundle.free.len();
    let picture = |(corners, pose): (&Vec<_>, _)| -> Option<Told> {
        let (mut kk, mut kp, mut pp) =
            (DMatrix::zeros(p, p), OMatrix::<f64, nalgebra::Dyn, U6>::zeros(p), Matrix6::zeros());
        let (mut pull, mut pose_pull) = (DVector::zeros(p), Vector6::zeros());
        for corner in corners {
            let weight = *weights.next()?;
            let (residual, rows) = bundle.row(&camera, shape, pose, corner)?;
            for (r, row) in [residual.x, residual.y].into_iter().zip(&rows) {
                let (own, pose) = (DVector::from_row_slice(&row[..p]), Vector6::from_row_slice(&row[p..]));
                kk.ger(weight, &own, &own, 1.0);
                kp.ger(weight, &own, &pose, 1.0);
                pp.ger(weight, &pose, &pose, 1.0);
                pull.axpy(weight * r, &own, 1.0);
                pose_pull.axpy(weight * r, &pose, 1.0);
            }
        }
        let inverse = pp.try_inverse()?;
        Some((&kk - &kp * inverse * kp.transpose(), pull - &kp * (inverse * pose_pull)))
    };
    bundle.pictures.iter().zip(poses).map(picture).collect()
}

/// Multiplies the standard deviations of a covariance by these factors.
pub(super) fn widened(covariance: &mut crate::camera::ParameterMatrix, by: &Parameters) {
    for i in 0..PARAMETERS {
        for j in 0..PARAMETERS {
            covariance[(i, j)] *= by[i] * by[j];
        }
    }
}
