//! In: groups of residuals with the few columns of the Jacobian that they touch. Out: the normal
//! equations JᵀWJ, JᵀWr and what the covariance needs (docs/math.md, Least squares (1) to (4)).
//! Frame and unit: none.

use super::Loss;
use nalgebra::{DMatrix, DVector};

/// Collects residuals. A problem calls [`Residuals::group`] for every measurement and
/// [`Residuals::prior`] for knowledge that is not to be doubted.
pub struct Residuals {
    loss: Loss,
    scale: f64,
    pub(super) wants_jacobian: bool,
    pub(super) cost: f64,
    pub(super) hessian: DMatrix<f64>,
    pub(super) gradient: DVector<f64>,
    /// Per group: number of residuals, unscaled length, weight.
    pub(super) groups: Vec<Group>,
    pub(super) psi: Psi,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub size: usize,
    pub length: f64,
    pub weight: f64,
    pub prior: bool,
}

/// Sums behind the covariance of an M-estimate: psi = w r.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Psi {
    pub residuals: f64,
    pub squared: f64,
    pub slope: f64,
    pub weight: f64,
}

impl Residuals {
    pub(super) fn new(width: usize, loss: Loss, scale: f64, wants_jacobian: bool) -> Residuals {
        let n = if wants_jacobian { width } else { 0 };
        Residuals {
            loss,
            scale,
            wants_jacobian,
            cost: 0.0,
            hessian: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            groups: Vec::new(),
            psi: Psi::default(),
        }
    }

    /// False while only the cost is needed: the Jacobians given then are not read and may be empty.
    pub fn wants_jacobian(&self) -> bool {
        self.wants_jacobian
    }

    /// One measurement: its residuals (judged together by the robust loss), the parameters they
    /// depend on, and their derivatives, row-major `residual.len()` x `columns.len()`.
    pub fn group(&mut self, residual: &[f64], columns: &[usize], jacobian: &[f64]) {
        self.add(residual, columns, jacobian, self.loss, self.scale, false);
    }

    /// As [`Residuals::group`], but always quadratic and in absolute sigmas.
    pub fn prior(&mut self, residual: &[f64], columns: &[usize], jacobian: &[f64]) {
        self.add(residual, columns, jacobian, Loss::Squares, 1.0, true);
    }

    fn add(&mut self, r: &[f64], columns: &[usize], j: &[f64], loss: Loss, scale: f64, prior: bool) {
        let (m, k, inv) = (r.len(), columns.len(), 1.0 / (scale * scale));
        let raw = r.iter().map(|x| x * x).sum::<f64>();
        let s = raw * inv;
        let (cost, w, slope) = loss.at(s);
        self.cost += cost;
        self.groups.push(Group { size: m, length: raw.sqrt(), weight: w, prior });
        if !prior {
            let m = m as f64;
            self.psi.residuals += m;
            self.psi.squared += w * w * s;
            self.psi.slope += m * w + 2.0 * slope * s;
            self.psi.weight += m * w;
        }
        if !self.wants_jacobian {
            return;
        }
        assert_eq!(j.len(), m * k, "a Jacobian of {m} residuals in {k} parameters");
        let w = w * inv;
        for (a, &ca) in columns.iter().enumerate() {
            let mut g = 0.0;
            for i in 0..m {
                g += j[i * k + a] * r[i];
            }
            self.gradient[ca] += w * g;
            for (b, &cb) in columns.iter().enumerate().take(a + 1) {
                let mut h = 0.0;
                for i in 0..m {
                    h += j[i * k + a] * j[i * k + b];
                }
                // Only the lower triangle is filled; the order of columns is the caller's.
                let (row, col) = if ca >= cb { (ca, cb) } else { (cb, ca) };
                self.hessian[(row, col)] += w * h;
            }
        }
    }
}
