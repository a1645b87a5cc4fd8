//! In: a state, depths. Out: the pixels at which the laser plane is seen at these depths; the derivatives of a point
//! scanned there by all calibrated parameters; its expected error.
//! Frame and unit: points in the camera's carrier (flange or base), mm (docs/math.md, Joint calibration (8)).

use super::terms::ray;
use super::unknowns::{Layout, State};
use crate::calibrate::laser_plane::terms::tangents;
use crate::geometry::{Mat3, Vec2, Vec3, skew};
use nalgebra::DMatrix;

/// Rows and columns of the pixel grid in the picture.
const GRID: u32 = 24;

/// Pixels of a regular grid at which the laser plane lies between these depths.
pub fn places(s: &State, depths: [f64; 2]) -> Vec<Vec2> {
    let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(GRID) * f64::from(n) - 0.5;
    let all = (0..GRID * GRID).map(|i| Vec2::new(at(i % GRID, s.camera.width), at(i / GRID, s.camera.height)));
    let lit: Vec<Vec2> = all
        .filter(|px| {
            camera_point(s, px).is_some_and(|p| p.z >= depths[0] * (1.0 - 1e-9) && p.z <= depths[1] * (1.0 + 1e-9))
        })
        .collect();
    lit
}

/// Intersection of a pixel's ray with the laser plane, camera frame, mm.
fn camera_point(s: &State, pixel: &Vec2) -> Option<Vec3> {
    let n = s.camera.normalised_from_pixel(pixel)?;
    let ray = Vec3::new(n.x, n.y, 1.0);
    let depth = s.plane.offset / s.plane.normal.dot(&ray);
    (depth > 0.0 && depth.is_finite()).then(|| ray * depth)
}

/// The scanned point of a pixel, in the camera's carrier, mm.
pub fn scanned(s: &State, pixel: &Vec2) -> Option<Vec3> {
    Some(s.near_from_camera.point(&camera_point(s, pixel)?))
}

/// The derivatives of [`scanned`] by the shared unknowns: three rows.
pub fn by_unknowns(s: &State, l: &Layout, pixel: &Vec2) -> Option<DMatrix<f64>> {
    let (ray, ray_by_camera) = ray(&s.camera, pixel)?;
    let (normal, rotation) = (s.plane.normal, s.near_from_camera.rotation);
    let slope = normal.dot(&ray);
    let depth = s.plane.offset / slope;
    let p = ray * depth;
    let mut j = DMatrix::zeros(3, l.shared());
    // A change of the ray moves the point within the laser plane.
    let slide: Mat3 = (Mat3::identity() - ray * normal.transpose() / slope) * depth;
    for (k, &c) in l.camera.iter().enumerate() {
        let change = Vec3::new(ray_by_camera[(0, c)], ray_by_camera[(1, c)], 0.0);
        j.view_mut((0, k), (3, 1)).copy_from(&(rotation * slide * change));
    }
    j.view_mut((0, l.hand_eye()), (3, 3)).copy_from(&Mat3::identity());
    j.view_mut((0, l.hand_eye() + 3), (3, 3)).copy_from(&-skew(&(rotation * p)));
    let [a, b] = tangents(&normal);
    for (k, by) in [-a.dot(&p), -b.dot(&p), 1.0].into_iter().enumerate() {
        j.view_mut((0, l.plane() + k), (3, 1)).copy_from(&(rotation * ray * (by / slope)));
    }
    Some(j)
}

/// Mean of JᵀJ over all places. The trace of its product with a covariance is the mean squared error of a scanned
/// point, mm².
pub fn weights(s: &State, l: &Layout, places: &[Vec2]) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(l.shared(), l.shared());
    let mut n = 0.0;
    for j in places.iter().filter_map(|px| by_unknowns(s, l, px)) {
        out.gemm_tr(1.0, &j, &j, 1.0);
        n += 1.0;
    }
    if n > 0.0 { out / n } else { out }
}

/// Expected error of a scanned point, rms over the length of its error vector, mm, from weights and a covariance.
pub fn expected(weights: &DMatrix<f64>, covariance: &DMatrix<f64>) -> f64 {
    weights.component_mul(covariance).sum().max(0.0).sqrt()
}

/// rms distance between the points scanned with two calibrations at the same pixels, mm.
pub fn apart(a: &State, b: &State, places: &[Vec2]) -> f64 {
    let d: Vec<f64> = places.iter().filter_map(|px| Some((scanned(a, px)? - scanned(b, px)?).norm_squared())).collect();
    (d.iter().sum::<f64>() / d.len().max(1) as f64).sqrt()
}
