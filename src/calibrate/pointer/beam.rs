//! In: points in space, steps. Out: a beam as a line: a robust fit through points, the beam after a step, its
//! parameters.
//! Frame and unit: camera frame, mm; directions have length one.

use crate::geometry::{Camera, Ray, Vec3};
use nalgebra::DMatrix;

/// Names of the beam's own six parameters; the camera's follow in the file.
pub const BEAM_NAMES: [&str; 6] = ["ox_mm", "oy_mm", "oz_mm", "dx", "dy", "dz"];

/// Two unit vectors perpendicular to the beam and to each other.
pub(in crate::calibrate) fn across(direction: &Vec3) -> [Vec3; 2] {
    let axis = if direction.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
    let a = direction.cross(&axis).normalize();
    [a, direction.cross(&a)]
}

/// A beam after a step: two components for the origin, two for the direction, all perpendicular to the beam.
pub fn moved_beam(beam: &Ray<Camera>, s: &[f64]) -> Ray<Camera> {
    let [a, b] = across(&beam.direction);
    Ray::new(beam.origin + a * s[0] + b * s[1], beam.direction + a * s[2] + b * s[3])
        .expect("a direction of length one")
}

/// d(ox oy oz dx dy dz)/d(step of the beam).
pub(in crate::calibrate) fn basis(beam: &Ray<Camera>) -> DMatrix<f64> {
    let [a, b] = across(&beam.direction);
    let mut j = DMatrix::zeros(6, 4);
    for i in 0..3 {
        (j[(i, 0)], j[(i, 1)], j[(3 + i, 2)], j[(3 + i, 3)]) = (a[i], b[i], a[i], b[i]);
    }
    j
}

/// A straight line through points, by total least squares.
fn line(points: &[Vec3]) -> Option<Ray<Camera>> {
    let c = points.iter().sum::<Vec3>() / points.len() as f64;
    let m = points.iter().map(|p| (p - c) * (p - c).transpose()).sum::<nalgebra::Matrix3<f64>>();
    let e = m.symmetric_eigen();
    let d: Vec3 = e.eigenvectors.column(e.eigenvalues.imax()).into();
    Ray::new(c, if d.z < 0.0 { -d } else { d })
}

/// The line through two of the points with the smallest median distance, refined on the points near it.
pub(in crate::calibrate) fn robust_line(points: &[Vec3], gates: &[f64]) -> Option<Ray<Camera>> {
    let mut best: Option<(f64, Ray<Camera>)> = None;
    for (i, a) in points.iter().enumerate() {
        for b in &points[..i] {
            let Some(ray) = Ray::<Camera>::new(*a, b - a).filter(|_| (b - a).norm() > 2.0 * gates[i]) else { continue };
            let mut d: Vec<f64> = points.iter().map(|p| off(&ray, p)).collect();
            let middle = (points.len() / 2 + 1).min(points.len() - 1);
            let (_, &mut median, _) = d.select_nth_unstable_by(middle, f64::total_cmp);
            if best.as_ref().is_none_or(|b| median < b.0) {
                best = Some((median, ray));
            }
        }
    }
    let ray = best?.1;
    line(&near_line(points, gates, &ray).iter().map(|&i| points[i]).collect::<Vec<_>>())
}

fn off(ray: &Ray<Camera>, p: &Vec3) -> f64 {
    (p - ray.origin).cross(&ray.direction).norm()
}

/// Points near a line: within six times the median distance, or within their gate.
pub(super) fn near_line(points: &[Vec3], gates: &[f64], ray: &Ray<Camera>) -> Vec<usize> {
    let d: Vec<f64> = points.iter().map(|p| off(ray, p)).collect();
    let mut sorted = d.clone();
    sorted.sort_by(f64::total_cmp);
    let limit = 6.0 * sorted[points.len() / 2];
    (0..points.len()).filter(|&i| d[i] <= limit.max(gates[i])).collect()
}
