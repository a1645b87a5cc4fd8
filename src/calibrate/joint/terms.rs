//! In: stops at a state. Out: the residual of each measurement in sigmas, with its derivatives by the unknowns.
//! Frame and unit: see `unknowns`; residuals in sigmas (docs/math.md, Joint calibration (1) to (5)).

use super::options::{CameraPrior, Noise};
use super::shots::{Part, Reported, Shot, Spot};
use super::unknowns::{Layout, State};
use crate::calibrate::hand_eye::closed::{Far, Near};
use crate::calibrate::hand_eye::options::Mount;
use crate::calibrate::laser_plane::terms::{look, mm_per_px, on_board, row};
use crate::calibrate::laser_plane::views::StripePeak;
use crate::calibrate::pointer::beam::across;
use crate::calibrate::projection::project;
use crate::camera::{Intrinsics, PARAMETERS};
use crate::geometry::{Base, Board, Camera, Flange, Mat3, Rigid, Twist, Vec2, Vec3, log, skew};
use crate::solve::{Blocks, Problem, Residuals};
use nalgebra::{DMatrix, DVector, Matrix2, Matrix2x3, SMatrix};

/// A residual as [`Terms::visit`] reports it: its part and stop, its value in sigmas, the unknowns that it depends
/// on, and its derivatives by them, row by row.
pub struct Term<'a> {
    /// `None` for the prior of the camera.
    pub part: Option<Part>,
    /// Index of the stop.
    pub shot: usize,
    /// In sigmas.
    pub residual: &'a [f64],
    /// Indices of the unknowns.
    pub columns: &'a [usize],
    /// Row by row; empty if no derivatives were requested.
    pub jacobian: &'a [f64],
}

/// The measurements of one solve.
pub struct Terms<'a> {
    /// The stops.
    pub shots: &'a [Shot],
    /// Who carries the camera.
    pub mount: Mount,
    /// Positions of the unknowns.
    pub layout: &'a Layout,
    /// Noise of the sources.
    pub noise: Noise,
    /// For each stop: the sigmas of its peaks as distances from the laser plane, mm ([`Terms::settle`]).
    pub peak_sigma_mm: Vec<Vec<f64>>,
    /// The prior of the camera: its values, and the root of its information over the free parameters.
    pub prior: Option<(DVector<f64>, DMatrix<f64>)>,
}

/// Expected minus reported pose of the flange, with derivatives by hand-eye, the board's fixed pose and the board's
/// pose in the camera frame. Three rows of the position, three of the rotation.
pub struct Link {
    /// Expected minus reported: mm, rad.
    pub e: SMatrix<f64, 6, 1>,
    /// By the hand-eye transform.
    pub by_hand_eye: SMatrix<f64, 6, 6>,
    /// By the board's pose on its carrier.
    pub by_place: SMatrix<f64, 6, 6>,
    /// By the board's pose in the camera frame.
    pub by_board: SMatrix<f64, 6, 6>,
}

fn blocks(place: [Mat3; 2], turn: Mat3) -> SMatrix<f64, 6, 6> {
    let mut j = SMatrix::<f64, 6, 6>::zeros();
    j.fixed_view_mut::<3, 3>(0, 0).copy_from(&place[0]);
    j.fixed_view_mut::<3, 3>(0, 3).copy_from(&place[1]);
    j.fixed_view_mut::<3, 3>(3, 3).copy_from(&turn);
    j
}

/// The pose base_from_flange that the chain expects.
pub fn flange(
    mount: Mount,
    x: &Rigid<Near, Camera>,
    w: &Rigid<Far, Board>,
    t: &Rigid<Camera, Board>,
) -> Rigid<Base, Flange> {
    let (r, t) = match mount {
        Mount::EyeInHand => {
            let p = *w * t.inverse() * x.inverse();
            (p.rotation, p.translation)
        }
        Mount::EyeToHand => {
            let p = *x * *t * w.inverse();
            (p.rotation, p.translation)
        }
    };
    Rigid::new(r, t)
}

/// See [`Link`].
pub fn link(
    mount: Mount,
    x: &Rigid<Near, Camera>,
    w: &Rigid<Far, Board>,
    t: &Rigid<Camera, Board>,
    reported: &Rigid<Base, Flange>,
) -> Link {
    let p = flange(mount, x, w, t);
    let turn = log(&(p.rotation * reported.rotation.transpose()));
    let place = p.translation - reported.translation;
    let e = SMatrix::<f64, 6, 1>::from_column_slice(&[place.x, place.y, place.z, turn.x, turn.y, turn.z]);
    let (rx, rw, rt) = (x.rotation, w.rotation, t.rotation);
    match mount {
        Mount::EyeInHand => {
            // The flange's origin in the camera frame, and in the board frame.
            let c = -(rx.transpose() * x.translation);
            let b = rt.transpose() * (c - t.translation);
            let far_from_camera = rw * rt.transpose();
            let far_from_near = far_from_camera * rx.transpose();
            Link {
                e,
                by_hand_eye: blocks([-far_from_near, -far_from_near * skew(&x.translation)], -far_from_near),
                by_place: blocks([Mat3::identity(), -skew(&(rw * b))], Mat3::identity()),
                by_board: blocks([-far_from_camera, far_from_camera * skew(&c)], -far_from_camera),
            }
        }
        Mount::EyeToHand => {
            // The flange's origin in the board frame, and in the camera frame.
            let d = -(rw.transpose() * w.translation);
            let q = t.point(&d);
            let near_from_far = rx * rt * rw.transpose();
            Link {
                e,
                by_hand_eye: blocks([Mat3::identity(), -skew(&(rx * q))], Mat3::identity()),
                by_place: blocks([-near_from_far, -near_from_far * skew(&w.translation)], -near_from_far),
                by_board: blocks([rx, -rx * skew(&q)], rx),
            }
        }
    }
}

/// A peak's distance from the laser plane in sigmas, and its derivatives by the plane's three parameters, the board's
/// six, and the camera's.
fn peak(
    s: &State,
    board: &Rigid<Camera, Board>,
    p: &StripePeak,
    sigma_mm: f64,
) -> Option<(f64, [f64; 9], SMatrix<f64, 1, PARAMETERS>)> {
    let seen = look(&s.camera, 0, 0, p)?;
    let (r, j) = row(&s.plane, board, &seen, sigma_mm)?;
    let normal: Vec3 = board.rotation.column(2).into();
    let slope = normal.dot(&seen.ray);
    let depth = normal.dot(&board.translation) / slope;
    let along = (s.plane.normal - normal * (s.plane.normal.dot(&seen.ray) / slope)) * (depth / sigma_mm);
    let by_camera = project(&s.camera, &seen.ray)?.by_intrinsics;
    let by_ray = Vec2::new(along.x, along.y).transpose();
    Some((r, j, -(by_ray * seen.ray_by_pixel * by_camera)))
}

/// Intersection of the beam with a board, camera frame, mm.
pub fn lit(s: &State, board: &Rigid<Camera, Board>) -> Option<Vec3> {
    let normal: Vec3 = board.rotation.column(2).into();
    let slope = normal.dot(&s.beam.direction);
    (slope.abs() > 1e-6).then(|| s.beam.at(normal.dot(&(board.translation - s.beam.origin)) / slope))
}

/// A spot's residual, px, with derivatives by the camera, the beam's four numbers and the board's six.
pub struct SpotTerm {
    /// Expected minus seen.
    pub e: Vec2,
    /// By the camera's parameters.
    pub by_camera: SMatrix<f64, 2, PARAMETERS>,
    /// By the beam's two shifts and two tilts.
    pub by_beam: SMatrix<f64, 2, 4>,
    /// By a step of the board.
    pub by_board: SMatrix<f64, 2, 6>,
}

/// See [`SpotTerm`].
pub fn spot(s: &State, board: &Rigid<Camera, Board>, seen: &Vec2) -> Option<SpotTerm> {
    let p = lit(s, board)?;
    let at = project(&s.camera, &p)?;
    let normal: Vec3 = board.rotation.column(2).into();
    let d = s.beam.direction;
    // The component of a shift that leaves the board is compensated by a shift along the beam.
    let back: Mat3 = d * normal.transpose() / normal.dot(&d);
    let slide: Mat3 = Mat3::identity() - back;
    let far = (p - s.beam.origin).dot(&d);
    let [a, b] = across(&d);
    let to_pixel: Matrix2x3<f64> = at.by_point;
    let mut by_beam = SMatrix::<f64, 2, 4>::zeros();
    for (k, v) in [a, b, a * far, b * far].into_iter().enumerate() {
        by_beam.set_column(k, &(to_pixel * slide * v));
    }
    Some(SpotTerm {
        e: at.pixel - seen,
        by_camera: at.by_intrinsics,
        by_beam,
        by_board: to_pixel * back * Twist::lever(&p),
    })
}

/// The inverse Cholesky factor of a spot's covariance.
fn whitener(spot: &Spot) -> Option<Matrix2<f64>> {
    spot.covariance.cholesky()?.l().try_inverse()
}

impl Terms<'_> {
    /// Computes the peaks' sigmas in mm at a state: the scale from px to mm depends on the laser plane and the
    /// boards.
    pub fn settle(&mut self, s: &State) {
        let sigma = |(shot, board): (&Shot, &Rigid<Camera, Board>)| -> Vec<f64> {
            let of = |p: &StripePeak| {
                let seen = look(&s.camera, 0, 0, p)?;
                on_board(board, &seen.ray)?;
                Some(p.sigma_px * mm_per_px(&s.plane, board, &seen))
            };
            shot.stripe.iter().map(|p| of(p).filter(|s| s.is_finite() && *s > 0.0).unwrap_or(f64::INFINITY)).collect()
        };
        self.peak_sigma_mm = self.shots.iter().zip(&s.boards).map(sigma).collect();
    }

    /// Calls `out` with every residual at a state. `None` if the state is impossible.
    pub fn visit(&self, s: &State, wants: bool, out: &mut dyn FnMut(Term<'_>)) -> Option<()> {
        let mut columns = Vec::new();
        for i in 0..self.shots.len() {
            self.features(s, i, wants, &mut columns, out)?;
            self.stripe(s, i, wants, &mut columns, out)?;
            self.pointer(s, i, wants, &mut columns, out)?;
            self.robot(s, i, &mut columns, out);
        }
        if let Some((mean, root)) = &self.prior {
            let now = s.camera.parameters();
            let d = DVector::from_iterator(mean.len(), self.layout.camera.iter().map(|&i| now[i])) - mean;
            columns.clear();
            columns.extend(0..mean.len());
            let rows = root.transpose();
            out(Term {
                part: None,
                shot: 0,
                residual: (root * d).as_slice(),
                columns: &columns,
                jacobian: rows.as_slice(),
            });
        }
        Some(())
    }

    fn own(&self, i: usize, columns: &mut Vec<usize>, between: std::ops::Range<usize>) {
        columns.clear();
        columns.extend(0..self.layout.camera.len());
        columns.extend(between);
        columns.extend(self.layout.shot(i)..self.layout.shot(i) + 6);
    }

    fn features(
        &self,
        s: &State,
        i: usize,
        wants: bool,
        columns: &mut Vec<usize>,
        out: &mut dyn FnMut(Term<'_>),
    ) -> Option<()> {
        let (seen, board) = (&self.shots[i].seen, &s.boards[i]);
        self.own(i, columns, 0..0);
        let mut jacobian = Vec::new();
        for ((point, pixel), sigma) in seen.points.iter().zip(&seen.pixels).zip(&seen.sigmas_px) {
            let p = board.point(point);
            let scale = 1.0 / (sigma * self.noise.feature);
            let at = project(&s.camera, &p)?;
            let r = (at.pixel - pixel) * scale;
            jacobian.clear();
            if wants {
                let by_board = at.by_point * Twist::lever(&p) * scale;
                for k in 0..2 {
                    jacobian.extend(self.layout.camera.iter().map(|&c| at.by_intrinsics[(k, c)] * scale));
                    jacobian.extend(by_board.row(k).iter());
                }
            }
            out(Term { part: Some(Part::Features), shot: i, residual: r.as_slice(), columns, jacobian: &jacobian });
        }
        Some(())
    }

    fn stripe(
        &self,
        s: &State,
        i: usize,
        wants: bool,
        columns: &mut Vec<usize>,
        out: &mut dyn FnMut(Term<'_>),
    ) -> Option<()> {
        let at = self.layout.plane();
        self.own(i, columns, at..at + 3);
        let mut jacobian = Vec::new();
        for (p, sigma) in self.shots[i].stripe.iter().zip(&self.peak_sigma_mm[i]) {
            let (r, j, by_camera) = peak(s, &s.boards[i], p, sigma * self.noise.stripe)?;
            jacobian.clear();
            if wants {
                jacobian.extend(self.layout.camera.iter().map(|&c| by_camera[c]));
                jacobian.extend(j);
            }
            out(Term { part: Some(Part::Stripe), shot: i, residual: &[r], columns, jacobian: &jacobian });
        }
        Some(())
    }

    fn pointer(
        &self,
        s: &State,
        i: usize,
        wants: bool,
        columns: &mut Vec<usize>,
        out: &mut dyn FnMut(Term<'_>),
    ) -> Option<()> {
        let Some(seen) = &self.shots[i].spot else { return Some(()) };
        let at = self.layout.beam();
        self.own(i, columns, at..at + 4);
        let white = whitener(seen)? / self.noise.spot;
        let term = spot(s, &s.boards[i], &seen.pixel)?;
        let mut jacobian = Vec::new();
        if wants {
            let (camera, beam, board) = (white * term.by_camera, white * term.by_beam, white * term.by_board);
            for k in 0..2 {
                jacobian.extend(self.layout.camera.iter().map(|&c| camera[(k, c)]));
                jacobian.extend(beam.row(k).iter());
                jacobian.extend(board.row(k).iter());
            }
        }
        let r = white * term.e;
        out(Term { part: Some(Part::Spot), shot: i, residual: r.as_slice(), columns, jacobian: &jacobian });
        Some(())
    }

    fn robot(&self, s: &State, i: usize, columns: &mut Vec<usize>, out: &mut dyn FnMut(Term<'_>)) {
        let Some(Reported { pose, place }) = &self.shots[i].robot else { return };
        let l = link(self.mount, &s.near_from_camera, &s.far_from_board[*place], &s.boards[i], pose);
        columns.clear();
        for at in [self.layout.hand_eye(), self.layout.place(*place), self.layout.shot(i)] {
            columns.extend(at..at + 6);
        }
        for (part, from, sigma) in
            [(Part::RobotPlace, 0, self.noise.robot_mm), (Part::RobotTurn, 3, self.noise.robot_rad)]
        {
            let r = l.e.fixed_rows::<3>(from) / sigma;
            let mut jacobian = Vec::with_capacity(54);
            for k in from..from + 3 {
                for by in [&l.by_hand_eye, &l.by_place, &l.by_board] {
                    jacobian.extend(by.row(k).iter().map(|x| x / sigma));
                }
            }
            out(Term { part: Some(part), shot: i, residual: r.as_slice(), columns, jacobian: &jacobian });
        }
    }
}

impl Problem for Terms<'_> {
    type State = State;
    fn width(&self) -> usize {
        self.layout.width()
    }
    fn moved(&self, s: &State, step: &[f64]) -> State {
        s.moved(self.layout, step)
    }
    fn residuals(&self, s: &State, out: &mut Residuals) -> Option<()> {
        let wants = out.wants_jacobian();
        self.visit(s, wants, &mut |t| match t.part {
            Some(Part::Features | Part::Stripe | Part::Spot) => out.group(t.residual, t.columns, t.jacobian),
            _ => out.prior(t.residual, t.columns, t.jacobian),
        })
    }
    fn blocks(&self) -> Option<Blocks> {
        Some(Blocks { first: self.layout.shared(), size: 6 })
    }
}

/// The root of the prior's information over the free parameters. `None` if one of them has no uncertainty.
pub fn prior(given: &CameraPrior, camera_free: &[usize]) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let n = camera_free.len();
    let sigma = DVector::from_fn(n, |i, _| given.covariance[(camera_free[i], camera_free[i])].max(0.0).sqrt());
    if sigma.iter().any(|s| !(*s > 0.0)) {
        return None;
    }
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        given.covariance[(camera_free[i], camera_free[j])] / (sigma[i] * sigma[j]) + if i == j { 1e-12 } else { 0.0 }
    });
    let inverse = correlation.cholesky()?.inverse();
    let root = inverse.cholesky()?.l().transpose();
    let root = DMatrix::from_fn(n, n, |i, j| root[(i, j)] / sigma[j]);
    let mean = DVector::from_fn(n, |i, _| given.mean[camera_free[i]]);
    Some((mean, root))
}

/// The viewing ray (x, y, 1) of a pixel and its derivatives by the camera's parameters.
pub fn ray(camera: &Intrinsics, pixel: &Vec2) -> Option<(Vec3, SMatrix<f64, 2, PARAMETERS>)> {
    let n = camera.normalised_from_pixel(pixel)?;
    let ray = Vec3::new(n.x, n.y, 1.0);
    let at = project(camera, &ray)?;
    let back = at.by_point.fixed_columns::<2>(0).try_inverse()?;
    Some((ray, -(back * at.by_intrinsics)))
}
