//! In: the fit of a laser plane. Out: whether each picture's stripe lies where the others predict it, the pictures'
//! scatter beyond their own sigmas, and the plane's error in the view.
//! Frame and unit: camera frame, mm (docs/math.md, Laser plane (7) to (10)).

use super::terms::{ByCamera, Data, Says, State, on_board, says, stepped, tangents};
use crate::calibrate::scatter;
use crate::camera::{CameraCovariance, Intrinsics, PARAMETERS};
use crate::geometry::{Camera, Plane, Vec3};
use crate::rig::Volume;
use nalgebra::{DMatrix, Matrix3, SMatrix};

/// One picture compared with the plane of the others.
pub(in crate::calibrate) struct HeldOut {
    /// The plane without this picture.
    pub(in crate::calibrate) plane: Option<Plane<Camera>>,
    /// Squared distance of its stripe from the position that the others predict, in sigmas of both; chi-square with 2
    /// degrees of freedom if the sigmas are right. Infinite if the others determine no plane, 0 for a picture without
    /// peaks.
    pub(in crate::calibrate) surprise: f64,
}

/// Check of the pictures against each other.
pub(in crate::calibrate) struct Consistency {
    pub(in crate::calibrate) views: Vec<HeldOut>,
    /// Squared distance of the pictures' stripes from the plane relative to their sigmas; 1 if these are right.
    pub(in crate::calibrate) scatter2: f64,
    pub(in crate::calibrate) freedom: f64,
}

/// Expected contribution of the camera's own error to the sum of the pictures' squared distances over their sigmas.
/// That error moves boards and rays of each picture differently, and its uncertainty is stated separately.
pub(in crate::calibrate) fn from_camera(
    data: &Data,
    state: &State,
    factor: f64,
    by: &ByCamera,
    camera_covariance: &CameraCovariance,
) -> f64 {
    let one = |(v, gradient): (usize, &Option<SMatrix<f64, 2, PARAMETERS>>)| {
        let s = says(data, state, v, factor)?;
        let off = s.information.try_inverse()? * (*gradient)? + s.by_plane * by.plane;
        Some((camera_covariance.matrix() * off.transpose() * s.information * off).trace())
    };
    by.gradients.iter().enumerate().filter_map(one).sum()
}

/// By one Gauss-Newton step per picture, from the solution with all pictures.
pub(in crate::calibrate) fn consistency(data: &Data, state: &State, factor: f64) -> Consistency {
    let said: Vec<Option<Says>> = (0..data.measured.len()).map(|v| says(data, state, v, factor)).collect();
    let (mut all, mut gradient) = (Matrix3::zeros(), Vec3::zeros());
    for (h, g) in said.iter().flatten().map(Says::of_plane) {
        all += h;
        gradient += g;
    }
    let views = said.iter().map(|s| held_out(s.as_ref(), &all, &gradient, &state.plane)).collect();
    let own = |s: &Says| Some(s.gradient.dot(&(s.information.try_inverse()? * s.gradient)));
    let (sum, count) = said.iter().flatten().filter_map(own).fold((0.0, 0.0), |(s, n), q| (s + q, n + 1.0));
    let freedom = 2.0 * count - 3.0;
    Consistency { views, scatter2: if freedom > 0.0 { sum / freedom } else { 1.0 }, freedom }
}

fn held_out(says: Option<&Says>, all: &Matrix3<f64>, gradient: &Vec3, plane: &Plane<Camera>) -> HeldOut {
    let Some(s) = says else { return HeldOut { plane: Some(*plane), surprise: 0.0 } };
    let found = || {
        let (h, g) = s.of_plane();
        let others = (all - h).try_inverse()?;
        let step = -(others * (gradient - g));
        let own = s.information.try_inverse()?;
        let off = -(own * s.gradient) - s.by_plane * step;
        let covariance = own + s.by_plane * others * s.by_plane.transpose();
        let surprise = off.dot(&(covariance.cholesky()?.solve(&off)));
        Some(HeldOut { plane: stepped(plane, &step), surprise })
    };
    found().unwrap_or(HeldOut { plane: None, surprise: f64::INFINITY })
}

impl Consistency {
    /// Surprises relative to their usual size among the used pictures.
    pub(in crate::calibrate) fn beside(&self, used: &[bool]) -> Vec<f64> {
        let all: Vec<f64> = self.views.iter().map(|v| v.surprise).collect();
        scatter::beside(&all, |i| used[i])
    }
}

pub(in crate::calibrate) fn board_spread(state: &State, used: &[bool]) -> f64 {
    let normals: Vec<Vec3> =
        state.poses.iter().zip(used).filter(|(_, u)| **u).map(|(p, _)| p.rotation.column(2).into()).collect();
    let angle = |a: &Vec3, b: &Vec3| a.cross(b).norm().atan2(a.dot(b));
    normals
        .iter()
        .enumerate()
        .flat_map(|(i, a)| normals[..i].iter().map(move |b| (a, b)))
        .fold(0.0, |m, (a, b)| f64::max(m, angle(a, b)))
}

pub(in crate::calibrate) fn reach(data: &Data, s: &State) -> [f64; 2] {
    let depths = data.peaks.iter().filter_map(|p| Some(on_board(&s.poses[p.view], &p.ray)?.z));
    depths.fold([f64::INFINITY, 0.0], |[low, high], z| [low.min(z), high.max(z)])
}

/// rms spread of the points in their second principal direction, mm.
pub(in crate::calibrate) fn depth_spread(data: &Data, s: &State) -> f64 {
    let points: Vec<Vec3> = data.peaks.iter().filter_map(|p| on_board(&s.poses[p.view], &p.ray)).collect();
    let n = f64::max(points.len() as f64, 1.0);
    let c = points.iter().sum::<Vec3>() / n;
    let m = points.iter().map(|p| (p - c) * (p - c).transpose()).sum::<Matrix3<f64>>() / n;
    let mut e: Vec<f64> = m.symmetric_eigenvalues().iter().copied().collect();
    e.sort_by(f64::total_cmp);
    e[1].max(0.0).sqrt()
}

/// Points of the plane that the camera sees at the working depths.
pub(in crate::calibrate) fn places_in_view(plane: &Plane<Camera>, camera: &Intrinsics, work: &Volume) -> Vec<Vec3> {
    let [a, b] = tangents(&plane.normal);
    // Two directions in the plane: `across` has no z component, `along` is perpendicular to it.
    let Some(across) = (a * b.z - b * a.z).try_normalize(1e-12) else { return Vec::new() };
    let along = plane.normal.cross(&across);
    let foot = plane.normal * plane.offset;
    let mut out = Vec::new();
    for i in 0..=10 {
        let z = work.near_mm + work.length() * f64::from(i) / 10.0;
        let middle = foot + along * ((z - foot.z) / along.z);
        for k in -20..=20 {
            let p = middle + across * (camera.view_mm(z) * f64::from(k) / 20.0 - across.dot(&middle));
            let seen = camera.pixel_from_point(&p).is_some_and(|q| {
                (-0.5..f64::from(camera.width) - 0.5).contains(&q.x)
                    && (-0.5..f64::from(camera.height) - 0.5).contains(&q.y)
            });
            if seen && p.z > 0.0 {
                out.push(p);
            }
        }
    }
    out
}

/// Sigma of the distance between the fitted and the true plane, rms over the given points, mm; infinite without
/// points.
pub(in crate::calibrate) fn expected_error(covariance: &DMatrix<f64>, places: &[Vec3]) -> f64 {
    let variance = |p: &Vec3| {
        let u = nalgebra::DVector::from_vec(vec![p.x, p.y, p.z, -1.0]);
        (covariance * &u).dot(&u).max(0.0)
    };
    let sum: f64 = places.iter().map(variance).sum();
    if places.is_empty() { f64::INFINITY } else { (sum / places.len() as f64).sqrt() }
}
