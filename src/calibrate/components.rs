//! In: residuals of a linear(ised) fit whose covariance is a known part plus unknown multiples of
//! known matrices. Out: the multiples (variance components) by restricted maximum likelihood.
//! Frame and unit: the caller's (docs/math.md, Hand-eye (8)).

use nalgebra::{DMatrix, DVector};

/// The model e ~ N(J x, V₀ + Σ θₐ Uₐ).
pub struct Components {
    /// The residuals e, n numbers.
    pub residual: DVector<f64>,
    /// J, n rows and one column per parameter of the fit.
    pub jacobian: DMatrix<f64>,
    /// V₀, for example the part that comes from the pixels.
    pub known: DMatrix<f64>,
    /// Uₐ, the covariance for θₐ = 1.
    pub parts: Vec<DMatrix<f64>>,
}

impl Components {
    /// One step of Fisher scoring for the restricted likelihood \[patterson71\] from `theta`: tr(P Uₐ P U_b) θ = eᵀ
    /// P Uₐ P e − tr(P Uₐ P V₀). P is the projector that removes the fit. No component falls below its `floor`.
    /// `None` where a matrix is singular.
    pub fn step(&self, theta: &[f64], floor: &[f64]) -> Option<Vec<f64>> {
        let mut v = self.known.clone();
        for (t, u) in theta.iter().zip(&self.parts) {
            v += u * *t;
        }
        let inverse = v.cholesky()?.inverse();
        let vj = &inverse * &self.jacobian;
        let normal = (self.jacobian.transpose() * &vj).cholesky()?;
        let p = &inverse - &vj * normal.solve(&vj.transpose());
        let pe = &p * &self.residual;
        let pu: Vec<DMatrix<f64>> = self.parts.iter().map(|u| &p * u).collect();
        let pv = &p * &self.known;
        let k = theta.len();
        let trace = |a: &DMatrix<f64>, b: &DMatrix<f64>| a.component_mul(&b.transpose()).sum();
        let s = DMatrix::from_fn(k, k, |a, b| trace(&pu[a], &pu[b]));
        let q = DVector::from_fn(k, |a, _| pe.dot(&(&self.parts[a] * &pe)) - trace(&pu[a], &pv));
        if !q.iter().chain(s.iter()).all(|x| x.is_finite()) {
            return None;
        }
        let (mut l, mut next) = self.likeliest(&s, &q, floor);
        // Scoring can overshoot: the step is halved until the likelihood no longer falls.
        let before = self.likelihood(theta).unwrap_or(f64::NEG_INFINITY);
        for _ in 0..HALVINGS {
            if l >= before - SAME {
                return Some(next);
            }
            next.iter_mut().zip(theta).for_each(|(n, t)| *n = 0.5 * (*n + t));
            l = self.likelihood(&next).unwrap_or(f64::NEG_INFINITY);
        }
        Some(theta.to_vec())
    }

    /// Solution of s θ = q with no component below its floor, and the logarithm of its likelihood. If the
    /// unconstrained solution violates a floor, its signs do not show which components are at theirs. All
    /// combinations are then tried and the likeliest is returned.
    fn likeliest(&self, s: &DMatrix<f64>, q: &DVector<f64>, floor: &[f64]) -> (f64, Vec<f64>) {
        let weighed = |theta: Vec<f64>| (self.likelihood(&theta).unwrap_or(f64::NEG_INFINITY), theta);
        let all = (1u32 << floor.len()) - 1;
        match at_floor(s, q, floor, all) {
            Some(inside) => weighed(inside),
            None => (1..all)
                .filter_map(|free| at_floor(s, q, floor, free))
                .map(weighed)
                .fold(weighed(floor.to_vec()), |best, other| if other.0 > best.0 { other } else { best }),
        }
    }

    /// Logarithm of the restricted likelihood up to a constant; `None` where a matrix is singular.
    fn likelihood(&self, theta: &[f64]) -> Option<f64> {
        let mut v = self.known.clone();
        for (t, u) in theta.iter().zip(&self.parts) {
            v += u * *t;
        }
        let v = v.cholesky()?;
        let (vj, ve) = (v.solve(&self.jacobian), v.solve(&self.residual));
        let normal = (self.jacobian.transpose() * vj).cholesky()?;
        let right = self.jacobian.transpose() * &ve;
        let misfit = self.residual.dot(&ve) - right.dot(&normal.solve(&right));
        let ln_root = |m: &DMatrix<f64>| m.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(-ln_root(v.l_dirty()) - ln_root(normal.l_dirty()) - 0.5 * misfit)
    }
}

/// Differences of the log-likelihood up to this count as none.
const SAME: f64 = 1e-6;
/// Number of halvings: the shortest step is a thousandth of the scoring step.
const HALVINGS: usize = 10;

/// Solution with the components that `free` names (one bit each) free and the others at their floor. `None` where a
/// free component would lie below its floor.
fn at_floor(s: &DMatrix<f64>, q: &DVector<f64>, floor: &[f64], free: u32) -> Option<Vec<f64>> {
    let (some, held): (Vec<usize>, Vec<usize>) = (0..floor.len()).partition(|a| free >> a & 1 == 1);
    let right =
        DVector::from_fn(some.len(), |i, _| q[some[i]] - held.iter().map(|&c| s[(some[i], c)] * floor[c]).sum::<f64>());
    let found = DMatrix::from_fn(some.len(), some.len(), |i, j| s[(some[i], some[j])]).lu().solve(&right)?;
    let mut out = floor.to_vec();
    for (&a, &t) in some.iter().zip(&found) {
        out[a] = t;
    }
    some.iter().all(|&a| out[a] > floor[a] && out[a].is_finite()).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    /// Two groups of residuals with different noise around a straight line.
    #[test]
    fn two_noises_are_told_apart() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let n = 240;
        let mut mean = [0.0, 0.0];
        for _ in 0..40 {
            let (a, b): (f64, f64) = (0.5, 2.0);
            let first = |i: usize| i.is_multiple_of(3);
            let residual = DVector::from_fn(n, |i, _| {
                let s = (0.01 + if first(i) { a * a } else { b * b }).sqrt();
                1.0 + 0.1 * i as f64
                    + s * {
                        let z: f64 = StandardNormal.sample(&mut rng);
                        z
                    }
            });
            let diagonal = |f: &dyn Fn(usize) -> f64| DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| f(i)));
            let model = Components {
                residual,
                jacobian: DMatrix::from_fn(n, 2, |i, j| if j == 0 { 1.0 } else { i as f64 }),
                known: diagonal(&|_| 0.01),
                parts: vec![
                    diagonal(&|i| if first(i) { 1.0 } else { 0.0 }),
                    diagonal(&|i| if first(i) { 0.0 } else { 1.0 }),
                ],
            };
            let mut theta = vec![1.0, 1.0];
            for _ in 0..20 {
                theta = model.step(&theta, &[1e-6, 1e-6]).unwrap();
            }
            mean[0] += theta[0] / 40.0;
            mean[1] += theta[1] / 40.0;
        }
        // 40 repetitions with 80 and 160 residuals: 2.5 % and 1.8 % (1 sigma) of the variance.
        assert!((mean[0] / 0.25 - 1.0).abs() < 0.08 && (mean[1] / 4.0 - 1.0).abs() < 0.06, "{mean:?}");
    }
}
