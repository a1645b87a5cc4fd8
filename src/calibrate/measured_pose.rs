//! In: the features of one picture of a board and the camera that took it. Out: the board's pose as
//! a measurement: its information and how it moves with the camera's parameters.
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

/// Change of six pose numbers by the camera's parameters, in the order of [`crate::camera::NAMES`].
pub type ByIntrinsics = SMatrix<f64, 6, PARAMETERS>;

/// What a picture's pixels say about the camera, its own pose left to them: a change d of the camera's parameters
/// changes the sum of squared residuals, in units of the features' stated sigmas, by 2 gᵀd + dᵀAd.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AboutCamera {
    /// A.
    pub information: ParameterMatrix,
    /// g.
    pub gradient: Parameters,
}

impl AboutCamera {
    /// Says nothing.
    pub fn silent() -> AboutCamera {
        AboutCamera { information: ParameterMatrix::zeros(), gradient: Parameters::zeros() }
    }
}

/// The features of a picture may fit their board this many times worse than those of the others.
pub const MISFIT: f64 = 3.0;

/// The features of one picture: the same index is the same feature.
#[derive(Clone, Debug)]
pub struct SeenBoard {
    /// The picture, as messages name it.
    pub name: String,
    /// Board frame, mm.
    pub points: Vec<Vec3>,
    /// px.
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

/// The pose of a board in one picture, with everything later solvers need from its pixels.
#[derive(Clone, Debug)]
pub struct MeasuredPose {
    /// Of the picture.
    pub name: String,
    /// The pose that fits the features best, mm.
    pub camera_from_board: Rigid<Camera, Board>,
    /// A step s from the optimum raises the sum of squared residuals, in units of the features'
    /// stated sigmas, by sᵀ·information·s.
    pub information: Matrix6<f64>,
    /// Step of the pose per unit of each camera parameter.
    pub by_intrinsics: ByIntrinsics,
    /// What the same pixels say about the camera.
    pub about_camera: AboutCamera,
    /// rms of the feature residuals per coordinate, px; NaN for a pose that was given without pixels.
    pub rms_px: f64,
    /// What the residuals say about the stated sigmas: the factor that makes them true.
    pub sigma_factor: f64,
    /// Coordinates minus the six of the pose.
    pub freedom: f64,
    /// Corners of the features' bounding box on the board, and its centre: board frame, mm.
    pub landmarks: [Vec3; 5],
}

impl MeasuredPose {
    /// A pose that another program measured, with its sigmas per axis at the board's origin (mm, rad) where they are
    /// stated; else what is left open is a turn about that origin, in rad, and `freedom` is 0. It says nothing of the
    /// camera. `side`: of the square about the origin at whose corners poses are compared, mm.
    pub fn given(
        name: String,
        camera_from_board: Rigid<Camera, Board>,
        sigma: Option<[f64; 2]>,
        side: f64,
    ) -> MeasuredPose {
        // The place's scatter cannot be told from the robot's: 1 mm per rad of the turn's keeps the sums finite.
        let [place, turn] = sigma.unwrap_or([1.0, 1.0]);
        // A turn about the board's origin o is the step v = o × w, w.
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
            // Stated sigmas are taken as they are: no residuals could correct them.
            sigma_factor: 1.0,
            freedom: if sigma.is_some() { 1.0 } else { 0.0 },
            landmarks: [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), Vec3::zeros()],
        }
    }
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
    /// Its own factor where it fits far worse than usual, of a blurred picture or of another camera, else the usual
    /// one.
    pub fn factor_among(&self, usual: f64) -> f64 {
        if self.sigma_factor > MISFIT * usual { self.sigma_factor } else { usual }
    }
    /// Covariance of a step, the features' sigmas being this factor times the stated ones.
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

/// Refines a board's pose by its pixels and measures how well it is known.
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
    // With Huber's weights the last digits of the cost move on; 1e-11 of it is far below a thousandth of a sigma.
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

/// Finds the pose of a board from the features that a detector found, and measures it.
pub fn measure_view(name: &str, camera: &Intrinsics, board: &BoardSpec, view: &BoardView) -> Result<MeasuredPose> {
    let start = board_pose(camera, board, view).map_err(|e| e.at(name))?;
    measure(&SeenBoard::from_view(name, board, view), camera, &start.camera_from_board)
}

/// One factor for all pictures: their residuals pooled by degrees of freedom; `None` where nothing tells it. A
/// picture that fits more than three times as badly as the middle one, blurred or of another camera, does not speak
/// for the others.
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

/// What a file says of the camera's errors; parameters that it does not name count as known.
///
/// # Errors
/// Numbers that are no covariance.
pub fn intrinsic_covariance(covariance: &crate::rig::Covariance) -> Result<CameraCovariance> {
    CameraCovariance::new(covariance.of(NAMES))
}
