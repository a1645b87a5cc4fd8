//! In: peaks and boards' poses at a state of the solve. Out: residuals, derivatives, and the information of each
//! picture about the plane with its board's pose eliminated.
//! Frame and unit: camera frame, mm; peaks in px (docs/math.md, Laser plane (1) to (5)).

use super::views::{StripePeak, StripeView};
use crate::camera::{Intrinsics, PARAMETERS, Parameters, difference_step};
use crate::geometry::{Board, Camera, Plane, Rigid, Twist, Vec2, Vec3};
use crate::solve::{End, LmOptions, Loss, Problem, Residuals, Solution, lm};
use nalgebra::{DMatrix, Matrix2, Matrix3, Matrix6, SMatrix};

/// A peak as the solver uses it.
#[derive(Clone, Copy)]
pub(in crate::calibrate) struct Seen {
    pub(in crate::calibrate) view: usize,
    pub(in crate::calibrate) index: usize,
    pub(in crate::calibrate) pixel: Vec2,
    /// Viewing ray (x, y, 1).
    pub(in crate::calibrate) ray: Vec3,
    /// d(ray x, y)/d(pixel).
    pub(in crate::calibrate) ray_by_pixel: Matrix2<f64>,
    pub(in crate::calibrate) sigma_px: f64,
}

pub(in crate::calibrate) fn look(camera: &Intrinsics, view: usize, index: usize, peak: &StripePeak) -> Option<Seen> {
    let n = camera.normalised_from_pixel(&peak.pixel)?;
    let k = Matrix2::new(camera.fx, camera.skew, 0.0, camera.fy);
    let ray_by_pixel = (k * camera.distort_jacobian(&n)).try_inverse()?;
    Some(Seen { view, index, pixel: peak.pixel, ray: Vec3::new(n.x, n.y, 1.0), ray_by_pixel, sigma_px: peak.sigma_px })
}

/// Intersection of a ray (x, y, 1) with a board, camera frame, mm.
pub(in crate::calibrate) fn on_board(pose: &Rigid<Camera, Board>, ray: &Vec3) -> Option<Vec3> {
    let normal: Vec3 = pose.rotation.column(2).into();
    let slope = normal.dot(ray);
    let depth = normal.dot(&pose.translation) / slope;
    (slope.abs() > 1e-6 && depth > 0.0).then(|| ray * depth)
}

/// Change of the distance from the plane per pixel across the stripe, mm/px.
pub(in crate::calibrate) fn mm_per_px(plane: &Plane<Camera>, pose: &Rigid<Camera, Board>, s: &Seen) -> f64 {
    let normal: Vec3 = pose.rotation.column(2).into();
    let slope = normal.dot(&s.ray);
    let depth = normal.dot(&pose.translation) / slope;
    let along = depth * (plane.normal - normal * (plane.normal.dot(&s.ray) / slope));
    (s.ray_by_pixel.transpose() * Vec2::new(along.x, along.y)).norm()
}

#[derive(Clone)]
pub(in crate::calibrate) struct State {
    pub(in crate::calibrate) plane: Plane<Camera>,
    pub(in crate::calibrate) poses: Vec<Rigid<Camera, Board>>,
}

pub(in crate::calibrate) struct Fit<'a> {
    pub(in crate::calibrate) peaks: &'a [Seen],
    /// Distance from the plane that corresponds to one sigma of a peak, mm.
    pub(in crate::calibrate) sigma_mm: Vec<f64>,
    pub(in crate::calibrate) measured: &'a [Rigid<Camera, Board>],
    /// Upper Cholesky factors of the poses' information matrices.
    pub(in crate::calibrate) roots: &'a [Matrix6<f64>],
}

/// Two orthogonal unit vectors in the plane.
pub(in crate::calibrate) fn tangents(normal: &Vec3) -> [Vec3; 2] {
    let axis = if normal.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
    let a = normal.cross(&axis).normalize();
    [a, normal.cross(&a)]
}

/// A peak's residual in sigmas and its derivatives by the plane's three parameters and the pose's six.
pub(in crate::calibrate) fn row(
    plane: &Plane<Camera>,
    pose: &Rigid<Camera, Board>,
    peak: &Seen,
    sigma_mm: f64,
) -> Option<(f64, [f64; 9])> {
    let [a, b] = tangents(&plane.normal);
    let p = on_board(pose, &peak.ray)?;
    let normal: Vec3 = pose.rotation.column(2).into();
    // depth = (n·t)/(n·d); a step (v, w) changes n·t by n·v and n by w × n.
    let along = plane.normal.dot(&peak.ray) / normal.dot(&peak.ray);
    let by_v = normal * along;
    let by_w = -normal.cross(&peak.ray) * (along * p.z);
    let j = [a.dot(&p), b.dot(&p), -1.0, by_v.x, by_v.y, by_v.z, by_w.x, by_w.y, by_w.z];
    Some((plane.distance(&p) / sigma_mm, j.map(|x| x / sigma_mm)))
}

impl Problem for Fit<'_> {
    type State = State;
    fn width(&self) -> usize {
        3 + 6 * self.measured.len()
    }
    fn moved(&self, s: &State, step: &[f64]) -> State {
        let [a, b] = tangents(&s.plane.normal);
        let normal = (s.plane.normal + a * step[0] + b * step[1]).normalize();
        State {
            plane: Plane::new(normal, s.plane.offset + step[2]).expect("a normal of length one"),
            poses: s.poses.iter().enumerate().map(|(i, p)| Twist::new(&step[3 + 6 * i..]).moved(p)).collect(),
        }
    }
    fn residuals(&self, s: &State, out: &mut Residuals) -> Option<()> {
        for (peak, sigma) in self.peaks.iter().zip(&self.sigma_mm) {
            let (r, j) = row(&s.plane, &s.poses[peak.view], peak, *sigma)?;
            let at = 3 + 6 * peak.view;
            out.group(&[r], &[0, 1, 2, at, at + 1, at + 2, at + 3, at + 4, at + 5], &j);
        }
        for (i, (measured, root)) in self.measured.iter().zip(self.roots).enumerate() {
            let e = root * Twist::between(measured, &s.poses[i]).vector();
            let columns: [usize; 6] = std::array::from_fn(|k| 3 + 6 * i + k);
            out.prior(e.as_slice(), &columns, root.transpose().as_slice());
        }
        Some(())
    }
}

/// The data of one solve: the measured poses and the selected peaks.
pub(in crate::calibrate) struct Data {
    pub(in crate::calibrate) peaks: Vec<Seen>,
    pub(in crate::calibrate) measured: Vec<Rigid<Camera, Board>>,
    pub(in crate::calibrate) roots: Vec<Matrix6<f64>>,
}

impl Data {
    /// `None` if the plane or a board cannot produce one of the peaks.
    pub(in crate::calibrate) fn solve(&self, start: &State, loss: Loss, factor: f64) -> Option<(Solution<State>, End)> {
        let fit = |state: &State| {
            let sigma_mm = self
                .peaks
                .iter()
                .map(|s| s.sigma_px * factor * mm_per_px(&state.plane, &state.poses[s.view], s))
                .collect();
            let fit = Fit { peaks: &self.peaks, sigma_mm, measured: &self.measured, roots: &self.roots };
            // A relative change of the cost of 1e-9 corresponds to 0.002 sigma from the minimum.
            let o = LmOptions { loss, estimate_scale: loss != Loss::Squares, tolerance: 1e-9, ..LmOptions::default() };
            lm(&fit, state.clone(), &o)
        };
        // The scale from mm to px depends on the plane: two rounds settle it.
        fit(&fit(start).so_far()?.state).ended()
    }
}

/// Residual of a peak divided by `factor` times its sigma.
pub(in crate::calibrate) fn ratio(p: &Seen, s: &State, factor: f64) -> f64 {
    let Some(x) = on_board(&s.poses[p.view], &p.ray) else { return f64::INFINITY };
    s.plane.distance(&x) / (mm_per_px(&s.plane, &s.poses[p.view], p) * p.sigma_px * factor)
}

/// d(nx ny nz offset)/d(two tilts, offset).
pub(in crate::calibrate) fn basis(plane: &Plane<Camera>) -> DMatrix<f64> {
    let [a, b] = tangents(&plane.normal);
    let mut j = DMatrix::zeros(4, 3);
    for i in 0..3 {
        (j[(i, 0)], j[(i, 1)]) = (a[i], b[i]);
    }
    j[(3, 2)] = 1.0;
    j
}

/// The information of one picture about the plane, its board's pose eliminated (docs/math.md, Laser plane (5)). A
/// stripe on a flat board is a straight line and determines the plane's distance at its two ends.
pub(in crate::calibrate) struct Says {
    /// d(distances at the stripe's ends)/d(two tilts, offset).
    pub(in crate::calibrate) by_plane: SMatrix<f64, 2, 3>,
    /// Information matrix and gradient of the two distances, 1/mm² and 1/mm.
    pub(in crate::calibrate) information: Matrix2<f64>,
    pub(in crate::calibrate) gradient: Vec2,
}

impl Says {
    /// The same for the plane's three parameters.
    pub(in crate::calibrate) fn of_plane(&self) -> (Matrix3<f64>, Vec3) {
        let j = self.by_plane.transpose();
        (j * self.information * self.by_plane, j * self.gradient)
    }
}

/// `None` if fewer than two positions of the board have peaks.
pub(in crate::calibrate) fn says(data: &Data, state: &State, view: usize, factor: f64) -> Option<Says> {
    let (plane, pose) = (&state.plane, &state.poses[view]);
    let board: Vec3 = pose.rotation.column(2).into();
    let along = plane.normal.cross(&board).try_normalize(1e-9)?;
    let seen: Vec<(&Seen, Vec3)> =
        data.peaks.iter().filter(|p| p.view == view).filter_map(|p| Some((p, on_board(pose, &p.ray)?))).collect();
    let order = |a: &&(&Seen, Vec3), b: &&(&Seen, Vec3)| along.dot(&a.1).total_cmp(&along.dot(&b.1));
    let ends = [seen.iter().min_by(order)?.1, seen.iter().max_by(order)?.1];
    let length = along.dot(&(ends[1] - ends[0]));
    if !(length > 0.0) {
        return None;
    }
    let (mut h, mut g) = (SMatrix::<f64, 8, 8>::zeros(), SMatrix::<f64, 8, 1>::zeros());
    for (p, at) in &seen {
        let sigma_mm = p.sigma_px * factor * mm_per_px(plane, pose, p);
        let (r, j) = row(plane, pose, p, sigma_mm)?;
        let t = along.dot(&(at - ends[0])) / length;
        let j = SMatrix::<f64, 8, 1>::from([(1.0 - t) / sigma_mm, t / sigma_mm, j[3], j[4], j[5], j[6], j[7], j[8]]);
        h += j * j.transpose();
        g += j * r;
    }
    let root = &data.roots[view];
    let prior = root.transpose() * root;
    let local = h.fixed_view::<6, 6>(2, 2) + prior;
    let rest = g.fixed_view::<6, 1>(2, 0) + prior * Twist::between(&data.measured[view], pose).vector();
    let mixed = h.fixed_view::<2, 6>(0, 2) * local.try_inverse()?;
    let [a, b] = tangents(&plane.normal);
    let row = |p: &Vec3| [a.dot(p), b.dot(p), -1.0];
    let [first, last] = ends.map(|p| row(&p));
    Some(Says {
        by_plane: SMatrix::from_fn(|i, k| if i == 0 { first[k] } else { last[k] }),
        information: h.fixed_view::<2, 2>(0, 0) - mixed * h.fixed_view::<6, 2>(2, 0),
        gradient: g.fixed_view::<2, 1>(0, 0) - mixed * rest,
    })
}

/// The plane after a step of its two tilts and its offset.
pub(in crate::calibrate) fn stepped(plane: &Plane<Camera>, step: &Vec3) -> Option<Plane<Camera>> {
    let [a, b] = tangents(&plane.normal);
    Plane::new((plane.normal + a * step.x + b * step.y).normalize(), plane.offset + step.z)
}

/// Derivatives of a fit by the camera's parameters ([`crate::camera::NAMES`]); zero for parameters that are certain.
pub(in crate::calibrate) struct ByCamera {
    /// Of the plane's two tilts and its offset.
    pub(in crate::calibrate) plane: SMatrix<f64, 3, PARAMETERS>,
    /// Of each picture's gradient ([`Says::gradient`]) at the fitted plane; `None` for a picture without peaks.
    pub(in crate::calibrate) gradients: Vec<Option<SMatrix<f64, 2, PARAMETERS>>>,
}

/// Derivatives by the uncertain parameters, through the peaks' rays and the boards' poses, by the implicit function
/// theorem.
pub(in crate::calibrate) fn by_camera(
    data: &Data,
    state: &State,
    views: &[StripeView],
    camera: &Intrinsics,
    uncertain: &[usize],
    factor: f64,
) -> Option<ByCamera> {
    let said: Vec<Option<Says>> = (0..views.len()).map(|v| says(data, state, v, factor)).collect();
    let information: Matrix3<f64> = said.iter().flatten().map(|s| s.of_plane().0).sum();
    let inverse = information.try_inverse()?;
    let mut gradients: Vec<_> =
        said.iter().map(|s| s.as_ref().map(|_| SMatrix::<f64, 2, PARAMETERS>::zeros())).collect();
    let mut plane = SMatrix::<f64, 3, PARAMETERS>::zeros();
    for &k in uncertain {
        let h = difference_step(k);
        for sign in [1.0, -1.0] {
            let mut d = Parameters::zeros();
            d[k] = sign * h;
            let other = camera.changed(&d);
            let peaks = data.peaks.iter().map(|p| look(&other, p.view, p.index, &views[p.view].peaks[p.index]));
            let follow = |(v, p): (&StripeView, _)| Twist::new((v.pose.by_intrinsics * d).as_slice()).moved(p);
            let changed = Data {
                peaks: peaks.collect::<Option<_>>()?,
                measured: views.iter().zip(&data.measured).map(follow).collect(),
                roots: data.roots.clone(),
            };
            for (v, by) in gradients.iter_mut().enumerate() {
                let Some(by) = by else { continue };
                let slope = sign / (2.0 * h);
                let there = says(&changed, state, v, factor)?;
                let mut column = by.column_mut(k);
                column += there.gradient * slope;
                let step = -(inverse * there.of_plane().1) * slope;
                let mut column = plane.column_mut(k);
                column += step;
            }
        }
    }
    Some(ByCamera { plane, gradients })
}
