//! In: stops and their fit. Out: the axis' own scatter from stop to stop, by restricted maximum likelihood.
//! Frame and unit: mm, rad per axis (docs/math.md, Axis (6)).

use super::terms::{Fit, Scatter, Seen, information};
use nalgebra::{DMatrix, DVector};

/// Rounds and steps of the search: the two scatters are searched in turns.
const ROUNDS: usize = 2;
const STEPS: usize = 12;
/// Smallest gain in likelihood (2 ln L) for which the axis is given a scatter.
const WORTH: f64 = 1.0;

/// Scatter of the axis that maximises the likelihood of the fit's residuals.
pub(super) fn estimate(seen: &[&Seen], fit: &Fit) -> Scatter {
    let left: Vec<_> = seen.iter().map(|s| (*s, fit.state.off(s), fit.state.jacobian(s.count))).collect();
    let cost = |s: &Scatter| {
        let n = fit.state.width();
        let (mut h, mut g, mut sum) = (DMatrix::<f64>::zeros(n, n), DVector::<f64>::zeros(n), 0.0);
        for (seen, e, j) in &left {
            let Some(w) = information(seen, s) else { return f64::INFINITY };
            let jw = j.transpose() * w;
            h += &jw * j;
            g += &jw * e;
            sum += (e.transpose() * w * e)[0] - w.determinant().ln();
        }
        // Scaled to a unit diagonal, so that counts and millimetres have equal weight.
        let d = h.diagonal().map(|x| 1.0 / x.sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, k| h[(i, k)] * d[i] * d[k]);
        let Some(factor) = scaled.cholesky() else { return f64::INFINITY };
        let g = g.component_mul(&d);
        sum - g.dot(&factor.solve(&g)) + 2.0 * factor.l().diagonal().map(f64::ln).sum() - 2.0 * d.map(f64::ln).sum()
    };
    let none = Scatter { mm: 0.0, rad: 0.0 };
    // Upper limit of the search: twice the rms of the residuals.
    let rms = |from: usize| {
        let sum: f64 = left.iter().map(|(_, e, _)| e.fixed_rows::<3>(from).norm_squared()).sum();
        (sum / (3 * left.len()) as f64).sqrt()
    };
    let most = [2.0 * rms(0), 2.0 * rms(3)];
    let mut best = (cost(&none), none);
    let bare = best.0;
    for _ in 0..ROUNDS {
        for k in 0..2 {
            let at = |x: f64| if k == 0 { Scatter { mm: x, ..best.1 } } else { Scatter { rad: x, ..best.1 } };
            // Candidates over two decades, from the upper limit down, and zero.
            let tries: Vec<Scatter> =
                (0..STEPS).map(|i| at(most[k] * 10f64.powf(-2.0 * i as f64 / (STEPS - 1) as f64))).collect();
            let ladder: Vec<(f64, Scatter)> = tries.into_iter().chain([at(0.0)]).map(|s| (cost(&s), s)).collect();
            best = ladder.into_iter().chain([best]).min_by(|a, b| a.0.total_cmp(&b.0)).expect("not empty");
        }
    }
    if bare - best.0 < WORTH { none } else { best.1 }
}

/// Share of the positions' variance that comes from the axis' own scatter, 0 to 1.
pub(super) fn share(seen: &[&Seen], scatter: &Scatter) -> f64 {
    let own = 3.0 * scatter.mm * scatter.mm;
    let all: f64 = seen.iter().map(|s| own / (own + s.covariance.fixed_view::<3, 3>(0, 0).trace()).max(1e-300)).sum();
    all / seen.len().max(1) as f64
}
