//! In: a square matrix and the names of its rows. Out: the reason why it is not a covariance, if it is not.
//! Frame and unit: units of the names, multiplied; judged in correlations, so that millimetres and radians have equal
//! weight.

use nalgebra::DMatrix;

/// Tolerance for rounding, in symmetry and in eigenvalues below zero, in correlations.
const ROUNDING: f64 = 1e-6;

/// Why a matrix with a row and a column for each name is not a covariance, in words that follow "the covariance".
/// Reasons: numbers that are not finite, a variance below 0, no symmetry, correlations beyond 1, an eigenvalue below 0.
/// `None` for a covariance.
pub fn not_a_covariance(names: &[impl AsRef<str>], c: &DMatrix<f64>) -> Option<String> {
    let n = names.len();
    assert_eq!((n, n), c.shape());
    if c.iter().any(|x| !x.is_finite()) {
        return Some("holds a number that is not finite".into());
    }
    if let Some(i) = (0..n).find(|&i| c[(i, i)] < 0.0) {
        return Some(format!("has the variance {:.3e} for {}; none is below 0", c[(i, i)], names[i].as_ref()));
    }
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        let scale = (c[(i, i)] * c[(j, j)]).sqrt();
        if scale > 0.0 { c[(i, j)] / scale } else { if c[(i, j)] == 0.0 { 0.0 } else { f64::INFINITY } }
    });
    let crooked = |i: usize, j: usize| {
        let d = correlation[(i, j)] - correlation[(j, i)];
        !(d.abs() <= ROUNDING && correlation[(i, j)].abs() <= 1.0 + ROUNDING)
    };
    if let Some((i, j)) = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).find(|&(i, j)| crooked(i, j)) {
        return Some(format!(
            "has {:.3e} and {:.3e} between {} and {}: not symmetric, or beyond their variances",
            c[(i, j)],
            c[(j, i)],
            names[i].as_ref(),
            names[j].as_ref()
        ));
    }
    let least = if n > 0 { correlation.symmetric_eigenvalues().min() } else { 0.0 };
    (least < -ROUNDING * n as f64).then(|| format!("has the eigenvalue {least:.3e} (of correlations); none is below 0"))
}
