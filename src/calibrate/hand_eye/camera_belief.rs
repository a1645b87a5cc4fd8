//! In: the covariance of a calibrated camera, and what the hand-eye pictures' own pixels say about it. Out: the
//! camera as both know it, before the robot's poses speak.
//! Frame and unit: px and the lens's own (docs/math.md, Hand-eye (9)).

use super::closed::Pair;
use crate::calibrate::camera::ray_error::expected_ray_error;
use crate::camera::{CameraCovariance, Intrinsics, ParameterMatrix, Parameters};

/// Change of the camera's parameters from those that the boards were measured with: mean + root z, z ~ N(0, I).
/// The root has no inverse where a parameter counts as known.
#[derive(Clone, Copy, Debug)]
pub struct CameraBelief {
    /// Expected change, in the order and units of [`crate::camera::NAMES`].
    pub mean: Parameters,
    /// A root of the change's covariance: z has the columns, the parameters have the rows.
    pub root: ParameterMatrix,
}

/// A belief after pictures were seen.
pub struct Sharpened {
    /// What is believed now.
    pub belief: CameraBelief,
    /// New z by the old one: how the belief follows the camera that was given.
    pub by_given: ParameterMatrix,
    /// Squared Mahalanobis distance of what the pictures say from what was given, and its degrees of freedom.
    pub surprise: f64,
    /// Directions of z that the pictures say something about.
    pub freedom: f64,
}

impl CameraBelief {
    /// A camera that is right on average.
    pub fn given(covariance: &CameraCovariance) -> CameraBelief {
        // Correlations: the parameters' units differ by orders of magnitude.
        let sigma = Parameters::from_fn(|i, _| covariance[(i, i)].max(0.0).sqrt());
        let inverse = sigma.map(|s| if s > 0.0 { 1.0 / s } else { 0.0 });
        let correlation = ParameterMatrix::from_fn(|i, j| covariance[(i, j)] * inverse[i] * inverse[j]);
        let e = correlation.symmetric_eigen();
        let length = e.eigenvalues.map(|l| l.max(0.0).sqrt());
        let root = ParameterMatrix::from_diagonal(&sigma) * e.eigenvectors * ParameterMatrix::from_diagonal(&length);
        CameraBelief { mean: Parameters::zeros(), root }
    }

    /// The directions of z that lead anywhere.
    pub fn directions(&self) -> Vec<usize> {
        (0..self.root.ncols()).filter(|&i| self.root.column(i).amax() > 0.0).collect()
    }

    /// Of the change of the camera's parameters.
    pub fn covariance(&self) -> ParameterMatrix {
        self.root * self.root.transpose()
    }

    /// With what these pictures say, the features' sigmas being `factor` times the stated ones.
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
        // The pictures alone place z with information `learnt`; given and said differ by (1 + 1/learnt) in each
        // direction, and z is learnt/(1 + learnt) of their difference.
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

/// What a covariance of the parameters, or the square of one change of them, means for the viewing rays: px rms over
/// the image, after the rotation that a hand-eye transform makes up for.
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
