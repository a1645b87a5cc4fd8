//! In: rotations and translations. Out: rigid transforms named `to_from_from`, typed by frame:
//! `p_in_base = base_from_flange * flange_from_camera` applied to `p_in_camera`.
//! Frame and unit: To and From are type parameters; millimetres.

use super::{Frame, Mat3, Vec3, exp, log, repair};
use crate::fault::{Fault, Result};
use std::marker::PhantomData;
use std::ops::Mul;

/// Maps coordinates in frame `From` to coordinates in frame `To`. The rotation is orthonormal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid<To: Frame, From: Frame> {
    /// 3 x 3, orthonormal, determinant 1; its columns are the axes of `From` in frame `To`.
    pub rotation: Mat3,
    /// Origin of `From` in frame `To`, mm.
    pub translation: Vec3,
    frames: PhantomData<(To, From)>,
}

impl<To: Frame, From: Frame> Rigid<To, From> {
    /// `rotation` must already be orthonormal; use [`Rigid::from_rows`] for numbers from outside.
    pub fn new(rotation: Mat3, translation: Vec3) -> Self {
        Rigid { rotation, translation, frames: PhantomData }
    }
    /// No turn and no shift.
    pub fn identity() -> Self {
        Self::new(Mat3::identity(), Vec3::zeros())
    }
    /// From a rotation vector (rad) and a translation (mm).
    pub fn from_vectors(rotation: &Vec3, translation: Vec3) -> Self {
        Self::new(exp(rotation), translation)
    }
    /// From a row-major 4x4 matrix. Returns the orthonormality error that was repaired; above
    /// [`super::ORTHONORMAL_WARN`] the caller should report it.
    pub fn from_rows(m: &[f64; 16]) -> Result<(Self, f64)> {
        if m.iter().any(|x| !x.is_finite()) {
            return Err(Fault::input("a pose holds a number that is not finite")
                .cause("NaN or infinity in a pose file")
                .next("export the pose again from the robot"));
        }
        if m[12].abs() > 1e-9 || m[13].abs() > 1e-9 || m[14].abs() > 1e-9 || (m[15] - 1.0).abs() > 1e-9 {
            return Err(Fault::input(format!(
                "the last row of a pose is {} {} {} {} instead of 0 0 0 1",
                m[12], m[13], m[14], m[15]
            ))
            .cause("the matrix is written column by column")
            .next("write 4x4 matrices row by row, translation in the last column"));
        }
        let r = repair(&Mat3::new(m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]))?;
        Ok((Self::new(r.rotation, Vec3::new(m[3], m[7], m[11])), r.departure))
    }
    /// As a row-major 4x4 matrix.
    pub fn to_rows(&self) -> [f64; 16] {
        let (r, t) = (&self.rotation, &self.translation);
        [
            r[(0, 0)],
            r[(0, 1)],
            r[(0, 2)],
            t.x,
            r[(1, 0)],
            r[(1, 1)],
            r[(1, 2)],
            t.y,
            r[(2, 0)],
            r[(2, 1)],
            r[(2, 2)],
            t.z,
            0.0,
            0.0,
            0.0,
            1.0,
        ]
    }
    /// The inverse transform, which maps `To` to `From`.
    pub fn inverse(&self) -> Rigid<From, To> {
        let rt = self.rotation.transpose();
        Rigid::new(rt, -(rt * self.translation))
    }
    /// Maps a position.
    pub fn point(&self, p: &Vec3) -> Vec3 {
        self.rotation * p + self.translation
    }
    /// Maps a direction: rotated, not shifted.
    pub fn direction(&self, d: &Vec3) -> Vec3 {
        self.rotation * d
    }
    /// Rotation angle (rad) and translation (mm) between two transforms of the same frames.
    pub fn difference(&self, other: &Self) -> (f64, f64) {
        (super::angle_between(&self.rotation, &other.rotation), (self.translation - other.translation).norm())
    }
    /// Rotation vector, rad.
    pub fn rotation_vector(&self) -> Vec3 {
        log(&self.rotation)
    }
}

impl<A: Frame, B: Frame, C: Frame> Mul<Rigid<B, C>> for Rigid<A, B> {
    type Output = Rigid<A, C>;
    fn mul(self, rhs: Rigid<B, C>) -> Rigid<A, C> {
        Rigid::new(self.rotation * rhs.rotation, self.rotation * rhs.translation + self.translation)
    }
}

impl<A: Frame, B: Frame, C: Frame> Mul<&Rigid<B, C>> for &Rigid<A, B> {
    type Output = Rigid<A, C>;
    fn mul(self, rhs: &Rigid<B, C>) -> Rigid<A, C> {
        *self * *rhs
    }
}

/// Stored as `[16 numbers]`, row-major.
impl<To: Frame, From: Frame> serde::Serialize for Rigid<To, From> {
    fn serialize<S: serde::Serializer>(&self, s: S) -> std::result::Result<S::Ok, S::Error> {
        self.to_rows().serialize(s)
    }
}

impl<'de, To: Frame, From: Frame> serde::Deserialize<'de> for Rigid<To, From> {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> std::result::Result<Self, D::Error> {
        let m = <[f64; 16]>::deserialize(d)?;
        Self::from_rows(&m).map(|(r, _)| r).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Base, Camera, Flange};
    use super::*;

    #[test]
    fn products_and_inverses_agree_with_points() {
        let base_from_flange: Rigid<Base, Flange> =
            Rigid::from_vectors(&Vec3::new(0.1, -0.4, 1.2), Vec3::new(10.0, 20.0, 30.0));
        let flange_from_camera: Rigid<Flange, Camera> =
            Rigid::from_vectors(&Vec3::new(-0.3, 0.2, 0.5), Vec3::new(-4.0, 5.0, 6.0));
        let p = Vec3::new(1.0, 2.0, 3.0);
        let whole = base_from_flange * flange_from_camera;
        let by_steps = base_from_flange.point(&flange_from_camera.point(&p));
        assert!((whole.point(&p) - by_steps).norm() < 1e-12);
        assert!((whole.inverse().point(&by_steps) - p).norm() < 1e-12);
        let (again, departure) = Rigid::<Base, Camera>::from_rows(&whole.to_rows()).unwrap();
        assert!(departure < 1e-12 && again.difference(&whole).1 < 1e-12);
    }

    #[test]
    fn a_transposed_matrix_is_refused() {
        let t: Rigid<Base, Flange> = Rigid::from_vectors(&Vec3::zeros(), Vec3::new(1.0, 2.0, 3.0));
        let m = t.to_rows();
        let transposed: [f64; 16] = std::array::from_fn(|i| m[(i % 4) * 4 + i / 4]);
        assert!(Rigid::<Base, Flange>::from_rows(&transposed).is_err());
    }
}
