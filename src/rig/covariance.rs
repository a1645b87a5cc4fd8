//! In: what a solver or a file states about its parameters' errors. Out: the covariance, checked for validity.
//! Frame and unit: units of the parameters, which are in their names, multiplied.

use super::Kind;
use crate::fault::{Fault, Result};
use crate::geometry::not_a_covariance;
use nalgebra::{DMatrix, SMatrix};

/// Covariance of named parameters; `matrix[i][j]` belongs to `parameters[i]`, `parameters[j]`. Each name ends with
/// its unit: `fx_px`, `tx_mm`, `rx_rad`. Without parameters the covariance is unknown.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Covariance {
    /// Names, in the order of the matrix; empty if the covariance is unknown.
    pub parameters: Vec<String>,
    /// Square and symmetric, row by row.
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    /// `matrix` must have one row and one column per name; anything else panics.
    pub fn new(parameters: &[&str], matrix: &DMatrix<f64>) -> Covariance {
        assert_eq!((parameters.len(), parameters.len()), matrix.shape());
        Covariance {
            parameters: parameters.iter().map(|s| s.to_string()).collect(),
            matrix: matrix.row_iter().map(|r| r.iter().copied().collect()).collect(),
        }
    }
    /// Standard deviation of one parameter.
    pub fn sigma(&self, name: &str) -> Option<f64> {
        let i = self.parameters.iter().position(|p| p == name)?;
        Some(self.matrix.get(i)?.get(i)?.max(0.0).sqrt())
    }
    /// The covariance of these parameters in this order; parameters that it does not name count as exactly known.
    pub fn of<const N: usize>(&self, names: [&str; N]) -> SMatrix<f64, N, N> {
        let at = names.map(|n| self.parameters.iter().position(|p| p == n));
        SMatrix::from_fn(|i, j| match (at[i], at[j]) {
            (Some(a), Some(b)) => self.matrix[a][b],
            _ => 0.0,
        })
    }
    /// As a matrix. [`Covariance::check`] guarantees the shape.
    pub fn to_matrix(&self) -> DMatrix<f64> {
        let n = self.parameters.len();
        DMatrix::from_fn(n, n, |i, j| self.matrix[i][j])
    }

    /// Refuses anything that is no covariance of this kind's parameters: other names or another order, another
    /// shape, numbers that are not finite, a matrix that is not symmetric or not positive semidefinite.
    pub fn check(&self, kind: Kind) -> Result<()> {
        let bad = |what: String| {
            Err(Fault::input(format!("the covariance {what}"))
                .cause("edited by hand, or written by another program")
                .next("calibrate again"))
        };
        let (names, counts) = kind.parameters();
        let n = self.parameters.len();
        // A camera's further terms are named if they were free, in their order.
        let given = |from: usize, name: &String| names[from..].iter().position(|n| n == name).map(|i| from + i + 1);
        let in_order = |from: usize| self.parameters[from..].iter().try_fold(from, &given).is_some();
        let begins = |&c: &usize| c <= n && self.parameters[..c].iter().eq(names[..c].iter());
        let longest = counts.iter().copied().max().unwrap_or(0);
        let known = counts.iter().any(|c| *c == n && begins(c)) || (begins(&longest) && in_order(longest));
        if n > 0 && !known {
            let wanted: Vec<String> = counts.iter().map(|&n| names[..n].join(" ")).collect();
            return bad(format!(
                "is of {}; a {} has {}",
                self.parameters.join(" "),
                kind.words(),
                wanted.join(", or ")
            ));
        }
        if self.matrix.len() != n || self.matrix.iter().any(|row| row.len() != n) {
            let rows = self.matrix.iter().map(Vec::len).max().unwrap_or(0);
            return bad(format!("is {}x{rows}, its {n} parameters need {n}x{n}", self.matrix.len()));
        }
        not_a_covariance(&self.parameters, &self.to_matrix()).map_or(Ok(()), bad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_covariances_pass() {
        let names = Kind::LaserPlane.parameters().0;
        // Rank 3: the error of a unit normal lies along its tangent.
        let root = DMatrix::from_fn(4, 3, |i, j| ((i * 7 + j * 3) % 5) as f64 * if i == 3 { 0.1 } else { 1e-4 });
        let good = Covariance::new(names, &(&root * root.transpose()));
        good.check(Kind::LaserPlane).unwrap();
        Covariance::default().check(Kind::LaserPlane).unwrap();
        Covariance::new(names, &DMatrix::zeros(4, 4)).check(Kind::LaserPlane).unwrap();
        let edits: [(&str, fn(&mut Covariance)); 9] = [
            ("below 0", |c| c.matrix[3][3] = -1e-3),
            ("not symmetric", |c| c.matrix[0][3] *= 1.001),
            ("beyond", |c| (c.matrix[0][3], c.matrix[3][0]) = (1.0, 1.0)),
            ("eigenvalue", |c| {
                let s: Vec<f64> = (0..4).map(|i| c.matrix[i][i].sqrt()).collect();
                for (i, j, r) in [(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)] {
                    (c.matrix[i][j], c.matrix[j][i]) = (r * s[i] * s[j], r * s[i] * s[j]);
                }
            }),
            ("not finite", |c| c.matrix[1][1] = f64::NAN),
            ("4x3", |c| c.matrix.iter_mut().for_each(|row| row.truncate(3))),
            ("3x4", |c| c.matrix.truncate(3)),
            ("a laser plane has", |c| c.parameters.swap(0, 1)),
            ("a laser plane has", |c| c.parameters.truncate(2)),
        ];
        for (want, edit) in edits {
            let mut c = good.clone();
            edit(&mut c);
            let said = c.check(Kind::LaserPlane).unwrap_err().what;
            assert!(said.contains(want), "{want}: {said}");
        }
    }

    #[test]
    fn a_camera_names_nine_and_those_of_the_others_that_were_free() {
        let check =
            |kind: Kind, names: &[&str]| Covariance::new(names, &DMatrix::zeros(names.len(), names.len())).check(kind);
        let nine = &crate::camera::NAMES[..9];
        let beam = &Kind::Pointer.parameters().0[..6];
        for more in [&[][..], &["skew_px"], &["k4", "k5", "k6"], &["s1", "tau_x_rad", "tau_y_rad"]] {
            check(Kind::Camera, &[nine, more].concat()).unwrap();
            check(Kind::Pointer, &[beam, nine, more].concat()).unwrap();
        }
        check(Kind::Pointer, beam).unwrap();
        for wrong in [&["k5", "k4"][..], &["k3"], &["k7"], &["s1", "s1"]] {
            assert!(check(Kind::Camera, &[nine, wrong].concat()).is_err());
            assert!(check(Kind::Pointer, &[beam, wrong].concat()).is_err());
        }
        assert!(check(Kind::Camera, &nine[..8]).is_err() && check(Kind::LaserPlane, &[beam, nine].concat()).is_err());
    }
}
