//! In: 3x3 matrices and rotation vectors. Out: proper rotations, their logarithms, and the orthonormality error of a
//! given matrix (docs/math.md eq. 1 to 3).
//! Frame and unit: none; radians.

use super::{Mat3, Vec3};
use crate::fault::{Fault, Result};

/// Orthonormality error that a few products of rotations in double precision leave.
const ROUNDED: f64 = 1e-13;
/// Orthonormality error (Frobenius norm of RᵀR − I) above which a repair is reported.
pub const ORTHONORMAL_WARN: f64 = 1e-3;
/// Orthonormality error above which a matrix is refused as a rotation.
pub const ORTHONORMAL_REFUSE: f64 = 1e-2;

/// The cross-product matrix: `skew(a) * b == a × b`.
pub fn skew(a: &Vec3) -> Mat3 {
    Mat3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Rotation vector (axis times angle) to matrix, by Rodrigues' formula.
pub fn exp(w: &Vec3) -> Mat3 {
    let a = w.norm();
    let k = skew(w);
    // Below 1e-5 rad the series is exact to 1e-20 while sin(a)/a loses digits.
    let (s, c) =
        if a < 1e-5 { (1.0 - a * a / 6.0, 0.5 - a * a / 24.0) } else { (a.sin() / a, (1.0 - a.cos()) / (a * a)) };
    Mat3::identity() + k * s + k * k * c
}

/// Matrix to rotation vector, accurate from 0 to half a turn inclusive.
pub fn log(r: &Mat3) -> Vec3 {
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*r));
    let v = q.imag();
    let n = v.norm();
    if n < 1e-12 {
        return v * 2.0 * q.w.signum();
    }
    let angle = 2.0 * n.atan2(q.w.abs());
    v * (angle / n * if q.w < 0.0 { -1.0 } else { 1.0 })
}

/// Angle between two rotations, rad, accurate near 0.
pub fn angle_between(a: &Mat3, b: &Mat3) -> f64 {
    log(&(a.transpose() * b)).norm()
}

/// The rotation nearest to `m` in the Frobenius norm (polar factor by SVD).
pub fn orthonormalise(m: &Mat3) -> Mat3 {
    let svd = m.svd(true, true);
    let (u, vt) = (svd.u.expect("asked for"), svd.v_t.expect("asked for"));
    let d = (u * vt).determinant();
    u * Mat3::from_diagonal(&Vec3::new(1.0, 1.0, d.signum())) * vt
}

/// A rotation that was made orthonormal, with its orthonormality error before the repair.
#[derive(Clone, Copy, Debug)]
pub struct Repaired {
    /// The rotation nearest to the matrix.
    pub rotation: Mat3,
    /// Frobenius norm of RᵀR − I before the repair, 0..=[`ORTHONORMAL_REFUSE`].
    pub departure: f64,
}

impl Repaired {
    /// True where the user should be warned that the numbers were not a rotation.
    pub fn worth_a_warning(&self) -> bool {
        self.departure > ORTHONORMAL_WARN
    }
}

/// Repairs a nearly orthonormal matrix; refuses mirrors, non-finite numbers and orthonormality errors above
/// [`ORTHONORMAL_REFUSE`].
pub fn repair(m: &Mat3) -> Result<Repaired> {
    if m.iter().any(|x| !x.is_finite()) {
        return Err(Fault::input("a rotation holds a number that is not finite")
            .cause("NaN or infinity in a pose file")
            .next("export the pose again from the robot"));
    }
    let departure = (m.transpose() * m - Mat3::identity()).norm();
    if departure > ORTHONORMAL_REFUSE || m.determinant() < 0.0 {
        return Err(Fault::input(format!(
            "a rotation is not orthonormal: |RᵀR − I| = {departure:.2e}, determinant {:.4}, limit \
             {ORTHONORMAL_REFUSE:.0e}",
            m.determinant()
        ))
        .cause("columns and rows swapped, a left-handed frame, or too few digits printed")
        .next("give the pose with more digits, or name the convention it was written in"));
    }
    // A matrix with rounding errors alone is returned bit for bit: a record that is read and stored again must not
    // change.
    let rotation = if departure < ROUNDED { *m } else { orthonormalise(m) };
    Ok(Repaired { rotation, departure })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_rotation_in_all_its_digits_is_kept_bit_for_bit() {
        let mut r = exp(&Vec3::new(0.3, -1.1, 0.7));
        for k in 0..100 {
            r *= exp(&Vec3::new(0.01 * f64::from(k), 0.2, -0.1));
            let read = repair(&r).unwrap().rotation;
            assert_eq!(read, r);
        }
        let rounded = r.map(|v| (v * 1e6).round() / 1e6);
        let repaired = repair(&rounded).unwrap().rotation;
        assert!((repaired.transpose() * repaired - Mat3::identity()).norm() < 1e-15 && repaired != rounded);
        assert_eq!(repair(&repaired).unwrap().rotation, repaired);
    }

    proptest! {
        #[test]
        fn log_undoes_exp(x in -1.8f64..1.8, y in -1.8f64..1.8, z in -1.8f64..1.8) {
            let w = Vec3::new(x, y, z);
            prop_assert!((log(&exp(&w)) - w).norm() < 1e-9);
        }
        #[test]
        fn exp_is_a_rotation(x in -9.0f64..9.0, y in -9.0f64..9.0, z in -9.0f64..9.0) {
            let r = exp(&Vec3::new(x, y, z));
            prop_assert!((r.transpose() * r - Mat3::identity()).norm() < 1e-12);
            prop_assert!((r.determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn mirrors_and_nan_are_refused() {
        assert!(repair(&Mat3::from_diagonal(&Vec3::new(1.0, 1.0, -1.0))).is_err());
        assert!(repair(&Mat3::from_element(f64::NAN)).is_err());
        assert!(repair(&(Mat3::identity() * 1.01)).is_err());
        let slightly = repair(&(Mat3::identity() * 1.001)).unwrap();
        assert!(slightly.worth_a_warning() && (slightly.rotation - Mat3::identity()).norm() < 1e-12);
    }
}
