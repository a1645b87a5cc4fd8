//! In: intrinsics, a board and its features in one picture. Out: the board's pose with covariance.
//! Frame and unit: camera_from_board; mm, rad, px (docs/math.md, Camera calibration (7)).

use super::boards::BoardView;
use super::homography::homography;
use super::projection::project;
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, LeftStep, Mat3, Rigid, Vec2, Vec3, orthonormalise};
use crate::recording::BoardSpec;
use crate::solve::{LmOptions, Loss, Problem, Residuals, Solution, lm};
use nalgebra::Matrix6;

/// A board's pose from one picture.
#[derive(Clone, Debug)]
pub struct BoardPose {
    /// The pose that fits the features best, mm.
    pub camera_from_board: Rigid<Camera, Board>,
    /// Covariance of a [`LeftStep`], mm and rad. The features' common sigma is estimated from the residuals where
    /// these are larger than the features' stated sigmas.
    pub covariance: Matrix6<f64>,
    /// Reprojection error, px.
    pub rms_px: f64,
    /// Cost of the mirrored pose over the cost of this one. Near 1 the sign of the tilt is a guess.
    pub ambiguity: f64,
    /// Robust weight of each point of the view.
    pub weights: Vec<f64>,
}

/// The residuals of one board: pixels over their sigmas.
struct OneBoard<'a> {
    intrinsics: &'a Intrinsics,
    points: Vec<(Vec3, Vec2, f64)>,
}

impl Problem for OneBoard<'_> {
    type State = Rigid<Camera, Board>;
    fn width(&self) -> usize {
        6
    }
    fn moved(&self, pose: &Self::State, step: &[f64]) -> Self::State {
        LeftStep::new(step).moved(pose)
    }
    fn residuals(&self, pose: &Self::State, out: &mut Residuals) -> Option<()> {
        for (x, pixel, sigma) in &self.points {
            let rotated = pose.rotation * x;
            let p = project(self.intrinsics, &(rotated + pose.translation))?;
            let r = (p.pixel - pixel) / *sigma;
            let j = p.by_point * LeftStep::lever(&rotated) / *sigma;
            let rows: [f64; 12] = std::array::from_fn(|k| j[(k / 6, k % 6)]);
            out.group(&[r.x, r.y], &[0, 1, 2, 3, 4, 5], &rows);
        }
        Some(())
    }
}

/// Pose of a planar board: starts from the homography, refines both minima of the planar ambiguity and returns the
/// better one. Robust against some wrong points.
///
/// # Errors
/// Fewer than 4 points, points on one line, or points that fit no pose in front of the camera.
pub fn board_pose(intrinsics: &Intrinsics, board: &BoardSpec, view: &BoardView) -> Result<BoardPose> {
    pose_of_points(intrinsics, &board.features(), view)
}

/// [`board_pose`] with the features' positions (mm, board frame, z = 0) given directly.
pub fn pose_of_points(intrinsics: &Intrinsics, features: &[Vec3], view: &BoardView) -> Result<BoardPose> {
    let weak = |what: String| {
        Fault::refused(what).cause("too little of the board was seen").next("show more of the board in this picture")
    };
    if view.points.len() < 4 {
        return Err(weak(format!("{} points of the board were seen, 4 are needed for its pose", view.points.len())));
    }
    let points: Vec<(Vec3, Vec2, f64)> =
        view.points.iter().map(|p| (features[p.feature_id], p.pixel, p.sigma_px.max(1e-3))).collect();
    let plane: Vec<Vec2> = points.iter().map(|p| p.0.xy()).collect();
    let ideal: Option<Vec<Vec2>> = points.iter().map(|p| intrinsics.normalised_from_pixel(&p.1)).collect();
    let ideal = ideal.ok_or_else(|| {
        Fault::input("a corner lies where the lens model cannot be inverted")
            .cause("the intrinsics belong to another camera or resolution")
            .next("calibrate the camera again")
    })?;
    let h = homography(&plane, &ideal).ok_or_else(|| weak("the points seen lie on a line".into()))?;
    let start = pose_from_homography(&h);
    let centre = plane.iter().sum::<Vec2>() / plane.len() as f64;
    let problem = OneBoard { intrinsics, points };
    let options =
        LmOptions { loss: Loss::Huber(2.0), estimate_scale: true, max_iterations: 50, ..LmOptions::default() };
    let mut found: Vec<Solution<Rigid<Camera, Board>>> = [start, mirrored(&start, &Vec3::new(centre.x, centre.y, 0.0))]
        .into_iter()
        // `so_far` also accepts a fit that did not converge: reports refine this pose further and check the end
        // there.
        .filter_map(|s| lm(&problem, s, &options).so_far())
        .filter(|s| s.state.translation.z > 0.0)
        .collect();
    found.sort_by(|a, b| a.rms.total_cmp(&b.rms));
    let best = found.first().ok_or_else(|| weak("no pose in front of the camera fits the points".into()))?;
    let covariance = best.covariance.as_ref().ok_or_else(|| weak("the points do not determine a pose".into()))?;
    // Both starts may end in the same minimum; then there is no ambiguity.
    let other = found.get(1).filter(|o| o.state.difference(&best.state).0 > 1e-3);
    let scale = best.sigma0.max(1.0).powi(2);
    Ok(BoardPose {
        camera_from_board: best.state,
        covariance: Matrix6::from_fn(|i, j| covariance[(i, j)] * scale),
        rms_px: rms_px(&problem, &best.state),
        ambiguity: other.map_or(f64::INFINITY, |o| (o.rms / best.rms).powi(2)),
        weights: best.weights.clone(),
    })
}

fn rms_px(problem: &OneBoard<'_>, pose: &Rigid<Camera, Board>) -> f64 {
    let sum: f64 = problem
        .points
        .iter()
        .filter_map(|(x, pixel, _)| Some((problem.intrinsics.pixel_from_point(&pose.point(x))? - pixel).norm_squared()))
        .sum();
    (sum / (2.0 * problem.points.len() as f64)).sqrt()
}

/// \[zhang00\] eq. 2 with K = 1: columns of H are λ r1, λ r2, λ t.
pub fn pose_from_homography(h: &Mat3) -> Rigid<Camera, Board> {
    let (h1, h2, h3): (Vec3, Vec3, Vec3) = (h.column(0).into(), h.column(1).into(), h.column(2).into());
    // In front of the camera: t_z > 0.
    let scale = 2.0 / (h1.norm() + h2.norm()) * h3.z.signum();
    let (r1, r2) = (h1 * scale, h2 * scale);
    let r = Mat3::from_columns(&[r1, r2, r1.cross(&r2)]);
    Rigid::new(orthonormalise(&r), h3 * scale)
}

/// The other minimum of a plane's pose: its tilt is mirrored about the line of sight to `centre`, a point of the
/// board \[schweighofer06\].
fn mirrored(pose: &Rigid<Camera, Board>, centre: &Vec3) -> Rigid<Camera, Board> {
    let c = pose.point(centre);
    let sight = c.normalize();
    let reflect = Mat3::identity() - sight * sight.transpose() * 2.0;
    let (r1, r2): (Vec3, Vec3) = (reflect * pose.rotation.column(0), reflect * pose.rotation.column(1));
    let r = Mat3::from_columns(&[r1, r2, r1.cross(&r2)]);
    Rigid::new(r, c - r * centre)
}

#[cfg(test)]
mod tests {
    use super::super::boards::BoardPoint;
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, Normal};

    fn camera() -> Intrinsics {
        Intrinsics {
            fx: 611.0,
            fy: 612.0,
            cx: 315.0,
            cy: 232.0,
            skew: 0.0,
            distortion: [-0.12, 0.09, 0.0006, -0.0004, -0.02].into(),
            width: 640,
            height: 480,
        }
    }
    fn board() -> BoardSpec {
        BoardSpec::Chessboard { inner_corners: [9, 6], square_mm: 10.0, border_mm: 5.0, first_square: "black".into() }
    }
    fn seen(pose: &Rigid<Camera, Board>, sigma_px: f64, seed: u64) -> BoardView {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        let noise = Normal::new(0.0, sigma_px).unwrap();
        let points = board()
            .features()
            .iter()
            .enumerate()
            .map(|(feature_id, x)| {
                let pixel = camera().pixel_from_point(&pose.point(x)).unwrap();
                BoardPoint { feature_id, pixel: pixel + Vec2::from_fn(|_, _| noise.sample(&mut rng)), sigma_px }
            })
            .collect();
        BoardView { points, ..BoardView::default() }
    }

    #[test]
    fn poses_come_with_their_true_sigmas() {
        let mut sum = Vec::new();
        for seed in 0..100 {
            let tilt = 0.2 + 0.004 * seed as f64;
            let truth = Rigid::from_vectors(&Vec3::new(tilt, -0.2, 0.4), Vec3::new(-40.0, -20.0, 180.0));
            let found = board_pose(&camera(), &board(), &seen(&truth, 0.05, seed)).unwrap();
            let d = crate::geometry::log(&(found.camera_from_board.rotation * truth.rotation.transpose()));
            let t = found.camera_from_board.translation - truth.translation;
            let e = nalgebra::Vector6::new(t.x, t.y, t.z, d.x, d.y, d.z);
            sum.push((e.transpose() * found.covariance.try_inverse().unwrap() * e)[0]);
        }
        // Mean of 100 chi-squares with 6 degrees of freedom: 6 ± 0.35.
        let mean = sum.iter().sum::<f64>() / sum.len() as f64;
        assert!((4.8..7.2).contains(&mean), "{mean}");
    }

    #[test]
    fn the_tilt_has_the_right_sign_and_a_wrong_point_does_no_harm() {
        let truth = Rigid::from_vectors(&Vec3::new(-0.5, 0.1, 0.0), Vec3::new(-40.0, -20.0, 200.0));
        let mut view = seen(&truth, 0.02, 3);
        view.points[17].pixel.x += 9.0;
        let found = board_pose(&camera(), &board(), &view).unwrap();
        assert!(found.camera_from_board.difference(&truth).0 < 2e-3, "{found:?}");
        assert!(found.ambiguity > 2.0 && found.weights[17] < 0.1);
    }

    #[test]
    fn the_mirrored_start_reaches_the_right_minimum() {
        let truth: Rigid<Camera, Board> =
            Rigid::from_vectors(&Vec3::new(-0.5, 0.1, 0.0), Vec3::new(-40.0, -20.0, 200.0));
        let centre = Vec3::new(40.0, 25.0, 0.0);
        let other = mirrored(&truth, &centre);
        assert!((other.point(&centre) - truth.point(&centre)).norm() < 1e-9);
        assert!(other.difference(&truth).0 > 0.5);
        assert!(mirrored(&other, &centre).difference(&truth).0 < 1e-9);
    }
}
