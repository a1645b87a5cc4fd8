//! In: boards at stops, a motion. Out: the board that the motion expects at each stop with its derivatives by the
//! unknowns, the least-squares fit, and its derivatives by the camera's parameters.
//! Frame and unit: camera frame; position of the board's middle, mm, and its rotation, rad (docs/math.md, Axis (1) to
//! (4)).

use super::fit::Stop;
use crate::calibrate::measured_pose::ByIntrinsics;
use crate::geometry::{Axis, AxisKind, Board, Camera, CountUnit, Mat3, Riding, Rigid, Vec3, exp, log, skew};
use crate::solve::{End, LmOptions, Problem, Residuals, lm};
use nalgebra::{DMatrix, Matrix6, Vector6};

/// The axis' own scatter from stop to stop: standard deviations per axis of the board's middle, mm, and of its
/// rotation, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scatter {
    pub mm: f64,
    pub rad: f64,
}

impl Scatter {
    pub fn covariance(&self) -> Matrix6<f64> {
        let (p, r) = (self.mm * self.mm, self.rad * self.rad);
        Matrix6::from_diagonal(&Vector6::new(p, p, p, r, r, r))
    }
}

/// A board at a stop, as a measurement of the position of its middle and of its rotation.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub count: f64,
    pub place: Vec3,
    pub turn: Mat3,
    /// Covariance of (place, turn) by the pixels; mm, rad.
    pub covariance: Matrix6<f64>,
    pub by_intrinsics: ByIntrinsics,
    /// The board's middle in the board frame, and the distance of its corners from it, mm.
    pub middle: Vec3,
    pub arm: f64,
}

impl Seen {
    /// `factor` corrects the features' stated sigmas. `None` for a pose that the pixels do not determine.
    pub fn new(stop: &Stop, factor: f64) -> Option<Seen> {
        let pose = &stop.pose;
        let place = pose.centre();
        // From a step about the camera's centre to a step about the board's middle.
        let mut to = Matrix6::identity();
        to.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&place));
        let covariance = to * pose.covariance(pose.factor_among(factor)) * to.transpose();
        let arm = pose.landmarks.iter().map(|l| (l - pose.landmarks[4]).norm()).fold(0.0, f64::max);
        covariance.iter().all(|x| x.is_finite()).then(|| Seen {
            count: stop.count,
            place,
            turn: pose.camera_from_board.rotation,
            covariance: (covariance + covariance.transpose()) * 0.5,
            by_intrinsics: to * pose.by_intrinsics,
            middle: pose.landmarks[4],
            arm,
        })
    }
}

/// A motion, and the board at count 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub kind: AxisKind,
    /// Linear: travel per count as a vector, mm. Turntable: direction of the axis, of unit length.
    pub along: Vec3,
    /// Rotation per count, rad; turntable only.
    pub pitch: f64,
    /// A point on the turntable's axis, mm.
    pub point: Vec3,
    pub place: Vec3,
    pub turn: Mat3,
    pub middle: Vec3,
}

/// Two unit vectors perpendicular to `d` and to each other.
pub(super) fn across(d: &Vec3) -> [Vec3; 2] {
    let a = d.cross(&if d.x.abs() < 0.8 { Vec3::x() } else { Vec3::y() }).normalize();
    [a, d.cross(&a)]
}

impl State {
    /// Expected position and rotation of the board at a count.
    pub fn expected(&self, count: f64) -> (Vec3, Mat3) {
        match self.kind {
            AxisKind::Linear => (self.place + self.along * count, self.turn),
            AxisKind::Turntable => {
                let r = exp(&(self.along * (self.pitch * count)));
                (self.point + r * (self.place - self.point), r * self.turn)
            }
        }
    }
    /// Step from the expected board to the seen one.
    pub fn off(&self, s: &Seen) -> Vector6<f64> {
        let (place, turn) = self.expected(s.count);
        let (p, w) = (s.place - place, log(&(s.turn * turn.transpose())));
        Vector6::new(p.x, p.y, p.z, w.x, w.y, w.z)
    }
    pub fn width(&self) -> usize {
        if self.kind == AxisKind::Linear { 9 } else { 11 }
    }
    /// d(expected position and rotation)/d(unknowns). The unknowns of the motion come first: linear 3; turntable 2 of
    /// the direction, 2 of the point and the pitch. Then follow 3 of the position and 3 of the rotation at count 0.
    pub fn jacobian(&self, count: f64) -> DMatrix<f64> {
        let n = self.width();
        let mut j = DMatrix::zeros(6, n);
        if self.kind == AxisKind::Linear {
            j.view_mut((0, 0), (3, 3)).fill_diagonal(count);
            j.view_mut((0, 3), (6, 6)).fill_diagonal(1.0);
            return j;
        }
        let (place, _) = self.expected(count);
        let (d, by, arm) = (self.along, self.pitch * count, place - self.point);
        let r = exp(&(d * by));
        let mut put = |k: usize, p: Vec3, w: Vec3| {
            j.view_mut((0, k), (3, 1)).copy_from(&p);
            j.view_mut((3, k), (3, 1)).copy_from(&w);
        };
        for (k, t) in across(&d).into_iter().enumerate() {
            // The rotation group's left Jacobian for a step perpendicular to the axis.
            let w = t * by.sin() + d.cross(&t) * (1.0 - by.cos());
            put(k, w.cross(&arm), w);
            put(2 + k, t - r * t, Vec3::zeros());
        }
        put(4, d.cross(&arm) * count, d * count);
        j.view_mut((0, 5), (3, 3)).copy_from(&r);
        j.view_mut((3, 8), (3, 3)).copy_from(&r);
        j
    }
    pub fn moved(&self, s: &[f64]) -> State {
        let v = |k: usize| Vec3::new(s[k], s[k + 1], s[k + 2]);
        let mut next = *self;
        let n = self.width();
        if self.kind == AxisKind::Linear {
            next.along += v(0);
        } else {
            let [a, b] = across(&self.along);
            next.along = (self.along + a * s[0] + b * s[1]).normalize();
            next.point += a * s[2] + b * s[3];
            next.pitch += s[4];
        }
        next.place += v(n - 6);
        next.turn = exp(&v(n - 3)) * self.turn;
        next
    }
    /// Pose of the board at count 0.
    pub fn board(&self) -> Rigid<Camera, Board> {
        Rigid::new(self.turn, self.place - self.turn * self.middle)
    }
    pub fn axis(&self, unit: CountUnit) -> Axis {
        let (direction, pitch) = match self.kind {
            AxisKind::Linear => (self.along.normalize(), self.along.norm()),
            AxisKind::Turntable => (self.along, self.pitch),
        };
        Axis::from_board(&Riding { kind: self.kind, unit, direction, point: self.point, pitch }, &self.board())
    }
    /// d(dx dy dz pitch px py pz)/d(unknowns).
    pub fn to_parameters(self, axis: &Axis) -> DMatrix<f64> {
        let d = axis.direction();
        if self.kind == AxisKind::Linear {
            let k = axis.pitch;
            return DMatrix::from_fn(4, self.width(), |i, c| match (i, c) {
                (_, 3..) => 0.0,
                (3, c) => d[c],
                (i, c) => (if i == c { 1.0 } else { 0.0 } - d[i] * d[c]) / k,
            });
        }
        // The axis may point in the opposite direction: direction and pitch then change sign together.
        let sign = d.dot(&self.along).signum();
        let far = self.along.dot(&(axis.origin() - self.point));
        let t = across(&self.along);
        DMatrix::from_fn(7, self.width(), |i, c| match (i, c) {
            (0..=2, 0..=1) => sign * t[c][i],
            (3, 4) => sign,
            (4.., 0..=1) => far * t[c][i - 4],
            (4.., 2..=3) => t[c - 2][i - 4],
            _ => 0.0,
        })
    }
}

/// A fit with its covariance and its remaining cost.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub state: State,
    /// Covariance of the unknowns.
    pub covariance: DMatrix<f64>,
    pub cost: f64,
    /// Whether it is a minimum.
    pub end: End,
}

struct Stops<'a> {
    seen: &'a [&'a Seen],
    roots: Vec<Matrix6<f64>>,
    width: usize,
}

/// Information matrix of a stop: pixel noise plus the axis' own scatter.
pub(super) fn information(s: &Seen, scatter: &Scatter) -> Option<Matrix6<f64>> {
    Some((s.covariance + scatter.covariance()).cholesky()?.inverse())
}

impl Problem for Stops<'_> {
    type State = State;
    fn width(&self) -> usize {
        self.width
    }
    fn moved(&self, state: &State, step: &[f64]) -> State {
        state.moved(step)
    }
    fn residuals(&self, state: &State, out: &mut Residuals) -> Option<()> {
        let columns: Vec<usize> = (0..state.width()).collect();
        for (s, root) in self.seen.iter().zip(&self.roots) {
            let r = root * state.off(s);
            let j = -(root * state.jacobian(s.count));
            out.group(r.as_slice(), &columns, j.transpose().as_slice());
        }
        Some(())
    }
}

/// Least squares over these stops; `None` if they do not determine the axis.
pub(super) fn fitted(seen: &[&Seen], start: &State, scatter: &Scatter) -> Option<Fit> {
    let roots =
        seen.iter().map(|s| Some(information(s, scatter)?.cholesky()?.l().transpose())).collect::<Option<Vec<_>>>()?;
    let problem = Stops { seen, roots, width: start.width() };
    let (found, end) = lm(&problem, *start, &LmOptions { max_iterations: 60, ..LmOptions::default() }).ended()?;
    let cost = found.lengths.iter().map(|l| l * l).sum();
    Some(Fit { covariance: found.covariance?, state: found.state, cost, end })
}

/// d(unknowns)/d(camera's parameters): all boards are seen with the same camera.
pub(super) fn by_camera(seen: &[&Seen], fit: &Fit, scatter: &Scatter) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(fit.state.width(), crate::camera::PARAMETERS);
    for s in seen {
        if let Some(w) = information(s, scatter) {
            sum += fit.state.jacobian(s.count).transpose() * w * s.by_intrinsics;
        }
    }
    &fit.covariance * sum
}
