//! In: the features of one picture of a board and the camera that took it. Out: the board's pose as a measurement,
//! with its information matrix and its derivatives by the camera's parameters.
//! Frame and unit: camera_from_board, mm; features in px (docs/math.md, Board pose (1) to (5)).

use super::boards::BoardView;
use super::pose::board_pose;
use super::projection::project;
use crate::camera::{CameraCovariance, Intrinsics, NAMES, PARAMETERS, ParameterMatrix, Parameters};
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Mat3, Rigid, Twist, Vec2, Vec3, skew};
use crate::recording::BoardSpec;
use crate::solve::{LmOptions, Loss, Problem, Residuals, lm};
use nalgebra::{Matrix6, SMatrix};

/// Derivatives of the six pose parameters by the camera's parameters, in the order of [`crate::camera::NAMES`].
pub type ByIntrinsics = SMatrix<f64, 6, PARAMETERS>;

/// What the pixels of one picture state about the camera, its own pose eliminated. A change d of the camera's
/// parameters changes the sum of squared residuals, in units of the features' stated sigmas, by 2 gᵀd + dᵀAd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AboutCamera {
    /// The matrix A.
    pub information: ParameterMatrix,
    /// The vector g.
    pub gradient: Parameters,
}

impl AboutCamera {
    /// No information about the camera.
    pub fn silent() -> AboutCamera {
        AboutCamera { information: ParameterMatrix::zeros(), gradient: Parameters::zeros() }
    }
}

/// A picture whose features fit the board more than this many times worse than usual is judged by its own factor.
pub const MISFIT: f64 = 3.0;

/// The features of one picture. Entries with the same index belong to the same feature.
#[derive(Clone, Debug)]
pub struct SeenBoard {
    /// Name of the picture, as in messages.
    pub name: String,
    /// Positions on the board, board frame, mm.
    pub points: Vec<Vec3>,
    /// Positions in the picture, px.
    pub pixels: Vec<Vec2>,
    /// Standard deviation of each pixel coordinate up to one common factor, px.
    pub sigmas_px: Vec<f64>,
}

impl SeenBoard {
    /// The features that a detector found.
    pub fn from_view(name: &str, board: &BoardSpec, view: &BoardView) -> SeenBoard {
        let features = board.features();
        SeenBoard {
            name: name.to_owned(),
            points: view.points.iter().map(|p| features[p.feature_id]).collect(),
            pixels: view.points.iter().map(|p| p.pixel).collect(),
            sigmas_px: view.points.iter().map(|p| p.sigma_px.max(1e-3)).collect(),
        }
    }
}

/// The pose of a board in one picture, with everything that later solvers need from its pixels.
#[derive(Clone, Debug)]
pub struct MeasuredPose {
    /// Name of the picture.
    pub name: String,
    /// The pose that fits the features best, mm.
    pub camera_from_board: Rigid<Camera, Board>,
    /// Information matrix: a step s from the optimum raises the sum of squared residuals, in units of the features'
    /// stated sigmas, by sᵀ·information·s.
    pub information: Matrix6<f64>,
    /// Step of the pose per unit of each camera parameter.
    pub by_intrinsics: ByIntrinsics,
    /// Information about the camera from the same pixels.
    pub about_camera: AboutCamera,
    /// rms of the feature residuals per coordinate, px; NaN for a pose that was given without pixels.
    pub rms_px: f64,
    /// Factor by which the stated sigmas have to be multiplied, estimated from the residuals.
    pub sigma_factor: f64,
    /// Degrees of freedom: number of pixel coordinates minus the six of the pose.
    pub freedom: f64,
    /// Corners of the features' bounding box on the board and, last, its centre; board frame, mm.
    pub landmarks: [Vec3; 5],
}

impl MeasuredPose {
    /// A pose that another program measured. `sigma`: its sigmas per axis at the board's origin (mm, rad), if
    /// stated. Without them the information is in units of a rotation of 1 rad about that origin, and `freedom` is
    /// 0. The pose carries no information about the camera. `side`: side of the square about the origin at whose
    /// corners poses are compared, mm.
    pub fn given(
        name: String,
        camera_from_board: Rigid<Camera, Board>,
        sigma: Option<[f64; 2]>,
        side: f64,
    ) -> MeasuredPose {
        // The scatter of the position cannot be separated from the robot's. 1 mm per rad of rotation keeps the sums
        // finite.
        let [place, turn] = sigma.unwrap_or([1.0, 1.0]);
        // A rotation about the board's origin o is the step v = o × w, w.
        let lever = skew(&camera_from_board.translation);
        let mut covariance = Matrix6::<f64>::zeros();
        let own = Mat3::identity() * (place * place) + lever * lever.transpose() * (turn * turn);
        covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&own);
        covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&(lever * (turn * turn)));
        covariance.fixed_view_mut::<3, 3>(3, 0).copy_from(&(lever.transpose() * (turn * turn)));
        covariance.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Mat3::identity() * (turn * turn)));
        let half = side / 2.0;
        let corner = |x: f64, y: f64| Vec3::new(x * half, y * half, 0.0);
        MeasuredPose {
            name,
            camera_from_board,
            information: covariance.try_inverse().unwrap_or_else(Matrix6::zeros),
            by_intrinsics: ByIntrinsics::zeros(),
            about_camera: AboutCamera::silent(),
            rms_px: f64::NAN,
            // Stated sigmas are used unchanged: no residuals could correct them.
            sigma_factor: 1.0,
            freedom: if sigma.is_some() { 1.0 } else { 0.0 },
            landmarks: [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), Vec3::zeros()],
        }
    }
    /// Distance between this pose and another pose of the same board, rms over the landmarks, mm.
    pub fn displacement(&self, other: &Rigid<Camera, Board>) -> f64 {
        let sum: f64 =
            self.landmarks.iter().map(|p| (self.camera_from_board.point(p) - other.point(p)).norm_squared()).sum();
        (sum / self.landmarks.len() as f64).sqrt()
    }
    /// Distance between this pose and another pose of the same board, rms over the landmarks, px.
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
    /// The picture's own factor if it exceeds [`MISFIT`] times the usual one (a blurred picture, or one of another
    /// camera); otherwise the usual factor.
    pub fn factor_among(&self, usual: f64) -> f64 {
        if self.sigma_factor > MISFIT * usual { self.sigma_factor } else { usual }
    }
    /// Covariance of a step if the features' true sigmas are this factor times the stated ones.
    pub fn covariance(&self, sigma_factor: f64) -> Matrix6<f64> {
        let inverse = self.information.try_inverse().unwrap_or_else(|| Matrix6::from_element(f64::INFINITY));
        inverse * (sigma_factor * sigma_factor)
    }
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
        Twist::new(step).moved(state)
    }
    fn residuals(&self, state: &Self::State, out: &mut Residuals) -> Option<()> {
        for ((point, pixel), sigma) in self.seen.points.iter().zip(&self.seen.pixels).zip(&self.seen.sigmas_px) {
            let p = state.point(point);
            let at = project(self.camera, &p)?;
            let r = (at.pixel - pixel) / *sigma;
            let j = at.by_point * Twist::lever(&p) / *sigma;
            out.group(r.as_slice(), &[0, 1, 2, 3, 4, 5], j.transpose().as_slice());
        }
        Some(())
    }
}

/// Refines a board's pose by its pixels and computes its information matrix.
pub fn measure(seen: &SeenBoard, camera: &Intrinsics, start: &Rigid<Camera, Board>) -> Result<MeasuredPose> {
    let same = seen.points.len() == seen.pixels.len() && seen.points.len() == seen.sigmas_px.len();
    if !same || seen.points.len() < 4 {
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
    // With Huber weights the last digits of the cost keep changing; 1e-11 of the cost is far below a thousandth of
    // a sigma.
    let options = LmOptions { loss: Loss::Huber(2.5), estimate_scale: true, tolerance: 1e-11, ..LmOptions::default() };
    let found = lm(&problem, *start, &options).minimum().filter(|f| f.covariance.is_some()).ok_or_else(|| {
        Fault::refused(format!("{}: the board's pose is not determined by its pixels", seen.name))
            .cause(
                "the features lie on a line, the start was behind the camera, or the fit of the pose does not \
                    converge",
            )
            .next("leave this picture out")
    })?;
    let pose = found.state;
    let (mut information, mut mixed, mut squares) = (Matrix6::zeros(), ByIntrinsics::zeros(), 0.0);
    let mut about_camera = AboutCamera::silent();
    for (i, weight) in found.weights.iter().enumerate() {
        let p = pose.point(&seen.points[i]);
        let at = project(camera, &p).expect("in front of the camera at the solution");
        let j = at.by_point * Twist::lever(&p);
        let by_camera = at.by_intrinsics;
        let w = weight / (seen.sigmas_px[i] * seen.sigmas_px[i]);
        let r = at.pixel - seen.pixels[i];
        information += j.transpose() * j * w;
        mixed += j.transpose() * by_camera * w;
        about_camera.information += by_camera.transpose() * by_camera * w;
        about_camera.gradient += by_camera.transpose() * r * w;
        squares += r.norm_squared();
    }
    let inverse = information.try_inverse().ok_or_else(|| {
        Fault::refused(format!("{}: the board's pose is not determined by its pixels", seen.name))
            .cause("the features lie on a line")
            .next("leave this picture out")
    })?;
    about_camera.information -= mixed.transpose() * inverse * mixed;
    Ok(MeasuredPose {
        name: seen.name.clone(),
        camera_from_board: pose,
        information,
        by_intrinsics: -(inverse * mixed),
        about_camera,
        rms_px: (squares / (2.0 * seen.points.len() as f64)).sqrt(),
        sigma_factor: found.sigma0,
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

/// Finds the pose of a board from the features that a detector found, and computes its information matrix.
pub fn measure_view(name: &str, camera: &Intrinsics, board: &BoardSpec, view: &BoardView) -> Result<MeasuredPose> {
    let start = board_pose(camera, board, view).map_err(|e| e.at(name))?;
    measure(&SeenBoard::from_view(name, board, view), camera, &start.camera_from_board)
}

/// One sigma factor for all pictures: their residuals pooled by degrees of freedom. `None` if no pose has degrees
/// of freedom. A picture whose factor exceeds three times the median (blurred, or of another camera) is excluded.
pub fn pooled_factor<'a>(poses: impl Iterator<Item = &'a MeasuredPose>) -> Option<f64> {
    let poses: Vec<&MeasuredPose> = poses.filter(|p| p.freedom > 0.0).collect();
    let mut factors: Vec<f64> = poses.iter().map(|p| p.sigma_factor).collect();
    factors.sort_by(f64::total_cmp);
    let limit = MISFIT * factors.get((factors.len().max(1) - 1) / 2).copied()?;
    let (sum, freedom) = poses
        .iter()
        .filter(|p| p.sigma_factor <= limit)
        .fold((0.0, 0.0), |(s, f), p| (s + p.sigma_factor * p.sigma_factor * p.freedom, f + p.freedom));
    (freedom > 0.0).then(|| f64::sqrt(sum / freedom))
}

/// The covariance that a file states for the camera's parameters. Parameters that the file does not name count as
/// exact.
///
/// # Errors
/// Numbers that form no covariance matrix.
pub fn intrinsic_covariance(covariance: &crate::rig::Covariance) -> Result<CameraCovariance> {
    CameraCovariance::new(covariance.of(NAMES))
}
