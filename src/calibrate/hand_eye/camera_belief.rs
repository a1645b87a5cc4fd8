//! In: the covariance of a calibrated camera, and the information about it in the hand-eye pictures' own pixels. Out:
//! the camera by both, before the robot's poses are used.
//! Frame and unit: px and the lens's own (docs/math.md, Hand-eye (9)).

use super::closed::Pair;
use crate::calibrate::camera::ray_error::expected_ray_error;
use crate::camera::{CameraCovariance, Intrinsics, ParameterMatrix, Parameters};

/// Change of the camera's parameters from those that the boards were measured with: mean + root z, z ~ N(0, I). The
/// root has no inverse if a parameter counts as known.
#[derive(Clone, Copy, Debug)]
pub struct CameraBelief {
    /// Expected change, in the order and units of [`crate::camera::NAMES`].
    pub mean: Parameters,
    /// A root of the change's covariance: columns belong to z, rows to the parameters.
    pub root: ParameterMatrix,
}

/// A belief updated by pictures.
pub struct Sharpened {
    /// The updated belief.
    pub belief: CameraBelief,
    /// Derivatives of the new z by the old one: how the belief follows the given camera.
    pub by_given: ParameterMatrix,
    /// Squared Mahalanobis distance between the camera by the pictures and the given one.
    pub surprise: f64,
    /// Degrees of freedom: number of directions of z that the pictures contain information about.
    pub freedom: f64,
}

impl CameraBelief {
    /// The belief of a given calibration: no expected change.
    pub fn given(covariance: &CameraCovariance) -> CameraBelief {
        // Correlations, because the parameters' units differ by orders of magnitude.
        let sigma = Parameters::from_fn(|i, _| covariance[(i, i)].max(0.0).sqrt());
        let inverse = sigma.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 });
        let correlation = ParameterMatrix::from_fn(|i, j| covariance[(i, j)] * inverse[i] * inverse[j]);
        let e = correlation.symmetric_eigen();
        let length = e.eigenvalues.map(|l| l.max(0.0).sqrt());
        let root = ParameterMatrix::from_diagonal(&sigma) * e.eigenvectors * ParameterMatrix::from_diagonal(&length);
        CameraBelief { mean: Parameters::zeros(), root }
    }

    /// The directions of z that change any parameter.
    pub fn directions(&self) -> Vec<usize> {
        (0..self.root.ncols()).filter(|&i| self.root.column(i).amax() > 0.0).collect()
    }

    /// Covariance of the change of the camera's parameters.
    pub fn covariance(&self) -> ParameterMatrix {
        self.root * self.root.transpose()
    }

    /// The belief updated by the pixels of these pictures, with feature sigmas of `factor` times the stated ones.
    pub fn after(&self, pairs: &[&Pair], factor: f64) -> Option<Sharpened> {
        let (mut information, mut gradient) = (ParameterMatrix::zeros(), Parameters::zeros());
        for pair in pairs {
            let said = &pair.seen.about_camera;
            information += said.information / (factor * factor);
            gradient += said.gradient / (factor * factor);
        }
        gradient += information * self.mean;
        let learnt = self.root.transpose() * information * self.root;
        let cholesky = (ParameterMatrix::identity() + learnt).cholesky()?;
        let z = -cholesky.solve(&(self.root.transpose() * gradient));
        let by_given = cholesky.l().try_inverse()?;
        // The pictures alone determine z with information `learnt`. The difference between the given camera and
        // theirs has the variance 1 + 1/learnt in each direction, and z is learnt/(1 + learnt) of this difference.
        let e = learnt.symmetric_eigen();
        let along = e.eigenvectors.transpose() * z;
        let (mut surprise, mut freedom) = (0.0, 0.0);
        for (l, a) in e.eigenvalues.iter().zip(along.iter()).filter(|(l, _)| **l > 1e-3) {
            surprise += a * a * (1.0 + l) / l;
            freedom += 1.0;
        }
        let belief = CameraBelief { mean: self.mean + self.root * z, root: self.root * by_given.transpose() };
        Some(Sharpened { belief, by_given, surprise, freedom })
    }
}

/// Effect of a covariance of the parameters, or of the square of one change of them, on the viewing rays: px rms over
/// the image, after the rotation that a hand-eye transform can compensate.
pub fn ray_error_px(camera: &Intrinsics, covariance: &ParameterMatrix) -> f64 {
    expected_ray_error(camera, covariance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_is_a_root_also_where_parameters_are_known() {
        let mut c = ParameterMatrix::zeros();
        for i in 0..8 {
            for j in 0..8 {
                let scale = |k: usize| if k < 4 { 0.5 } else { 1e-3 };
                c[(i, j)] = scale(i) * scale(j) * if i == j { 1.0 } else { 0.9 };
            }
        }
        let back = CameraBelief::given(&CameraCovariance::new(c).unwrap()).covariance();
        assert!((back - c).iter().zip(c.iter()).all(|(d, c)| d.abs() <= 1e-12 * c.abs().max(1e-3)), "{back}");
    }
}
