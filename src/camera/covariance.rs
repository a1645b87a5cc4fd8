//! In: what a calibration states about its camera's errors. Out: a matrix that is known to be a covariance.
//! Frame and unit: rows and columns in the order of [`NAMES`], units multiplied.

use super::parameters::{ALWAYS_NAMED, NAMES, PARAMETERS, ParameterMatrix, Parameters};
use crate::fault::{Fault, Result};
use crate::geometry::not_a_covariance;
use nalgebra::DMatrix;

/// Covariance of a camera's numbers: rows and columns in the order of [`NAMES`] (fx fy cx cy, the lens's terms,
/// skew), units multiplied. It is finite, symmetric and positive semidefinite. A parameter without variance counts
/// as exactly known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraCovariance(ParameterMatrix);

impl CameraCovariance {
    /// # Errors
    /// A matrix that is no covariance.
    pub fn new(matrix: ParameterMatrix) -> Result<CameraCovariance> {
        match not_a_covariance(&NAMES, &DMatrix::from_column_slice(PARAMETERS, PARAMETERS, matrix.as_slice())) {
            None => Ok(CameraCovariance(matrix)),
            Some(what) => Err(Fault::refused(format!("the camera's covariance {what}"))
                .cause("the pictures hardly determine the camera, or the covariance was not written by a calibration")
                .next(
                    "calibrate the camera again, with boards tilted by 20 to 40 degrees that reach into the corners",
                )),
        }
    }

    /// The covariance of a camera without error.
    pub fn exact() -> CameraCovariance {
        CameraCovariance(ParameterMatrix::zeros())
    }

    /// The covariance of independent parameters with these standard deviations.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn independent(sigma: &Parameters) -> Result<CameraCovariance> {
        CameraCovariance::new(ParameterMatrix::from_diagonal(&sigma.map(|s| s * s)))
    }

    /// The matrix.
    pub fn matrix(&self) -> &ParameterMatrix {
        &self.0
    }

    /// Indices of the parameters that a file names: the first nine, and those with nonzero variance.
    pub fn named(&self) -> Vec<usize> {
        named(&self.0)
    }
}

impl std::ops::Index<(usize, usize)> for CameraCovariance {
    type Output = f64;
    fn index(&self, at: (usize, usize)) -> &f64 {
        &self.0[at]
    }
}

/// [`CameraCovariance::named`] of a block of a larger matrix.
pub fn named(covariance: &ParameterMatrix) -> Vec<usize> {
    (0..PARAMETERS).filter(|&i| i < ALWAYS_NAMED || covariance[(i, i)] != 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_covariances_are_taken() {
        let sigma = Parameters::from_fn(|i, _| if i < 9 { 0.1 } else { 0.0 });
        let good = CameraCovariance::independent(&sigma).unwrap();
        assert_eq!((good.named(), good[(3, 3)], good[(3, 4)]), ((0..9).collect(), 0.1 * 0.1, 0.0));
        assert_eq!(CameraCovariance::exact().matrix(), &ParameterMatrix::zeros());
        let edits: [(&str, fn(&mut ParameterMatrix)); 5] = [
            ("below 0", |c| c[(3, 3)] = -1e-9),
            ("not finite", |c| c[(4, 2)] = f64::NAN),
            ("between fy_px and fx_px: not symmetric", |c| c[(0, 1)] = 1e-3),
            ("beyond", |c| (c[(0, 12)], c[(12, 0)]) = (1e-3, 1e-3)),
            ("eigenvalue", |c| {
                for (i, j, r) in [(0, 1, 0.9), (1, 2, 0.9), (0, 2, -0.9)] {
                    (c[(i, j)], c[(j, i)]) = (r * c[(i, i)], r * c[(i, i)]);
                }
            }),
        ];
        for (want, edit) in edits {
            let mut c = *good.matrix();
            edit(&mut c);
            let said = CameraCovariance::new(c).unwrap_err();
            assert!(said.what.contains(want) && !said.next.is_empty(), "{want}: {said}");
        }
    }
}
