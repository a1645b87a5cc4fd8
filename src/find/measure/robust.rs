//! In: rows of a linear problem with the shot that each came from. Out: its robust solution with the sandwich
//! covariance over shots (docs/math.md, Insertion (4)); a median.
//! Frame and unit: the rows' own.

use nalgebra::{SMatrix, SVector};
use std::collections::BTreeMap;

pub(in crate::find) struct Fit<const N: usize> {
    pub step: SVector<f64, N>,
    pub covariance: SMatrix<f64, N, N>,
    pub used: usize,
    pub sigma: f64,
    pub weights: Vec<f64>,
}

/// The median; 0 for an empty list.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Tukey-weighted least squares of `residual = j . step` with priors (unknown, sigma) around zero. Rows
/// of one shot share its pose's error, so the covariance is the sandwich over shots. `floor`: least
/// robust sigma, mm.
pub(in crate::find) fn robust<const N: usize>(
    rows: &[(SVector<f64, N>, f64, u32)],
    priors: &[(usize, f64)],
    floor: f64,
) -> Option<Fit<N>> {
    const TUKEY: f64 = 3.0;
    let mut step = SVector::<f64, N>::zeros();
    let mut weights = vec![1.0; rows.len()];
    let mut sigma = 1.0f64;
    let mut inverse = SMatrix::<f64, N, N>::zeros();
    for round in 0..15 {
        let mut size: Vec<f64> = rows.iter().map(|(j, r, _)| (r - j.dot(&step)).abs()).collect();
        let middle = size.len() / 2;
        sigma = (1.4826 * *size.select_nth_unstable_by(middle, f64::total_cmp).1).max(floor);
        let (mut a, mut b) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
        for ((j, r, _), w) in rows.iter().zip(&mut weights) {
            let u = (r - j.dot(&step)) / (TUKEY * sigma);
            *w = if round == 0 { 1.0 } else { (1.0 - u * u).max(0.0).powi(2) };
            a += *w * j * j.transpose();
            b += *w * *r * j;
        }
        for &(k, prior) in priors {
            a[(k, k)] += (sigma / prior).powi(2);
        }
        inverse = inverted(&a)?;
        step = inverse * b;
    }
    let middle = across_shots(rows, &weights, &step);
    let used = weights.iter().filter(|w| **w > 0.0).count();
    // A weighted mean follows a shift of its rows only by the mean slope of the influence, not by the mean weight.
    let (mut weight, mut slope) = (0.0, 0.0);
    for ((j, r, _), w) in rows.iter().zip(&weights).filter(|(_, w)| **w > 0.0) {
        let u = (r - j.dot(&step)) / (TUKEY * sigma);
        weight += w;
        slope += (1.0 - u * u) * (1.0 - 5.0 * u * u);
    }
    let inverse = inverse * (weight / slope.max(0.3 * weight)).max(1.0);
    let sandwich = inverse * middle * inverse;
    let plain = inverse * (sigma * sigma);
    // Few shots make the sandwich optimistic: never below the plain estimate.
    let covariance = if (0..N).all(|k| sandwich[(k, k)] >= plain[(k, k)]) {
        sandwich
    } else {
        let grow = (0..N).map(|k| plain[(k, k)] / sandwich[(k, k)].max(1e-300)).fold(1.0, f64::max).min(4.0);
        sandwich * grow
    };
    Some(Fit { step, covariance, used, sigma, weights })
}

/// Inverse of a normal matrix; `None` where a motion is undetermined.
fn inverted<const N: usize>(a: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let scale = SVector::<f64, N>::from_fn(|k, _| a[(k, k)].max(1e-300).sqrt().recip());
    let unit = SMatrix::<f64, N, N>::from_fn(|i, k| a[(i, k)] * scale[i] * scale[k]);
    let decomposed = nalgebra::Cholesky::new(unit)?;
    // The smallest pivot of a unit-diagonal matrix is near 0 where a motion is undetermined.
    if (0..N).any(|k| decomposed.l()[(k, k)] < 1e-3) {
        return None;
    }
    let inv = decomposed.inverse();
    Some(SMatrix::from_fn(|i, k| inv[(i, k)] * scale[i] * scale[k]))
}

/// Scatter of the shots' scores: the middle of the sandwich.
fn across_shots<const N: usize>(
    rows: &[(SVector<f64, N>, f64, u32)],
    weights: &[f64],
    step: &SVector<f64, N>,
) -> SMatrix<f64, N, N> {
    // The order is fixed, so that the same scan gives the same sums to the last bit.
    let mut by_shot: BTreeMap<u32, SVector<f64, N>> = BTreeMap::new();
    for ((j, r, shot), w) in rows.iter().zip(weights) {
        *by_shot.entry(*shot).or_insert_with(SVector::zeros) += *w * (r - j.dot(step)) * j;
    }
    let clusters = by_shot.len() as f64;
    by_shot.values().map(|g| g * g.transpose()).sum::<SMatrix<f64, N, N>>()
        * (clusters / (clusters - N as f64).max(1.0))
}
