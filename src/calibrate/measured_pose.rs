//! In: the features of one picture of a board and the camera that took it. Out: the board's pose as
//! a measurement: its information and how it moves with the camera's parameters.
//! Frame and unit: camera_from_board, mm; features in px (docs/math.md, Board pose (1) to (4)).

use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Mat3, Rigid, Vec2, Vec3, exp, log, skew};
use crate::solve::{LmOptions, Loss, Problem, Residuals, Stop, lm};
use nalgebra::{Matrix2x3, Matrix6, SMatrix, SVector, Vector6};

/// Names of the camera's parameters in the order used for sensitivities and covariances.
pub const INTRINSIC_NAMES: [&str; 9] = ["fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"];

/// Change of six pose numbers by the nine camera parameters.
pub type ByIntrinsics = SMatrix<f64, 6, 9>;

/// A small motion in the camera frame: translation (mm) then rotation vector (rad);
/// a point P goes to exp(w) P + v.
pub type Step = Vector6<f64>;

/// The features of one picture: the same index is the same feature.
#[derive(Clone, Debug)]
pub struct SeenBoard {
    /// The picture, as messages name it.
    pub name: String,
    /// Board frame, mm.
    pub points: Vec<Vec3>,
    /// px.
    pub pixels: Vec<Vec2>,
}

/// The pose of a board in one picture, with everything later solvers need from its pixels.
#[derive(Clone, Debug)]
pub struct MeasuredPose {
    pub name: String,
    pub camera_from_board: Rigid<Camera, Board>,
    /// Sum of JᵀJ over the features, per px²: a step s from the optimum raises the sum of squared
    /// pixel residuals by sᵀ·information·s.
    pub information: Matrix6<f64>,
    /// Step of the pose per unit of each camera parameter.
    pub by_intrinsics: ByIntrinsics,
    /// rms of the feature residuals per coordinate, px.
    pub rms_px: f64,
    /// Robust sigma of one coordinate, px.
    pub sigma_px: f64,
    /// Coordinates minus the six of the pose.
    pub freedom: f64,
    /// Corners of the features' bounding box on the board, and its centre: board frame, mm.
    pub landmarks: [Vec3; 5],
}

impl MeasuredPose {
    /// The distance (mm, rms over the landmarks) between this pose and another of the same board.
    pub fn displacement(&self, other: &Rigid<Camera, Board>) -> f64 {
        let sum: f64 =
            self.landmarks.iter().map(|p| (self.camera_from_board.point(p) - other.point(p)).norm_squared()).sum();
        (sum / self.landmarks.len() as f64).sqrt()
    }
    /// The distance in px between this pose and another of the same board, rms over the landmarks.
    pub fn displacement_px(&self, other: &Rigid<Camera, Board>, camera: &Intrinsics) -> f64 {
        let at = |t: &Rigid<Camera, Board>, p| camera.pixel_from_point(&t.point(p));
        let d: Vec<f64> = self
            .landmarks
            .iter()
            .filter_map(|p| Some((at(&self.camera_from_board, p)? - at(other, p)?).norm_squared()))
            .collect();
        if d.is_empty() { f64::INFINITY } else { (d.iter().sum::<f64>() / d.len() as f64).sqrt() }
    }
    /// Centre of the features, camera frame, mm.
    pub fn centre(&self) -> Vec3 {
        self.camera_from_board.point(&self.landmarks[4])
    }
    /// Covariance of a step for features with this sigma.
    pub fn covariance(&self, sigma_px: f64) -> Matrix6<f64> {
        self.information.try_inverse().unwrap_or_else(|| Matrix6::from_element(f64::INFINITY)) * sigma_px * sigma_px
    }
}

/// The step that leads from `from` to `to`.
pub fn step_between(from: &Rigid<Camera, Board>, to: &Rigid<Camera, Board>) -> Step {
    let rotation = to.rotation * from.rotation.transpose();
    let v = to.translation - rotation * from.translation;
    let w = log(&rotation);
    Step::new(v.x, v.y, v.z, w.x, w.y, w.z)
}

/// A pose after a step.
pub fn moved(pose: &Rigid<Camera, Board>, s: &[f64]) -> Rigid<Camera, Board> {
    let e = exp(&Vec3::new(s[3], s[4], s[5]));
    Rigid::new(e * pose.rotation, e * pose.translation + Vec3::new(s[0], s[1], s[2]))
}

/// d(pixel)/d(camera-frame point) in px per mm; `None` behind the camera.
pub fn pixel_by_point(camera: &Intrinsics, p: &Vec3) -> Option<Matrix2x3<f64>> {
    if p.z <= 0.0 {
        return None;
    }
    let n = Vec2::new(p.x / p.z, p.y / p.z);
    let k = nalgebra::Matrix2::new(camera.fx, camera.skew, 0.0, camera.fy);
    let perspective = Matrix2x3::new(1.0, 0.0, -n.x, 0.0, 1.0, -n.y) / p.z;
    Some(k * camera.distort_jacobian(&n) * perspective)
}

/// d(pixel)/d(fx fy cx cy k1 k2 p1 p2 k3) at a camera-frame point.
pub fn pixel_by_intrinsics(camera: &Intrinsics, p: &Vec3) -> SMatrix<f64, 2, 9> {
    let (x, y) = (p.x / p.z, p.y / p.z);
    let d = camera.distort(&Vec2::new(x, y));
    let r2 = x * x + y * y;
    let lens = [
        [x * r2, y * r2],
        [x * r2 * r2, y * r2 * r2],
        [2.0 * x * y, r2 + 2.0 * y * y],
        [r2 + 2.0 * x * x, 2.0 * x * y],
        [x * r2 * r2 * r2, y * r2 * r2 * r2],
    ];
    let mut j = SMatrix::<f64, 2, 9>::zeros();
    (j[(0, 0)], j[(1, 1)], j[(0, 2)], j[(1, 3)]) = (d.x, d.y, 1.0, 1.0);
    for (i, [a, b]) in lens.iter().enumerate() {
        j[(0, 4 + i)] = camera.fx * a + camera.skew * b;
        j[(1, 4 + i)] = camera.fy * b;
    }
    j
}

struct PoseProblem<'a> {
    seen: &'a SeenBoard,
    camera: &'a Intrinsics,
}

impl Problem for PoseProblem<'_> {
    type State = Rigid<Camera, Board>;
    fn width(&self) -> usize {
        6
    }
    fn moved(&self, state: &Self::State, step: &[f64]) -> Self::State {
        moved(state, step)
    }
    fn residuals(&self, state: &Self::State, out: &mut Residuals) -> Option<()> {
        for (point, pixel) in self.seen.points.iter().zip(&self.seen.pixels) {
            let p = state.point(point);
            let r = self.camera.pixel_from_point(&p)? - pixel;
            let j = pixel_by_point(self.camera, &p)? * point_by_step(&p);
            out.group(r.as_slice(), &[0, 1, 2, 3, 4, 5], j.transpose().as_slice());
        }
        Some(())
    }
}

/// d(point)/d(step).
pub fn point_by_step(p: &Vec3) -> SMatrix<f64, 3, 6> {
    let mut j = SMatrix::<f64, 3, 6>::zeros();
    j.fixed_view_mut::<3, 3>(0, 0).copy_from(&Mat3::identity());
    j.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(p));
    j
}

/// Refines a board's pose by its pixels and measures how well it is known.
pub fn measure(seen: &SeenBoard, camera: &Intrinsics, start: &Rigid<Camera, Board>) -> Result<MeasuredPose> {
    if seen.points.len() != seen.pixels.len() || seen.points.len() < 4 {
        return Err(Fault::input(format!(
            "{}: {} board points with {} pixels, at least 4 pairs are needed",
            seen.name,
            seen.points.len(),
            seen.pixels.len()
        ))
        .cause("the board is cut off or was hardly found")
        .next("take the picture again with the whole board in view"));
    }
    let problem = PoseProblem { seen, camera };
    let options = LmOptions { loss: Loss::Huber(2.5), estimate_scale: true, ..LmOptions::default() };
    let found = lm(&problem, *start, &options);
    if found.stop == Stop::BadStart || found.covariance.is_none() {
        return Err(Fault::refused(format!("{}: the board's pose is not determined by its pixels", seen.name))
            .cause("the features lie on a line, or the start was behind the camera")
            .next("leave this picture out"));
    }
    let pose = found.state;
    let mut information = Matrix6::zeros();
    let mut mixed = ByIntrinsics::zeros();
    for (point, weight) in seen.points.iter().zip(&found.weights) {
        let p = pose.point(point);
        let by_point = pixel_by_point(camera, &p).expect("in front of the camera at the solution");
        let j = by_point * point_by_step(&p);
        information += j.transpose() * j * *weight;
        mixed += j.transpose() * pixel_by_intrinsics(camera, &p) * *weight;
    }
    let inverse = information.try_inverse().ok_or_else(|| {
        Fault::refused(format!("{}: the board's pose is not determined by its pixels", seen.name))
            .cause("the features lie on a line")
            .next("leave this picture out")
    })?;
    Ok(MeasuredPose {
        name: seen.name.clone(),
        camera_from_board: pose,
        information,
        by_intrinsics: -(inverse * mixed),
        rms_px: found.rms,
        sigma_px: found.sigma0,
        freedom: found.freedom,
        landmarks: landmarks(&seen.points),
    })
}

fn landmarks(points: &[Vec3]) -> [Vec3; 5] {
    let (mut low, mut high) = (points[0], points[0]);
    for p in points {
        (low, high) = (low.inf(p), high.sup(p));
    }
    [
        Vec3::new(low.x, low.y, 0.0),
        Vec3::new(high.x, low.y, 0.0),
        Vec3::new(high.x, high.y, 0.0),
        Vec3::new(low.x, high.y, 0.0),
        (low + high) / 2.0,
    ]
}

/// One sigma for all pictures: their residuals pooled by degrees of freedom, px.
pub fn pooled_sigma_px(poses: &[MeasuredPose]) -> f64 {
    let (sum, freedom) =
        poses.iter().fold((0.0, 0.0), |(s, f), p| (s + p.sigma_px * p.sigma_px * p.freedom, f + p.freedom));
    if freedom > 0.0 { (sum / freedom).sqrt() } else { f64::NAN }
}

/// The camera's covariance as 9x9 in the order of [`INTRINSIC_NAMES`]; parameters the file does not
/// name count as known.
pub fn intrinsic_covariance(covariance: &crate::rig::Covariance) -> SMatrix<f64, 9, 9> {
    let at = INTRINSIC_NAMES.map(|n| covariance.parameters.iter().position(|p| p == n));
    SMatrix::from_fn(|i, j| match (at[i], at[j]) {
        (Some(a), Some(b)) => covariance.matrix[a][b],
        _ => 0.0,
    })
}

/// Adds a change of the camera's parameters.
pub fn changed(camera: &Intrinsics, d: &SVector<f64, 9>) -> Intrinsics {
    let k = camera.distortion;
    Intrinsics {
        fx: camera.fx + d[0],
        fy: camera.fy + d[1],
        cx: camera.cx + d[2],
        cy: camera.cy + d[3],
        distortion: std::array::from_fn(|i| k[i] + d[4 + i]),
        ..*camera
    }
}
