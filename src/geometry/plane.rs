//! In: points, normals, offsets. Out: planes `normal · X = offset` and rays, with their intersection.
//! Frame and unit: the type parameter; millimetres. The normal is of unit length.

use super::{Frame, Rigid, Vec3};
use std::marker::PhantomData;

/// The plane `normal · X = offset` (docs/math.md eq. 5 in the form of the laser plane).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(bound = "", deny_unknown_fields)]
pub struct Plane<F: Frame> {
    /// Unit normal, in frame `F`.
    pub normal: Vec3,
    /// Distance of the plane from the frame's origin along the normal, mm; negative on its other side.
    #[serde(rename = "offset_mm")]
    pub offset: f64,
    #[serde(skip)]
    frame: PhantomData<F>,
}

/// A half-line `origin + s · direction`, s ≥ 0; the direction is of unit length.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(bound = "", deny_unknown_fields)]
pub struct Ray<F: Frame> {
    /// Start of the ray, in frame `F`, mm.
    #[serde(rename = "origin_mm")]
    pub origin: Vec3,
    /// Unit direction, in frame `F`.
    pub direction: Vec3,
    #[serde(skip)]
    frame: PhantomData<F>,
}

impl<F: Frame> Plane<F> {
    /// Scales `normal` to unit length, and `offset` with it. `None` if the normal has no length.
    pub fn new(normal: Vec3, offset: f64) -> Option<Self> {
        let n = normal.norm();
        (n > 1e-300 && n.is_finite()).then(|| Plane { normal: normal / n, offset: offset / n, frame: PhantomData })
    }
    /// Signed distance, positive on the side that the normal points to.
    pub fn distance(&self, p: &Vec3) -> f64 {
        self.normal.dot(p) - self.offset
    }
    /// The same plane with the opposite normal.
    pub fn flipped(&self) -> Self {
        Plane { normal: -self.normal, offset: -self.offset, frame: PhantomData }
    }
}

impl<F: Frame> Ray<F> {
    /// Scales `direction` to unit length; `None` if it has no length.
    pub fn new(origin: Vec3, direction: Vec3) -> Option<Self> {
        let n = direction.norm();
        (n > 1e-300 && n.is_finite()).then(|| Ray { origin, direction: direction / n, frame: PhantomData })
    }
    /// The point at distance `s` from the origin, mm.
    pub fn at(&self, s: f64) -> Vec3 {
        self.origin + self.direction * s
    }
    /// Where the ray meets the plane; `None` where it runs along the plane or away from it.
    pub fn meet(&self, plane: &Plane<F>) -> Option<Vec3> {
        let slope = plane.normal.dot(&self.direction);
        let s = -plane.distance(&self.origin) / slope;
        (slope.abs() > 1e-9 && s >= 0.0).then(|| self.at(s))
    }
}

impl<To: Frame, From: Frame> Rigid<To, From> {
    /// A plane of frame `From` in frame `To`.
    pub fn plane(&self, p: &Plane<From>) -> Plane<To> {
        let normal = self.direction(&p.normal);
        Plane { normal, offset: p.offset + normal.dot(&self.translation), frame: PhantomData }
    }
    /// A ray of frame `From` in frame `To`.
    pub fn ray(&self, r: &Ray<From>) -> Ray<To> {
        Ray { origin: self.point(&r.origin), direction: self.direction(&r.direction), frame: PhantomData }
    }
}

/// Least-squares plane through points (total least squares), and the rms distance from it in mm.
/// `None` for fewer than three points or points on a line.
pub fn fit_plane<F: Frame>(points: &[Vec3]) -> Option<(Plane<F>, f64)> {
    if points.len() < 3 {
        return None;
    }
    let c = points.iter().sum::<Vec3>() / points.len() as f64;
    let m = points.iter().map(|p| (p - c) * (p - c).transpose()).sum::<super::Mat3>();
    let e = m.symmetric_eigen();
    let i = e.eigenvalues.imin();
    let middle = e.eigenvalues.sum() - e.eigenvalues.max() - e.eigenvalues[i];
    if middle <= 1e-12 * e.eigenvalues.max() {
        return None;
    }
    let n: Vec3 = e.eigenvectors.column(i).into();
    let plane = Plane::new(n, n.dot(&c))?;
    Some((plane, (e.eigenvalues[i].max(0.0) / points.len() as f64).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::super::{Base, Camera};
    use super::*;

    #[test]
    fn a_moved_plane_keeps_its_points() {
        let t: Rigid<Base, Camera> = Rigid::from_vectors(&Vec3::new(0.3, 0.1, -0.7), Vec3::new(5.0, -2.0, 9.0));
        let plane: Plane<Camera> = Plane::new(Vec3::new(0.0, 0.9, 0.4), 70.0).unwrap();
        let ray: Ray<Camera> = Ray::new(Vec3::zeros(), Vec3::new(0.1, 0.05, 1.0)).unwrap();
        let p = ray.meet(&plane).unwrap();
        assert!(plane.distance(&p).abs() < 1e-12);
        assert!(t.plane(&plane).distance(&t.point(&p)).abs() < 1e-12);
        assert!((t.ray(&ray).meet(&t.plane(&plane)).unwrap() - t.point(&p)).norm() < 1e-10);
    }

    #[test]
    fn points_on_a_line_have_no_plane() {
        let line: Vec<Vec3> = (0..9).map(|i| Vec3::new(i as f64, 2.0 * i as f64, 1.0)).collect();
        assert!(fit_plane::<Base>(&line).is_none());
    }
}
