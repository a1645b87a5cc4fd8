//! In: groups of residuals with the few columns of the Jacobian that they touch. Out: the normal
//! equations JᵀWJ, JᵀWr and what the covariance needs (docs/math.md, Least squares (1) to (4)).
//! Frame and unit: none.

use super::Loss;
use nalgebra::{DMatrix, DVector};

/// Collects residuals. A problem calls [`Residuals::group`] for every measurement, and [`Residuals::prior`] for prior
/// knowledge, which the robust loss does not reduce.
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
    /// Sums of the last groups, which touch the same columns; they are added to the matrix together, in `settle`.
    columns: Vec<usize>,
    block: Vec<f64>,
    block_gradient: Vec<f64>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Group {
    pub size: usize,
    pub length: f64,
    pub weight: f64,
    pub prior: bool,
}

/// Sums for the covariance of an M-estimate: psi = w r.
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
            columns: Vec::new(),
            block: Vec::new(),
            block_gradient: Vec::new(),
        }
    }

    /// False while only the cost is needed: Jacobians are then not read and may be empty.
    pub fn wants_jacobian(&self) -> bool {
        self.wants_jacobian
    }

    /// One measurement: its residuals (judged together by the robust loss), the parameters they
    /// depend on, and their derivatives, row-major `residual.len()` x `columns.len()`.
    pub fn group(&mut self, residual: &[f64], columns: &[usize], jacobian: &[f64]) {
        self.add(residual, columns, jacobian, self.loss, self.scale, false);
    }

    /// Like [`Residuals::group`], but always quadratic and in absolute sigmas.
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
        if self.columns != columns {
            self.settle();
            self.columns.extend_from_slice(columns);
            self.block.resize(k * k, 0.0);
            self.block_gradient.resize(k, 0.0);
        }
        let w = w * inv;
        for (row, r) in j.chunks_exact(k).zip(r) {
            let wr = w * r;
            self.block_gradient.iter_mut().zip(row).for_each(|(g, x)| *g += wr * x);
            for (sums, a) in self.block.chunks_exact_mut(k).zip(row) {
                let wa = w * a;
                sums.iter_mut().zip(row).for_each(|(h, b)| *h += wa * b);
            }
        }
    }

    /// Adds the sums of the last groups to the equations; it must run before the equations are read.
    pub(super) fn settle(&mut self) {
        let k = self.columns.len();
        for (a, &ca) in self.columns.iter().enumerate() {
            self.gradient[ca] += self.block_gradient[a];
            for (b, &cb) in self.columns.iter().enumerate().take(a + 1) {
                // Only the lower triangle is filled; the order of columns is the caller's.
                let (row, col) = if ca >= cb { (ca, cb) } else { (cb, ca) };
                self.hessian[(row, col)] += self.block[a * k + b];
            }
        }
        self.columns.clear();
        self.block.clear();
        self.block_gradient.clear();
    }
}
