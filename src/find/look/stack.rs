//! In: scans of one part and other measurements of it, each with its own covariance and the levers of errors that all
//! share.
//! Out: one vector with its joint covariance, the pose of least variance, and the contrasts that are zero if all is as
//! stated.
//! Frame and unit: base axes, mm and rad; sizes in the part's axes. docs/math.md, Second look (1) to (3).

use super::levers::Lever;
use super::size_check::{of_part, size_rows};
use crate::fault::{Fault, Result};
use crate::find::insert::budget::{Budget, both};
use crate::geometry::{Base, Part, Rigid, log};
use nalgebra::{DMatrix, DVector, Matrix6, SVector};

pub(in crate::find) type Vector6 = SVector<f64, 6>;

/// One scan of the part.
#[derive(Clone, Copy)]
pub struct Look<'a> {
    /// The part's pose as this scan found it, mm.
    pub base_from_part: Rigid<Base, Part>,
    /// Its uncertainty, and the levers that it shares with other scans.
    pub budget: &'a Budget,
}

/// Measurements that depend on the part's pose but do not determine it: they are checked against it.
#[derive(Clone, Debug)]
pub struct Witness {
    /// Measured values, less those predicted by the first scan's pose.
    pub values: DVector<f64>,
    /// Their own covariance, which nothing shares.
    pub own: DMatrix<f64>,
    /// Change with a motion of the part (shift, turn; base axes); n x 6.
    pub by_pose: DMatrix<f64>,
    /// Levers on them; a lever with the same name as a scan's shares its error. Jacobians n x parameters.
    pub levers: Vec<Lever>,
}

/// Motion from the first scan's pose to another's: shift of the part's origin, then turn; base axes.
pub(in crate::find) fn motion(from: &Rigid<Base, Part>, to: &Rigid<Base, Part>) -> Vector6 {
    let turn = log(&(to.rotation * from.rotation.transpose()));
    let shift = to.translation - from.translation;
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// A shared error: of a calibration, or one that nothing states.
pub(in crate::find) struct Shared {
    pub name: &'static str,
    pub parameters: &'static [&'static str],
    /// Effect of each parameter on all rows of the stack.
    pub lever: DMatrix<f64>,
    pub covariance: DMatrix<f64>,
    pub supposed: bool,
}

/// Everything measured: six rows for each scan, then three for each scan whose sizes were measured, then the witness's.
pub(in crate::find) struct Stack {
    pub looks: usize,
    pub values: DVector<f64>,
    pub covariance: DMatrix<f64>,
    /// Change of each row with the part's pose.
    by_pose: DMatrix<f64>,
    pub shared: Vec<Shared>,
    /// Rows of the witness.
    pub witness: std::ops::Range<usize>,
}

/// Contrasts that gates judge one by one: if all is as stated, each is zero to within its standard deviation.
pub(in crate::find) struct Gauges {
    /// As combinations of the stack's rows.
    pub rows: DMatrix<f64>,
    pub sigmas: DVector<f64>,
}

impl Stack {
    pub fn new(looks: &[Look], witness: Option<&Witness>, size_sigma: f64) -> Stack {
        let shapes: Vec<_> =
            looks.iter().map(|l| l.budget.shape).enumerate().filter_map(|(i, s)| Some((i, s?))).collect();
        let (poses, sizes) = (6 * looks.len(), 3 * shapes.len());
        let n = poses + sizes + witness.map_or(0, |w| w.values.len());
        let mut stack = Stack {
            looks: looks.len(),
            values: DVector::zeros(n),
            covariance: DMatrix::zeros(n, n),
            by_pose: DMatrix::zeros(n, 6),
            shared: Vec::new(),
            witness: poses + sizes..n,
        };
        for (i, look) in looks.iter().enumerate() {
            stack.values.rows_mut(6 * i, 6).copy_from(&motion(&looks[0].base_from_part, &look.base_from_part));
            let turn = both(&look.base_from_part.rotation);
            stack.covariance.view_mut((6 * i, 6 * i), (6, 6)).copy_from(&(turn * look.budget.own * turn.transpose()));
            stack.by_pose.view_mut((6 * i, 0), (6, 6)).fill_with_identity();
        }
        for (k, (_, shape)) in shapes.iter().enumerate() {
            stack.values.rows_mut(poses + 3 * k, 3).copy_from(&shape.strain);
            stack.covariance.view_mut((poses + 3 * k, poses + 3 * k), (3, 3)).copy_from(&shape.covariance);
        }
        if let Some(w) = witness {
            let (at, m) = (poses + sizes, w.values.len());
            stack.values.rows_mut(at, m).copy_from(&w.values);
            stack.covariance.view_mut((at, at), (m, m)).copy_from(&w.own);
            stack.by_pose.rows_mut(at, m).copy_from(&w.by_pose);
        }
        let of_looks: Vec<usize> = shapes.iter().map(|s| s.0).collect();
        stack.share(looks, &of_looks, witness);
        if !shapes.is_empty() && size_sigma > 0.0 {
            let mut lever = DMatrix::zeros(n, 3);
            (0..sizes).for_each(|r| lever[(poses + r, r % 3)] = 1.0);
            let c = of_part(size_sigma);
            stack.shared.push(Shared {
                name: "part's own sizes",
                parameters: &["x share", "y share", "shear rad"],
                lever,
                covariance: DMatrix::from_fn(3, 3, |r, k| c[(r, k)]),
                supposed: false,
            });
        }
        for s in stack.shared.iter().filter(|s| !s.supposed) {
            stack.covariance += &s.lever * &s.covariance * s.lever.transpose();
        }
        stack
    }

    /// Collects the levers of one name over all rows; `sized`: the scans that have rows of sizes.
    fn share(&mut self, looks: &[Look], sized: &[usize], witness: Option<&Witness>) {
        let n = self.values.len();
        let of_witness = witness.map_or(&[][..], |w| &w.levers);
        let mut names: Vec<&Lever> = looks[0].budget.levers.iter().collect();
        names.extend(of_witness.iter().filter(|l| looks[0].budget.levers.iter().all(|o| o.name != l.name)));
        for first in names {
            let Some(covariance) = first.covariance.clone() else { continue };
            let mut lever = DMatrix::zeros(n, covariance.nrows());
            for (i, look) in looks.iter().enumerate() {
                let Some(l) = look.budget.levers.iter().find(|l| l.name == first.name) else { continue };
                lever.rows_mut(6 * i, 6).copy_from(&l.jacobian.rows(0, 6));
                if let Some(k) = sized.iter().position(|&s| s == i) {
                    lever.rows_mut(6 * looks.len() + 3 * k, 3).copy_from(&l.jacobian.rows(6, 3));
                }
            }
            if let Some(l) = of_witness.iter().find(|l| l.name == first.name) {
                lever.rows_mut(self.witness.start, self.witness.len()).copy_from(&l.jacobian);
            }
            let Lever { name, parameters, supposed, .. } = *first;
            self.shared.push(Shared { name, parameters, lever, covariance, supposed });
        }
    }

    /// How the motion of least variance follows from the scans' rows, 6 x all rows (sizes and witness do not
    /// contribute), and its covariance.
    pub fn agreed(&self) -> Result<(DMatrix<f64>, Matrix6<f64>)> {
        let n = 6 * self.looks;
        let weights = self.covariance.view((0, 0), (n, n)).clone_owned().cholesky().ok_or_else(singular)?;
        let each = self.by_pose.rows(0, n).clone_owned();
        let covariance = (each.transpose() * weights.solve(&each)).cholesky().ok_or_else(singular)?.inverse();
        let mut follow = DMatrix::zeros(6, self.values.len());
        follow.columns_mut(0, n).copy_from(&(&covariance * weights.solve(&each).transpose()));
        Ok((follow, Matrix6::from_iterator(covariance.iter().copied())))
    }

    /// What is zero if all is as stated: every row less its prediction from the first scan's pose, as combinations of
    /// the stack's rows.
    pub fn contrasts(&self) -> DMatrix<f64> {
        let n = self.values.len();
        let mut d = DMatrix::zeros(n - 6, n);
        for r in 6..n {
            d[(r - 6, r)] = 1.0;
            (0..6).for_each(|k| d[(r - 6, k)] -= self.by_pose[(r, k)]);
        }
        d
    }

    /// What gates judge: differences of any two scans along the part's axes, the sizes of each scan along and across
    /// its stripe, the witness's mean compared with the agreed pose.
    pub fn gauges(&self, looks: &[Look], into_part: &Matrix6<f64>, follow: &DMatrix<f64>) -> Result<Gauges> {
        let n = self.values.len();
        let mut rows: Vec<DVector<f64>> = Vec::new();
        for i in 0..self.looks {
            for j in i + 1..self.looks {
                rows.extend((0..6).map(|r| {
                    let mut row = DVector::zeros(n);
                    (0..6).for_each(|k| (row[6 * j + k], row[6 * i + k]) = (into_part[(r, k)], -into_part[(r, k)]));
                    row
                }));
            }
        }
        let sized = looks.iter().filter(|l| l.budget.shape.is_some());
        for (k, look) in sized.enumerate() {
            let Some(seen) = &look.budget.seen else { continue };
            rows.extend(size_rows(&seen.scan_axes()).iter().map(|of| {
                let mut row = DVector::zeros(n);
                (0..3).for_each(|c| row[6 * self.looks + 3 * k + c] = of[c]);
                row
            }));
        }
        if !self.witness.is_empty() {
            let witnessed = self.witnessed(follow);
            rows.push((self.witness_weights(follow)?.0.transpose() * witnessed).transpose());
        }
        let rows = DMatrix::from_fn(rows.len(), n, |r, c| rows[r][c]);
        let variances = (&rows * &self.covariance * rows.transpose()).diagonal();
        Ok(Gauges { rows, sigmas: variances.map(|v| v.max(1e-24).sqrt()) })
    }

    /// Weights of the witness's rows in their mean, and its variance.
    pub fn witness_weights(&self, follow: &DMatrix<f64>) -> Result<(DVector<f64>, f64)> {
        let rows = self.witnessed(follow);
        let c = (&rows * &self.covariance * rows.transpose()).cholesky().ok_or_else(singular)?;
        let ones = DVector::from_element(rows.nrows(), 1.0);
        let weighted = c.solve(&ones);
        let variance = 1.0 / ones.dot(&weighted);
        Ok((weighted * variance, variance))
    }

    /// The witness's rows less their prediction from the agreed pose, as combinations of the stack's rows.
    pub fn witnessed(&self, follow: &DMatrix<f64>) -> DMatrix<f64> {
        let (at, m) = (self.witness.start, self.witness.len());
        let mut d = -(self.by_pose.rows(at, m) * follow);
        (0..m).for_each(|k| d[(k, at + k)] += 1.0);
        d
    }
}

pub(in crate::find) fn singular() -> Fault {
    Fault::refused("the scans' covariances cannot be combined: a standard deviation is zero")
        .cause("a calibration or recipe with a stated uncertainty of zero")
        .next("calibrate with uncertainty, or give the recipe's robot its repeatability")
}
