//! In: board features seen in several pictures. Out: the camera, every board's pose, covariance, residuals
//! (\[zhang00\] section 3.2 and 3.3; docs/math.md, Camera calibration (7)).
//! Frame and unit: pixels; board and camera frames in mm.

use super::bundle::{Bent, Corner, State};
use super::choice::{Doubt, by_evidence, by_families, by_folding, by_shape, resized, shaped};
use super::fit::Fit;
use super::lens::Lens;
use super::zhang::{Seen, first_camera};
use crate::calibrate::boards::BoardView;
use crate::calibrate::boards::shape::{Basis, Shape};
use crate::calibrate::homography::homography;
use crate::calibrate::pose::pose_from_homography;
use crate::camera::{Intrinsics, LENS, PARAMETERS, ParameterMatrix, Parameters, SKEW};
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Mat3, Rigid, Vec2, Vec3};
use crate::solve::{End, LmOptions, Loss, Solution};

/// A picture of a board: its name for messages, the board's features, their pixels.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Name of the picture.
    pub name: String,
    /// Positions in the board frame, mm; `BoardPoint::feature_id` indexes them.
    pub features: std::sync::Arc<Vec<Vec3>>,
    /// The features found in the picture, px.
    pub view: BoardView,
}

/// Settings of the camera solve.
#[derive(Clone, Debug, PartialEq)]
pub struct SolveOptions {
    /// Selects the lens terms that are estimated.
    pub lens: Lens,
    /// Whether the skew is estimated; false for every sensor with a rectangular pixel grid.
    pub skew: bool,
    /// Loss against single wrong corners; its threshold is in sigmas of the residuals.
    pub loss: Loss,
    /// Whether corners are weighted by their own sigmas; false: all have equal weight.
    pub weigh: bool,
    /// Assumption about the shape of the boards.
    pub boards: Boards,
}

/// Assumption about the shape of the boards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray)]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Boards {
    /// As drawn, unless all pictures show one board and held-out pictures fit better with a shape that is estimated
    /// besides the camera ([`Shape`]). The report states the choice.
    #[default]
    Evidence,
    /// As drawn.
    Drawn,
    /// One board; its shape is always estimated.
    Shaped,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Boards>("boards", word)
}

impl Default for SolveOptions {
    fn default() -> Self {
        SolveOptions {
            lens: Lens::Evidence,
            skew: false,
            loss: Loss::Huber(2.5),
            weigh: true,
            boards: Boards::Evidence,
        }
    }
}

/// A solved camera.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The camera that fits all pictures best.
    pub intrinsics: Intrinsics,
    /// The board's shape if it was estimated ([`Boards`]).
    pub shape: Option<Shape>,
    /// One entry per picture.
    pub camera_from_board: Vec<Rigid<Camera, Board>>,
    /// Covariance of the intrinsic parameters (order: [`crate::camera::NAMES`]) with zero rows for held ones. It
    /// includes the scale of the residuals and the pictures' repeatability. `None` if something is not determined.
    pub covariance: Option<ParameterMatrix>,
    /// Scatter of the parameters from picture to picture, relative to the scatter by independent errors of the
    /// corners. Factors on the standard deviations, 1 or more, already included in the covariance.
    pub repeat: Parameters,
    /// Parameters held at their value, indices into [`crate::camera::NAMES`].
    pub held: Vec<usize>,
    /// Residuals (seen minus predicted) in px and robust weights, picture by picture.
    pub residuals: Vec<Vec<(Vec2, f64)>>,
    /// Unweighted rms over all corners, px: sqrt(sum |r|² / n) as OpenCV reports it.
    pub rms_px: f64,
    /// Scale of the residuals over the corners' own sigmas; 1 if these sigmas are right.
    pub sigma0: f64,
    /// Reciprocal condition of the normal equations.
    pub condition: f64,
    /// Number of steps of the last solve.
    pub iterations: usize,
    /// Whether the fit is a minimum.
    pub end: End,
    /// Families of lens terms that fit better and are not adopted; the covariance contains the changes by them.
    pub doubts: Vec<Doubt>,
    /// Prior of the board's shape.
    bent: Option<Bent>,
}

impl Solved {
    /// Positions of features on the board, mm.
    pub fn places(&self, features: &[Vec3]) -> Vec<Vec3> {
        features.iter().map(|x| self.shape.as_ref().map_or(*x, |s| s.place(x))).collect()
    }
}

/// Solves jointly for the camera, the boards' poses and, if the pictures determine it, the board's shape.
///
/// # Errors
/// Fewer than two pictures with at least 6 corners each; corners on one line; no camera that fits them.
pub fn solve(pictures: &[Observation], width: u32, height: u32, options: &SolveOptions) -> Result<Solved> {
    if pictures.len() < 2 {
        return Err(Fault::refused(format!("{} picture shows the board, 3 or more are needed", pictures.len()))
            .cause("one view of a plane gives two equations for the camera's four numbers [zhang00, section 3.1]")
            .next("take 10 to 20 pictures with the board tilted differently each time"));
    }
    let points: Vec<Vec<Corner>> = pictures.iter().map(|o| measured(o, options.weigh)).collect();
    let seen = pictures.iter().zip(&points).map(|(o, p)| see(&o.name, p)).collect::<Result<Vec<Seen>>>()?;
    let start = first_camera(&seen, width, height).ok_or_else(|| {
        Fault::refused("no pinhole camera explains the boards")
            .cause("the corners belong to another board than the one described, or the pictures are mirrored")
            .next("compare the board with its description")
    })?;
    let to_normalised =
        Mat3::new(1.0 / start.fx, 0.0, -start.cx / start.fx, 0.0, 1.0 / start.fy, -start.cy / start.fy, 0.0, 0.0, 1.0);
    let poses = seen.iter().map(|s| pose_from_homography(&(to_normalised * s.homography))).collect();
    let mut fit = Fit { corners: &points, like: &start, loss: options.loss, bent: None };
    let mut held: Vec<usize> = options.lens.held();
    if !options.skew {
        held.push(SKEW);
    }
    // First without the higher lens terms and with all corners at full weight: the closed form is far off.
    let rough: Vec<usize> = (LENS + 1..PARAMETERS).chain(held.iter().copied()).collect();
    let coarse = LmOptions { max_iterations: 15, tolerance: 1e-4, ..LmOptions::default() };
    let first = fit.with(&rough, State { camera: start.parameters(), shape: Vec::new(), poses }, coarse);
    let mut solution = first.so_far().and_then(|first| fit.fine(&held, first.state).so_far()).ok_or_else(unsolved)?;
    let basis = (options.boards != Boards::Drawn).then(|| one_board(pictures)).flatten();
    match basis {
        Some(basis) if options.boards == Boards::Evidence => by_shape(&mut fit, basis, &mut solution, &held),
        Some(basis) => shaped(&mut fit, basis, &mut solution, &held),
        None => {}
    }
    if options.boards == Boards::Shaped && fit.bent.is_none() {
        return Err(Fault::refused("the board's shape is not determined")
            .cause("the pictures show several boards, or too few of one")
            .next("use pictures of one board, 8 or more, or take it as drawn (--board drawn)"));
    }
    let mut doubts = Vec::new();
    if options.lens == Lens::Evidence {
        doubts = by_families(&fit, &mut solution, &mut held);
        resized(&mut fit, &mut solution, &held);
        by_evidence(&fit, &mut solution, &mut held);
        doubts.extend(by_folding(&fit, &mut solution, &mut held));
    }
    // From the chosen optimum this takes a step or two, and shows whether it is a minimum.
    let (solution, end) = fit.fine(&held, solution.state).ended().ok_or_else(unsolved)?;
    if solution.state.camera.iter().any(|x| !x.is_finite()) {
        return Err(unsolved());
    }
    let mut solved = finish(&fit, solution, end, held);
    if let Some(stated) = solved.covariance {
        let added = doubts.iter().filter_map(|d| d.covariance(&solved.intrinsics, &stated));
        solved.covariance = Some(added.fold(stated, |sum, more| sum + more));
    }
    Ok(Solved { doubts, ..solved })
}

/// The same camera from a subset of its pictures, with the choices made from all of them.
pub(super) fn without(
    solved: &Solved,
    pictures: &[Observation],
    out: impl Fn(usize) -> bool,
    options: &SolveOptions,
) -> Option<(Intrinsics, Option<Shape>)> {
    let others: Vec<usize> = (0..pictures.len()).filter(|&i| !out(i)).collect();
    let corners: Vec<Vec<Corner>> = others.iter().map(|&i| measured(&pictures[i], options.weigh)).collect();
    let fit = Fit { corners: &corners, like: &solved.intrinsics, loss: options.loss, bent: solved.bent };
    let start = State {
        camera: solved.intrinsics.parameters(),
        shape: solved.shape.as_ref().map_or(Vec::new(), |s| s.coefficients.clone()),
        poses: others.iter().map(|&i| solved.camera_from_board[i]).collect(),
    };
    let found = fit.rough(&solved.held, start)?;
    Some((fit.camera(&found), fit.shape(&found)))
}

fn unsolved() -> Fault {
    Fault::refused("the camera could not be solved")
        .cause("the corners contradict each other, or do not determine this number of lens terms")
        .next(
            "look at the pictures and exclude those where the board was misread; ask for fewer lens terms (--lens \
               five)",
        )
}

/// The basis for the board's shape, if all pictures show the same board.
pub(super) fn one_board(pictures: &[Observation]) -> Option<Basis> {
    let first = pictures.first()?;
    pictures.iter().all(|o| o.features == first.features).then(|| Basis::of(&first.features)).flatten()
}

/// Corners with sigmas for the solver. A floor keeps a few very sharp corners from dominating: printing and flatness
/// leave about 0.01 px on any real board.
pub(super) fn measured(o: &Observation, weigh: bool) -> Vec<Corner> {
    let sigma = |s: f64| if weigh { s.hypot(0.01) } else { 1.0 };
    o.view.points.iter().map(|p| (o.features[p.feature_id], p.pixel, sigma(p.sigma_px))).collect()
}

fn see(name: &str, points: &[Corner]) -> Result<Seen> {
    let plane: Vec<Vec2> = points.iter().map(|p| p.0.xy()).collect();
    let pixels: Vec<Vec2> = points.iter().map(|p| p.1).collect();
    let homography = (points.len() >= 6).then(|| homography(&plane, &pixels)).flatten().ok_or_else(|| {
        Fault::refused(format!("{name}: the {} corners seen do not determine the board's place", points.len()))
            .cause("fewer than 6 corners, or all on one line")
            .next("exclude this picture, or take it again with more of the board in view")
    })?;
    Ok(Seen { plane, pixels, homography })
}

fn finish(fit: &Fit<'_>, solution: Solution<State>, end: End, held: Vec<usize>) -> Solved {
    let (camera, shape) = (fit.camera(&solution), fit.shape(&solution));
    let place = |x: &Vec3| shape.as_ref().map_or(*x, |s| s.place(x));
    let mut weights = solution.weights.iter();
    let mut sum = 0.0;
    let mut count = 0usize;
    let residuals: Vec<Vec<(Vec2, f64)>> = fit
        .corners
        .iter()
        .zip(&solution.state.poses)
        .map(|(points, pose)| {
            points
                .iter()
                .map(|(x, pixel, _)| {
                    let r =
                        camera.pixel_from_point(&pose.point(&place(x))).map_or(Vec2::repeat(f64::NAN), |p| pixel - p);
                    sum += r.norm_squared();
                    count += 1;
                    (r, weights.next().copied().unwrap_or(0.0))
                })
                .collect()
        })
        .collect();
    let belief = fit.belief(&solution);
    Solved {
        intrinsics: camera,
        shape,
        camera_from_board: solution.state.poses.clone(),
        covariance: belief.map(|b| b.0),
        bent: fit.bent,
        repeat: belief.map_or(Parameters::repeat(1.0), |b| b.1),
        held,
        residuals,
        rms_px: (sum / count.max(1) as f64).sqrt(),
        sigma0: solution.sigma0,
        condition: solution.condition,
        iterations: solution.iterations,
        end,
        doubts: Vec::new(),
    }
}
