//! In: board features seen in several pictures. Out: the camera, every board's pose, covariance,
//! residuals ([zhang00] section 3.2 and 3.3; docs/math.md, Camera calibration (7)).
//! Frame and unit: pixels; board and camera frames in mm.

use super::boards::BoardView;
use super::homography::homography;
use super::pose::{moved, point_by_step, pose_from_homography};
use super::projection::{INTRINSICS, NAMES, from_vector, project, to_vector};
use super::zhang::{Seen, first_camera};
use crate::camera::Intrinsics;
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Mat3, Rigid, Vec2, Vec3};
use crate::solve::{Blocks, LmOptions, Loss, Problem, Residuals, Solution, Stop, lm};
use nalgebra::{DMatrix, Matrix2x6, SMatrix};

/// A picture of a board: its name for messages, the board's features, what was seen of them.
#[derive(Clone, Debug)]
pub struct Observation {
    pub name: String,
    /// Positions in the board frame, mm; `BoardPoint::feature_id` indexes them.
    pub features: std::sync::Arc<Vec<Vec3>>,
    pub view: BoardView,
}

/// Which lens terms are estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lens {
    /// All five; terms that the pictures do not determine are held at zero and said so.
    #[default]
    Evidence,
    /// k1 k2 p1 p2 k3, whatever comes.
    Five,
    /// k1 k2 p1 p2.
    Four,
    /// k1 alone.
    One,
    /// A pinhole.
    None,
}

impl std::str::FromStr for Lens {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<Lens, String> {
        match s {
            "evidence" => Ok(Lens::Evidence),
            "five" => Ok(Lens::Five),
            "four" => Ok(Lens::Four),
            "one" => Ok(Lens::One),
            "none" => Ok(Lens::None),
            _ => Err(format!("unknown lens '{s}': evidence, five, four, one or none")),
        }
    }
}

impl Lens {
    fn held(self) -> &'static [usize] {
        match self {
            Lens::Evidence | Lens::Five => &[],
            Lens::Four => &[8],
            Lens::One => &[5, 6, 7, 8],
            Lens::None => &[4, 5, 6, 7, 8],
        }
    }
}

/// Settings of the camera solve.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveOptions {
    pub lens: Lens,
    /// Estimate the skew; false for every sensor with square rows.
    pub skew: bool,
    /// For single wrong corners; the threshold is in sigmas of the residuals.
    pub loss: Loss,
    /// Weigh corners by their own sigmas; false: all alike.
    pub weigh: bool,
}

impl Default for SolveOptions {
    fn default() -> Self {
        SolveOptions { lens: Lens::Evidence, skew: false, loss: Loss::Huber(2.5), weigh: true }
    }
}

/// A solved camera.
#[derive(Clone, Debug)]
pub struct Solved {
    pub intrinsics: Intrinsics,
    /// One a picture.
    pub camera_from_board: Vec<Rigid<Camera, Board>>,
    /// Of the ten intrinsic parameters (order: [`NAMES`]), zero rows for held ones; the residuals'
    /// own scale is in it. `None` where something is not determined.
    pub covariance: Option<DMatrix<f64>>,
    /// Held at their value, indices into [`NAMES`].
    pub held: Vec<usize>,
    /// Residuals (seen minus predicted) in px and robust weight, picture by picture.
    pub residuals: Vec<Vec<(Vec2, f64)>>,
    /// Over all corners, unweighted, px: sqrt(sum |r|² / n) as OpenCV reports it.
    pub rms_px: f64,
    /// Residuals over the corners' own sigmas; 1 where the corner fits' sigmas tell the truth.
    pub sigma0: f64,
    /// Reciprocal condition of the normal equations.
    pub condition: f64,
    pub iterations: usize,
}

type State = ([f64; INTRINSICS], Vec<Rigid<Camera, Board>>);

struct Bundle<'a> {
    pictures: Vec<Vec<(Vec3, Vec2, f64)>>,
    like: &'a Intrinsics,
}

impl Problem for Bundle<'_> {
    type State = State;
    fn width(&self) -> usize {
        INTRINSICS + 6 * self.pictures.len()
    }
    fn blocks(&self) -> Option<Blocks> {
        Some(Blocks { first: INTRINSICS, size: 6 })
    }
    fn moved(&self, (k, poses): &State, step: &[f64]) -> State {
        let k = std::array::from_fn(|i| k[i] + step[i]);
        let poses = poses.iter().zip(step[INTRINSICS..].chunks_exact(6)).map(|(p, s)| moved(p, s)).collect();
        (k, poses)
    }
    fn residuals(&self, (k, poses): &State, out: &mut Residuals) -> Option<()> {
        let camera = from_vector(k, self.like);
        if camera.fx <= 0.0 || camera.fy <= 0.0 {
            return None;
        }
        for (picture, (points, pose)) in self.pictures.iter().zip(poses).enumerate() {
            let first = INTRINSICS + 6 * picture;
            let columns: [usize; 16] = std::array::from_fn(|i| if i < INTRINSICS { i } else { first + i - INTRINSICS });
            for (x, pixel, sigma) in points {
                let rotated = pose.rotation * x;
                let p = rotated + pose.translation;
                if !out.wants_jacobian() {
                    let r = (camera.pixel_from_point(&p)? - pixel) / *sigma;
                    out.group(&[r.x, r.y], &columns, &[]);
                    continue;
                }
                let q = project(&camera, &p)?;
                let r = (q.pixel - pixel) / *sigma;
                let by_pose: Matrix2x6<f64> = q.by_point * point_by_step(&rotated);
                let mut j = SMatrix::<f64, 16, 2>::zeros();
                j.fixed_view_mut::<10, 2>(0, 0).copy_from(&(q.by_intrinsics.transpose() / *sigma));
                j.fixed_view_mut::<6, 2>(10, 0).copy_from(&(by_pose.transpose() / *sigma));
                out.group(&[r.x, r.y], &columns, j.as_slice());
            }
        }
        Some(())
    }
}

/// Solves for camera and poses together.
///
/// # Errors
/// Fewer than two pictures with at least 6 corners each; corners on a line; no camera explains them.
pub fn solve(pictures: &[Observation], width: u32, height: u32, options: &SolveOptions) -> Result<Solved> {
    if pictures.len() < 2 {
        return Err(Fault::refused(format!("{} picture shows the board, 3 or more are needed", pictures.len()))
            .cause("one view of a plane gives two equations for the camera's four numbers [zhang00, section 3.1]")
            .next("take 10 to 20 pictures with the board tilted differently each time"));
    }
    let points: Vec<Vec<(Vec3, Vec2, f64)>> = pictures.iter().map(|o| measured(o, options.weigh)).collect();
    let seen = pictures.iter().zip(&points).map(|(o, p)| see(&o.name, p)).collect::<Result<Vec<Seen>>>()?;
    let start = first_camera(&seen, width, height).ok_or_else(|| {
        Fault::refused("no pinhole camera explains the boards")
            .cause("the corners belong to another board than the one described, or the pictures are mirrored")
            .next("compare the board with its description")
    })?;
    let to_normalised =
        Mat3::new(1.0 / start.fx, 0.0, -start.cx / start.fx, 0.0, 1.0 / start.fy, -start.cy / start.fy, 0.0, 0.0, 1.0);
    let poses = seen.iter().map(|s| pose_from_homography(&(to_normalised * s.homography))).collect();
    let problem = Bundle { pictures: points, like: &start };
    let mut held: Vec<usize> = options.lens.held().to_vec();
    if !options.skew {
        held.push(9);
    }
    // First without the higher lens terms and with all corners counting: the closed form is far off.
    let coarse = LmOptions { hold: vec![5, 6, 7, 8, 9], max_iterations: 15, tolerance: 1e-4, ..LmOptions::default() };
    let first = lm(&problem, (to_vector(&start), poses), &coarse);
    let fine = |held: &[usize], from: State| {
        let estimate_scale = options.loss != Loss::Squares;
        lm(
            &problem,
            from,
            &LmOptions { loss: options.loss, estimate_scale, hold: held.to_vec(), ..LmOptions::default() },
        )
    };
    let mut solution = fine(&held, first.state);
    if options.lens == Lens::Evidence {
        drop_undetermined(&mut solution, &mut held, &fine, &start);
    }
    if solution.stop == Stop::BadStart || solution.state.0.iter().any(|x| !x.is_finite()) {
        return Err(Fault::refused("the camera could not be solved")
            .cause("the corners contradict each other")
            .next("look at the pictures and leave out those where the board was misread"));
    }
    Ok(finish(&problem, solution, held, &start))
}

/// Corners with sigmas for the solver. A floor keeps a few very sharp corners from ruling: printing
/// and flatness leave about 0.01 px on any real board.
fn measured(o: &Observation, weigh: bool) -> Vec<(Vec3, Vec2, f64)> {
    let sigma = |s: f64| if weigh { s.hypot(0.01) } else { 1.0 };
    o.view.points.iter().map(|p| (o.features[p.feature_id], p.pixel, sigma(p.sigma_px))).collect()
}

fn see(name: &str, points: &[(Vec3, Vec2, f64)]) -> Result<Seen> {
    let plane: Vec<Vec2> = points.iter().map(|p| p.0.xy()).collect();
    let pixels: Vec<Vec2> = points.iter().map(|p| p.1).collect();
    let homography = (points.len() >= 6).then(|| homography(&plane, &pixels)).flatten().ok_or_else(|| {
        Fault::refused(format!("{name}: the {} corners seen do not determine the board's place", points.len()))
            .cause("fewer than 6 corners, or all on one line")
            .next("leave this picture out, or take it again with more of the board in view")
    })?;
    Ok(Seen { plane, pixels, homography })
}

/// Holds lens terms at zero, from the highest down, where the pictures cannot tell them from zero and
/// where estimating them would cost accuracy (expected ray error over the image).
fn drop_undetermined(
    solution: &mut Solution<State>,
    held: &mut Vec<usize>,
    fine: &dyn Fn(&[usize], State) -> Solution<State>,
    like: &Intrinsics,
) {
    for block in [&[8][..], &[6, 7], &[5], &[4]] {
        let telling = solution.scaled_covariance().is_some_and(|c| {
            let theta = nalgebra::DVector::from_iterator(block.len(), block.iter().map(|&i| solution.state.0[i]));
            let sub = DMatrix::from_fn(block.len(), block.len(), |a, b| c[(block[a], block[b])]);
            let z2 = sub.try_inverse().map_or(0.0, |inv| (theta.transpose() * inv * &theta)[0]);
            z2 > 4.0 * block.len() as f64
        });
        if telling {
            return;
        }
        let mut fewer = held.clone();
        fewer.extend(block);
        let mut start = solution.state.clone();
        block.iter().for_each(|&i| start.0[i] = 0.0);
        let reduced = fine(&fewer, start);
        let cost = |s: &Solution<State>| {
            let camera = from_vector(&s.state.0, like);
            s.scaled_covariance().map_or(f64::INFINITY, |c| {
                super::intrinsics_quality::expected_ray_error(
                    &camera,
                    &c.view((0, 0), (INTRINSICS, INTRINSICS)).into_owned(),
                )
            })
        };
        if cost(solution) < 1.25 * cost(&reduced) {
            return;
        }
        *solution = reduced;
        *held = fewer;
    }
}

fn finish(problem: &Bundle<'_>, solution: Solution<State>, held: Vec<usize>, like: &Intrinsics) -> Solved {
    let camera = from_vector(&solution.state.0, like);
    let mut weights = solution.weights.iter();
    let mut sum = 0.0;
    let mut count = 0usize;
    let residuals: Vec<Vec<(Vec2, f64)>> = problem
        .pictures
        .iter()
        .zip(&solution.state.1)
        .map(|(points, pose)| {
            points
                .iter()
                .map(|(x, pixel, _)| {
                    let r = camera.pixel_from_point(&pose.point(x)).map_or(Vec2::repeat(f64::NAN), |p| pixel - p);
                    sum += r.norm_squared();
                    count += 1;
                    (r, weights.next().copied().unwrap_or(0.0))
                })
                .collect()
        })
        .collect();
    Solved {
        intrinsics: camera,
        camera_from_board: solution.state.1.clone(),
        covariance: solution.scaled_covariance().map(|c| c.view((0, 0), (INTRINSICS, INTRINSICS)).into_owned()),
        held,
        residuals,
        rms_px: (sum / count.max(1) as f64).sqrt(),
        sigma0: solution.sigma0,
        condition: solution.condition,
        iterations: solution.iterations,
    }
}

/// Names of the parameters that were held.
pub fn held_names(held: &[usize]) -> Vec<&'static str> {
    held.iter().filter(|i| **i != 9).map(|&i| NAMES[i]).collect()
}
