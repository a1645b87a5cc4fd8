//! In: the stack of scans, and the contrasts that gates judge. Out: for each calibration, and for errors that none
//! covers (delay, steps), what share of the disagreement it would explain, how wrong it would have to be, and what it
//! could hide.
//! Frame and unit: the part's axes, mm, degrees; shares; the parameters' own units. docs/math.md, Second look (5) and
//! (6).

use super::stack::{Gauges, Shared, Stack, singular};
use crate::fault::Result;
use nalgebra::{DMatrix, DVector, Matrix6, SVector};

/// How much of the disagreement one calibration would explain if it were free to be wrong, and what it could hide.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Explanation {
    /// The calibration, or an error that nothing states, e.g. "delay".
    pub name: &'static str,
    /// Share of the squared disagreement that it explains, 0 to 1.
    pub share: f64,
    /// How wrong each of its numbers would have to be, in its own unit.
    pub off_by: Vec<(&'static str, f64)>,
    /// The same in its own sigmas (root mean square over its numbers); for an error that nothing states, in its typical
    /// size.
    pub off_by_sigmas: f64,
    /// Largest error of the agreed pose along the part's axes, mm, from an error along a single axis of the covariance.
    /// That error is just large enough for a gate to detect it in 95 of 100 cases.
    pub unseen_mm: [f64; 3],
    /// The same for the turns about the part's axes, degrees.
    pub unseen_deg: [f64; 3],
    /// Size of that error in its own sigmas, for the axis that moves the part most.
    pub unnoticed_sigmas: f64,
}

/// Factor on standard deviations that stands for an unlimited error.
const FREE: f64 = 1e3;
/// How far beyond a gate's ratio an error must lie to be detected in 95 of 100 cases, standard deviations.
const NEARLY_ALWAYS: f64 = 1.645;

/// What each of the stack's shared errors explains of the contrasts, best first, and what it could hide from gauges
/// that pass up to `ratio`.
pub(in crate::find) fn explanations(
    stack: &Stack,
    gauges: &Gauges,
    follow: &DMatrix<f64>,
    into_part: &Matrix6<f64>,
    ratio: f64,
) -> Result<Vec<Explanation>> {
    let rows = stack.contrasts();
    let (d, c) = (&rows * &stack.values, &rows * &stack.covariance * rows.transpose());
    let all = d.dot(&c.clone().cholesky().ok_or_else(singular)?.solve(&d));
    let mut out = Vec::new();
    for s in &stack.shared {
        // For errors of one sigma along each axis of its covariance.
        let (axes, lever) = (root(s), &s.lever * root(s));
        let shown = &rows * &lever;
        let freed = (&c + &shown * shown.transpose() * FREE.powi(2)).cholesky().ok_or_else(singular)?;
        let whitened = freed.solve(&d);
        let left = d.dot(&whitened);
        let error = shown.transpose() * whitened * FREE.powi(2);
        let by_number = &axes * &error;
        let numbers = error.len() as f64;
        let Unseen { pose, sigmas } = unseen(&lever, gauges, follow, into_part, ratio + NEARLY_ALWAYS);
        let explanation = Explanation {
            name: s.name,
            share: if all > 0.0 { (1.0 - left / all).clamp(0.0, 1.0) } else { 0.0 },
            off_by: s.parameters.iter().copied().zip(by_number.iter().copied()).collect(),
            off_by_sigmas: (error.norm_squared() / numbers).sqrt(),
            unseen_mm: [pose[0], pose[1], pose[2]],
            unseen_deg: [pose[3], pose[4], pose[5]].map(f64::to_degrees),
            unnoticed_sigmas: sigmas,
        };
        // An error with more numbers explains more by chance: a penalty of two for each number [akaike74].
        out.push((all - left - 2.0 * numbers, explanation));
    }
    out.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(out.into_iter().map(|(_, e)| e).collect())
}

struct Unseen {
    pose: SVector<f64, 6>,
    sigmas: f64,
}

/// The largest motions, axis by axis of the part, from errors along single axes of the covariance. Each error is as
/// large as it can be before a gauge shows it at `noticed` standard deviations.
fn unseen(
    lever: &DMatrix<f64>,
    gauges: &Gauges,
    follow: &DMatrix<f64>,
    into_part: &Matrix6<f64>,
    noticed: f64,
) -> Unseen {
    let (shown, moved) = (&gauges.rows * lever, into_part * (follow * lever));
    let mut out = Unseen { pose: SVector::zeros(), sigmas: 0.0 };
    let mut farthest = 0.0;
    for k in 0..lever.ncols() {
        let most = (0..shown.nrows()).map(|r| shown[(r, k)].abs() / gauges.sigmas[r]).fold(0.0, f64::max);
        let unnoticed = (noticed / most.max(1e-12)).min(FREE);
        let motion = moved.column(k) * unnoticed;
        out.pose = out.pose.zip_map(&SVector::<f64, 6>::from_iterator(motion.iter().copied()), |a, b| a.max(b.abs()));
        if motion.rows(0, 3).norm() > farthest {
            (farthest, out.sigmas) = (motion.rows(0, 3).norm(), unnoticed);
        }
    }
    out
}

/// A square root of the covariance: its columns are the axes times their sigmas; axes of zero variance stay zero.
fn root(s: &Shared) -> DMatrix<f64> {
    // Scaled to unit diagonal first: mm and rad differ by powers of ten.
    let n = s.covariance.nrows();
    let scale = DVector::from_fn(n, |k, _| s.covariance[(k, k)].max(0.0).sqrt());
    let unit = DMatrix::from_fn(n, n, |r, c| s.covariance[(r, c)] / (scale[r] * scale[c]).max(1e-300));
    let eigen = unit.symmetric_eigen();
    DMatrix::from_fn(n, n, |r, c| scale[r] * eigen.eigenvectors[(r, c)] * eigen.eigenvalues[c].max(0.0).sqrt())
}
