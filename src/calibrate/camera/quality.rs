//! In: a solved camera and its pictures. Out: measures of its accuracy: expected errors, spread of tilts, coverage,
//! hold-out error, the next best picture.
//! Frame and unit: pixels, mm; degrees where the name states them.

use super::intrinsics::{Observation, SolveOptions, Solved, without};
use super::ray_error::{expected_ray_error, expected_ray_error_at, raster};
use crate::calibrate::boards::BoardView;
use crate::calibrate::boards::shape::Shape;
use crate::calibrate::projection::project;
use crate::camera::{Intrinsics, PARAMETERS, ParameterMatrix};
use crate::geometry::{Board, Camera, LeftStep, Rigid, Vec2, Vec3, exp};
use nalgebra::{DMatrix, Matrix2, Matrix6, SMatrix};

/// Largest angle between two boards' normals, degrees.
pub fn tilt_spread_deg(poses: &[Rigid<Camera, Board>]) -> f64 {
    let normals: Vec<Vec3> = poses.iter().map(|p| p.rotation.column(2).into()).collect();
    let mut widest: f64 = 0.0;
    for (i, a) in normals.iter().enumerate() {
        for b in &normals[..i] {
            widest = widest.max(a.cross(b).norm().atan2(a.dot(b)));
        }
    }
    widest.to_degrees()
}

/// Columns and rows of the raster by which it is stated where in the image boards were seen.
const CELLS: [usize; 2] = [8, 6];

/// The cells of a raster over the image in which a corner was seen, row by row.
pub struct Covered([bool; CELLS[0] * CELLS[1]]);

impl Covered {
    /// By the corners of these pictures.
    pub fn by(pictures: &[Observation], width: u32, height: u32) -> Covered {
        let mut seen = [false; CELLS[0] * CELLS[1]];
        for p in pictures.iter().flat_map(|o| &o.view.points) {
            let at =
                |v: f64, size: u32, n: usize| (((v + 0.5) / f64::from(size) * n as f64).max(0.0) as usize).min(n - 1);
            seen[at(p.pixel.y, height, CELLS[1]) * CELLS[0] + at(p.pixel.x, width, CELLS[0])] = true;
        }
        Covered(seen)
    }
    /// Share of the image, 0 to 1.
    pub fn share(&self) -> f64 {
        self.0.iter().filter(|s| **s).count() as f64 / self.0.len() as f64
    }
    /// Expected error of the viewing rays in these cells, px: of four rays a cell, after the best rotation.
    pub fn ray_error(&self, k: &Intrinsics, covariance: &ParameterMatrix) -> f64 {
        let [columns, rows] = CELLS;
        let cell = |i: usize| i / (2 * columns) / 2 * columns + i % (2 * columns) / 2;
        let at = raster(k, 2 * columns, 2 * rows).enumerate().filter(|(i, _)| self.0[cell(*i)]);
        expected_ray_error_at(k, covariance, at.map(|(_, px)| px))
    }
}

/// Leave-one-out rms per picture, px. The camera comes from all other pictures, with the lens terms and the board's
/// shape chosen from all; only the pose of the excluded picture is fitted. `None` if the others determine no camera.
/// More than 24 pictures are excluded in 24 groups.
pub fn hold_out(pictures: &[Observation], solved: &Solved, options: &SolveOptions) -> Vec<Option<f64>> {
    use rayon::prelude::*;
    let groups = pictures.len().min(24);
    let each: Vec<Vec<(usize, Option<f64>)>> = (0..groups)
        .into_par_iter()
        .map(|g| {
            let others = without(solved, pictures, |i| i % groups == g, options);
            (g..pictures.len())
                .step_by(groups)
                .map(|i| (i, others.as_ref().and_then(|(k, shape)| alone(k, shape.as_ref(), &pictures[i]))))
                .collect()
        })
        .collect();
    let mut rms = vec![None; pictures.len()];
    each.into_iter().flatten().for_each(|(i, r)| rms[i] = r);
    rms
}

/// sqrt(sum |r|² / n) of one picture with a fitted pose, px.
fn alone(camera: &Intrinsics, shape: Option<&Shape>, o: &Observation) -> Option<f64> {
    let places: Vec<Vec3> = o.features.iter().map(|x| shape.map_or(*x, |s| s.place(x))).collect();
    let pose = crate::calibrate::pose::pose_of_points(camera, &places, &o.view).ok()?;
    Some(pose.rms_px * std::f64::consts::SQRT_2)
}

/// A suggested picture, in words, and the expected ray error with it, px.
pub struct NextPicture {
    /// Position and tilt of the board, in words.
    pub words: String,
    /// Expected error of a viewing ray with this picture added, px.
    pub expected_px: f64,
}

/// Tries boards at nine positions in the image, four tilts and two distances. Returns the one that improves the
/// expected ray error most. `sigma_px`: estimated noise of the corners.
pub fn next_picture(solved: &Solved, features: &[Vec3], typical_distance: f64, sigma_px: f64) -> Option<NextPicture> {
    let covariance = solved.covariance.as_ref()?;
    let k = &solved.intrinsics;
    let free: Vec<usize> = (0..PARAMETERS).filter(|i| !solved.held.contains(i)).collect();
    let reduced = DMatrix::from_fn(free.len(), free.len(), |a, b| covariance[(free[a], free[b])]);
    let information = reduced.try_inverse()?;
    let centre = features.iter().sum::<Vec3>() / features.len() as f64;
    let mut best: Option<NextPicture> = None;
    for distance in [0.75, 1.0] {
        for (px, py, place) in PLACES {
            for (axis, sign, tilt) in TILTS {
                let z = typical_distance * distance;
                let middle = Vec3::new(
                    (px * f64::from(k.width) - k.cx) / k.fx * z,
                    (py * f64::from(k.height) - k.cy) / k.fy * z,
                    z,
                );
                let r = exp(&(axis * (25f64.to_radians() * sign)));
                let pose = Rigid::new(r, middle - r * centre);
                let Some(gain) = picture_information(k, features, &pose, sigma_px) else { continue };
                let with = &information + DMatrix::from_fn(free.len(), free.len(), |a, b| gain[(free[a], free[b])]);
                let Some(c) = with.try_inverse() else { continue };
                let mut whole = ParameterMatrix::zeros();
                for (a, &i) in free.iter().enumerate() {
                    for (b, &j) in free.iter().enumerate() {
                        whole[(i, j)] = c[(a, b)];
                    }
                }
                let expected_px = expected_ray_error(k, &whole);
                if best.as_ref().is_none_or(|b| expected_px < b.expected_px) {
                    let words = format!("tilt the board {tilt} by 25 degrees, {place}, about {z:.0} mm away");
                    best = Some(NextPicture { words, expected_px });
                }
            }
        }
    }
    best
}

const PLACES: [(f64, f64, &str); 9] = [
    (0.5, 0.5, "in the middle of the picture"),
    (0.3, 0.3, "nearer the upper left corner"),
    (0.5, 0.28, "nearer the upper edge"),
    (0.7, 0.3, "nearer the upper right corner"),
    (0.7, 0.5, "nearer the right edge"),
    (0.7, 0.7, "nearer the lower right corner"),
    (0.5, 0.72, "nearer the lower edge"),
    (0.3, 0.7, "nearer the lower left corner"),
    (0.3, 0.5, "nearer the left edge"),
];

const TILTS: [(Vec3, f64, &str); 4] = [
    (Vec3::new(1.0, 0.0, 0.0), 1.0, "about the horizontal axis, its lower edge away,"),
    (Vec3::new(1.0, 0.0, 0.0), -1.0, "about the horizontal axis, its upper edge away,"),
    (Vec3::new(0.0, 1.0, 0.0), 1.0, "about the vertical axis, its left edge away,"),
    (Vec3::new(0.0, 1.0, 0.0), -1.0, "about the vertical axis, its right edge away,"),
];

/// Information on the intrinsics from one more picture with an unknown pose (Schur complement). Only corners inside
/// the image count; `None` if there are fewer than 8.
fn picture_information(
    k: &Intrinsics,
    features: &[Vec3],
    pose: &Rigid<Camera, Board>,
    sigma_px: f64,
) -> Option<ParameterMatrix> {
    let mut kk = ParameterMatrix::zeros();
    let mut kp = SMatrix::<f64, PARAMETERS, 6>::zeros();
    let mut pp = Matrix6::<f64>::zeros();
    let mut inside = 0;
    for x in features {
        let rotated: Vec3 = pose.rotation * x;
        let p = project(k, &(rotated + pose.translation))?;
        let within = p.pixel.x > 0.0
            && p.pixel.y > 0.0
            && p.pixel.x < f64::from(k.width) - 1.0
            && p.pixel.y < f64::from(k.height) - 1.0;
        if !within {
            continue;
        }
        inside += 1;
        let (jk, jp) = (p.by_intrinsics / sigma_px, p.by_point * LeftStep::lever(&rotated) / sigma_px);
        kk += jk.transpose() * jk;
        kp += jk.transpose() * jp;
        pp += jp.transpose() * jp;
    }
    (inside >= 8).then(|| pp.try_inverse().map(|inv| kk - kp * inv * kp.transpose())).flatten()
}

/// Mean displacement of each feature on the board over all pictures and its standard error, mm. If the board differs
/// from its description (warped, badly printed), a feature is displaced the same way in every picture. Entries:
/// feature id, mean, error, pictures; features in fewer than 3 pictures are excluded.
pub fn feature_bias(pictures: &[Observation], solved: &Solved) -> Vec<(usize, Vec2, f64, usize)> {
    let count = pictures.iter().flat_map(|o| o.view.points.iter().map(|p| p.feature_id + 1)).max().unwrap_or(0);
    let mut sums = vec![(Vec2::zeros(), 0.0, 0usize); count];
    // The ids of another board mean other positions; only the board of the first picture is judged.
    let same = |o: &Observation| pictures.first().is_some_and(|first| o.features == first.features);
    let each = pictures.iter().zip(&solved.residuals).zip(&solved.camera_from_board);
    for ((o, residuals), pose) in each.filter(|((o, _), _)| same(o)) {
        for (p, (r, _)) in o.view.points.iter().zip(residuals) {
            let Some(q) = project(&solved.intrinsics, &pose.point(&o.features[p.feature_id])) else { continue };
            let by_board: Matrix2<f64> = q.by_point * pose.rotation.fixed_columns::<2>(0);
            let Some(inverse) = by_board.try_inverse() else { continue };
            let on_board = inverse * r;
            let s = &mut sums[p.feature_id];
            *s = (s.0 + on_board, s.1 + on_board.norm_squared(), s.2 + 1);
        }
    }
    let several = sums.into_iter().enumerate().filter(|(_, s)| s.2 >= 3);
    several
        .map(|(id, (sum, squares, n))| {
            let mean = sum / n as f64;
            (id, mean, ((squares / n as f64 - mean.norm_squared()).max(0.0) / n as f64).sqrt(), n)
        })
        .collect()
}

/// Median distance of the boards' middles from the camera, mm.
pub fn typical_distance(pictures: &[Observation], poses: &[Rigid<Camera, Board>]) -> f64 {
    let mut z: Vec<f64> = pictures.iter().zip(poses).map(|(o, p)| middle(&o.features, &o.view, p).z).collect();
    z.sort_by(f64::total_cmp);
    z.get(z.len() / 2).copied().unwrap_or(0.0)
}

fn middle(features: &[Vec3], view: &BoardView, pose: &Rigid<Camera, Board>) -> Vec3 {
    let sum: Vec3 = view.points.iter().map(|p| features[p.feature_id]).sum();
    pose.point(&(sum / view.points.len().max(1) as f64))
}

/// Tilt of a board relative to the image plane, degrees.
pub fn tilt_deg(pose: &Rigid<Camera, Board>) -> f64 {
    let n: Vec3 = pose.rotation.column(2).into();
    n.xy().norm().atan2(n.z.abs()).to_degrees()
}
