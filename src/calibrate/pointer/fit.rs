//! In: spots on boards, a start beam. Out: the beam of these spots by maximum likelihood, where the boards' poses may
//! move within their own uncertainty; the distance of a spot from the beam; the derivatives by the camera.
//! Frame and unit: camera frame, mm; spots in px (docs/math.md, Pointer (3) to (5)).

use super::beam::moved_beam;
use crate::calibrate::measured_pose::MeasuredPose;
use crate::camera::{Intrinsics, PARAMETERS, Parameters, difference_step};
use crate::geometry::{Board, Camera, Plane, Ray, Rigid, Twist, Vec2, Vec3};
use crate::solve::{End, LmOptions, Problem, Residuals, lm};
use nalgebra::{DMatrix, Matrix2, Matrix6, SMatrix};

/// One board with the pointer's spot on it.
#[derive(Clone, Debug)]
pub struct SpotView {
    /// Pose of the board in the camera frame, as measured in the picture.
    pub pose: MeasuredPose,
    /// The spot's centre, px.
    pub pixel: Vec2,
    /// Covariance of the spot's centre, px².
    pub covariance: Matrix2<f64>,
}

/// The unknowns.
#[derive(Clone)]
pub(super) struct State {
    pub(super) beam: Ray<Camera>,
    poses: Vec<Rigid<Camera, Board>>,
}

struct Fit<'a> {
    camera: &'a Intrinsics,
    views: &'a [&'a SpotView],
    /// The boards' poses measured with this camera.
    measured: Vec<Rigid<Camera, Board>>,
    roots: Vec<Matrix6<f64>>,
    whiteners: Vec<Matrix2<f64>>,
}

/// The intersection of the beam with a board, and its pixel.
pub(super) fn spot(camera: &Intrinsics, beam: &Ray<Camera>, pose: &Rigid<Camera, Board>) -> Option<(Vec3, Vec2)> {
    let normal: Vec3 = pose.rotation.column(2).into();
    let plane = Plane::<Camera>::new(normal, normal.dot(&pose.translation))?;
    // Boards may lie on either side of the beam's origin.
    let slope = plane.normal.dot(&beam.direction);
    let p = beam.at(-plane.distance(&beam.origin) / slope);
    (slope.abs() > 1e-6).then_some(())?;
    Some((p, camera.pixel_from_point(&p)?))
}

impl Fit<'_> {
    fn residual(&self, beam: &Ray<Camera>, pose: &Rigid<Camera, Board>, i: usize) -> Option<Vec2> {
        Some(self.whiteners[i] * (spot(self.camera, beam, pose)?.1 - self.views[i].pixel))
    }
}

impl Problem for Fit<'_> {
    type State = State;
    fn width(&self) -> usize {
        4 + 6 * self.views.len()
    }
    fn moved(&self, s: &State, d: &[f64]) -> State {
        State {
            beam: moved_beam(&s.beam, d),
            poses: s.poses.iter().enumerate().map(|(i, p)| Twist::new(&d[4 + 6 * i..]).moved(p)).collect(),
        }
    }
    fn residuals(&self, s: &State, out: &mut Residuals) -> Option<()> {
        for i in 0..self.views.len() {
            let r = self.residual(&s.beam, &s.poses[i], i)?;
            let mut j = [0.0; 20];
            for c in 0..10 {
                // Central differences: a spot's pixel is a smooth function of mm and mrad.
                let h = if [0, 1, 4, 5, 6].contains(&c) { 1e-4 } else { 1e-6 };
                let at = |sign: f64| {
                    let mut d = [0.0; 10];
                    d[c] = sign * h;
                    self.residual(&moved_beam(&s.beam, &d[..4]), &Twist::new(&d[4..]).moved(&s.poses[i]), i)
                };
                let slope = (at(1.0)? - at(-1.0)?) / (2.0 * h);
                (j[c], j[10 + c]) = (slope.x, slope.y);
            }
            let at = 4 + 6 * i;
            let columns: [usize; 10] = std::array::from_fn(|c| if c < 4 { c } else { at + c - 4 });
            out.group(r.as_slice(), &columns, &j);
            let e = self.roots[i] * Twist::between(&self.measured[i], &s.poses[i]).vector();
            out.prior(e.as_slice(), &columns[4..], self.roots[i].transpose().as_slice());
        }
        Some(())
    }
}

/// Beam and poses, their covariance, the sum of squared residuals, and whether that is a minimum.
pub(super) type Solved = (State, DMatrix<f64>, f64, End);

/// `shift`: difference between this camera's parameters and those that the boards were measured with.
pub(super) fn fit(
    views: &[&SpotView],
    camera: &Intrinsics,
    shift: &Parameters,
    start: &Ray<Camera>,
    factor: f64,
) -> Option<Solved> {
    let roots = views
        .iter()
        .map(|v| Some((v.pose.information / v.pose.factor_among(factor).powi(2)).cholesky()?.l().transpose()))
        .collect::<Option<Vec<_>>>()?;
    let whiteners = views.iter().map(|v| v.covariance.cholesky()?.l().try_inverse()).collect::<Option<Vec<_>>>()?;
    let measured: Vec<_> = views
        .iter()
        .map(|v| Twist::new((v.pose.by_intrinsics * shift).as_slice()).moved(&v.pose.camera_from_board))
        .collect();
    let problem = Fit { camera, views, measured: measured.clone(), roots, whiteners };
    let (found, end) = lm(&problem, State { beam: *start, poses: measured }, &LmOptions::default()).ended()?;
    // Groups alternate: spot, board.
    let cost = found.lengths.iter().map(|l| l * l).sum();
    Some((found.state, found.covariance?, cost, end))
}

/// Squared Mahalanobis distance of a spot from a beam. `used`: whether the beam was fitted to this spot.
pub(super) fn distance2(view: &SpotView, camera: &Intrinsics, s: &Solved, used: bool, factor: f64) -> f64 {
    let (state, local, ..) = s;
    let pose = &view.pose.camera_from_board;
    let Some((_, q)) = spot(camera, &state.beam, pose) else { return f64::INFINITY };
    let mut j = SMatrix::<f64, 2, 10>::zeros();
    for c in 0..10 {
        let h = if [0, 1, 4, 5, 6].contains(&c) { 1e-4 } else { 1e-6 };
        let at = |sign: f64| {
            let mut d = [0.0; 10];
            d[c] = sign * h;
            spot(camera, &moved_beam(&state.beam, &d[..4]), &Twist::new(&d[4..]).moved(pose)).map(|s| s.1)
        };
        let (Some(a), Some(b)) = (at(1.0), at(-1.0)) else { return f64::INFINITY };
        j.set_column(c, &((a - b) / (2.0 * h)));
    }
    let by_pose = j.fixed_columns::<6>(4);
    let by_beam = j.fixed_columns::<4>(0);
    let beam: SMatrix<f64, 4, 4> = local.fixed_view::<4, 4>(0, 0).into();
    let own = view.covariance + by_pose * view.pose.covariance(view.pose.factor_among(factor)) * by_pose.transpose();
    let fitted = by_beam * beam * by_beam.transpose();
    let total = if used { own - fitted } else { own + fitted };
    let e = q - view.pixel;
    let solve = |m: Matrix2<f64>| m.cholesky().map(|c| e.dot(&c.solve(&e)));
    solve(total).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}

/// d(ox oy oz dx dy dz)/d(camera) for the uncertain parameters, by repeated solves with a slightly changed camera.
/// The boards' poses change with the camera, too.
pub(super) fn by_camera(
    views: &[&SpotView],
    camera: &Intrinsics,
    state: &State,
    uncertain: &[usize],
    factor: f64,
) -> Option<DMatrix<f64>> {
    let mut out = DMatrix::zeros(6, PARAMETERS);
    for &k in uncertain {
        let h = difference_step(k);
        let at = |sign: f64| {
            let mut d = Parameters::zeros();
            d[k] = sign * h;
            let beam = fit(views, &camera.changed(&d), &d, &state.beam, factor)?.0.beam;
            // All beams are compared where they cross one plane, perpendicular to the first beam.
            let s = (state.beam.origin - beam.origin).dot(&state.beam.direction)
                / beam.direction.dot(&state.beam.direction);
            Some((beam.origin + beam.direction * s, beam.direction))
        };
        let (a, b) = (at(1.0)?, at(-1.0)?);
        for i in 0..3 {
            out[(i, k)] = (a.0[i] - b.0[i]) / (2.0 * h);
            out[(3 + i, k)] = (a.1[i] - b.1[i]) / (2.0 * h);
        }
    }
    Some(out)
}
