//! In: spots of the pointer on boards of measured pose. Out: the beam as a line in the camera frame
//! by maximum likelihood, the boards' poses free within their own uncertainty.
//! Frame and unit: camera frame, mm; spots in px (docs/math.md, Pointer (3) to (5)).

use crate::calibrate::measured_pose::MeasuredPose;
use crate::calibrate::scatter::{beside, inflation};
use crate::camera::{Intrinsics, PARAMETERS, ParameterCovariance, Parameters, difference_step, named};
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Plane, Ray, Rigid, Twist, Vec2, Vec3};
use crate::solve::{LmOptions, Problem, Residuals, Stop, lm};
use nalgebra::{DMatrix, Matrix2, Matrix6, SMatrix};

/// One board with the pointer's spot on it.
#[derive(Clone, Debug)]
pub struct SpotView {
    /// The board before the camera, as the picture measured it.
    pub pose: MeasuredPose,
    /// The spot's centre, px.
    pub pixel: Vec2,
    /// px².
    pub covariance: Matrix2<f64>,
}

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct PointerOptions {
    /// A spot is wrong where its squared Mahalanobis distance (2 degrees of freedom), over what is usual among the others,
    /// exceeds this; 9..=1000.
    pub gate: f64,
    /// Spots nearer than this to the first line, in what a pixel covers there, are never left out of it; 0.5..=50.
    pub gate_px: f64,
    /// Fewest spots; 3..=1000.
    pub min_spots: usize,
    /// Spots must be spread along the beam at least this share of their distance; 0.01..=1.
    pub min_spread: f64,
}

impl Default for PointerOptions {
    fn default() -> Self {
        PointerOptions { gate: 20.0, gate_px: 2.0, min_spots: 4, min_spread: 0.05 }
    }
}

impl PointerOptions {
    /// Refuses values out of the ranges that the fields state.
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("gate", self.gate, 9.0, 1000.0),
            ("gate_px", self.gate_px, 0.5, 50.0),
            ("min_spots", self.min_spots as f64, 3.0, 1000.0),
            ("min_spread", self.min_spread, 0.01, 1.0),
        ];
        match ranges.iter().find(|(_, v, low, high)| !(low..=high).contains(&v)) {
            Some((name, v, low, high)) => {
                Err(Fault::usage(format!("{name} is {v}, {low} to {high} is allowed"))
                    .next("choose a value in that range"))
            }
            None => Ok(()),
        }
    }
}

/// How one spot fits.
#[derive(Clone, Debug)]
pub struct SpotResidual {
    /// Of the picture.
    pub name: String,
    /// In the fit; false: it disagreed and was left out.
    pub used: bool,
    /// Distance along the optical axis, mm.
    pub depth: f64,
    /// Distance of the spot from where the beam meets the board, px.
    pub px: f64,
    /// The same on the board, mm.
    pub mm: f64,
    /// `px` with the spot left out of the fit; infinite where the others determine nothing.
    pub holdout_px: f64,
    /// `mm` with the spot left out of the fit; infinite where the others determine nothing.
    pub holdout_mm: f64,
    /// Squared Mahalanobis distance, 2 degrees of freedom.
    pub distance2: f64,
    /// The same over what is usual among these spots, where that is more than chance.
    pub beside: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct PointerFit {
    /// The beam, mm.
    pub beam: Ray<Camera>,
    /// ox oy oz (mm) dx dy dz, then the camera's ([`crate::camera::NAMES`]). The beam was found with this
    /// camera, so their errors belong together.
    pub covariance: DMatrix<f64>,
    /// The beam's 6x6 with the camera taken as exact.
    pub covariance_camera_exact: DMatrix<f64>,
    /// One a view, in the order given.
    pub spots: Vec<SpotResidual>,
    /// sqrt of chi² over its degrees of freedom.
    pub sigma_ratio: f64,
    /// Nearest and farthest spot along the optical axis, mm.
    pub reach: [f64; 2],
}

#[derive(Clone)]
struct State {
    beam: Ray<Camera>,
    poses: Vec<Rigid<Camera, Board>>,
}

struct Fit<'a> {
    camera: &'a Intrinsics,
    views: &'a [&'a SpotView],
    /// Boards' poses for this camera.
    measured: Vec<Rigid<Camera, Board>>,
    roots: Vec<Matrix6<f64>>,
    whiteners: Vec<Matrix2<f64>>,
}

/// Two directions across the beam.
pub(in crate::calibrate) fn across(direction: &Vec3) -> [Vec3; 2] {
    let axis = if direction.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
    let a = direction.cross(&axis).normalize();
    [a, direction.cross(&a)]
}

/// A beam after a step: origin by two, direction by two, both across the beam.
pub fn moved_beam(beam: &Ray<Camera>, s: &[f64]) -> Ray<Camera> {
    let [a, b] = across(&beam.direction);
    Ray::new(beam.origin + a * s[0] + b * s[1], beam.direction + a * s[2] + b * s[3])
        .expect("a direction of length one")
}

/// Where the beam meets a board, and its pixel.
fn spot(camera: &Intrinsics, beam: &Ray<Camera>, pose: &Rigid<Camera, Board>) -> Option<(Vec3, Vec2)> {
    let normal: Vec3 = pose.rotation.column(2).into();
    let plane = Plane::<Camera>::new(normal, normal.dot(&pose.translation))?;
    // Boards may lie on either side of the origin that the beam is given by.
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
                // Central differences: a spot's pixel is smooth on the scale of mm and mrad.
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

fn refused(what: String) -> Fault {
    Fault::refused(what)
        .cause("too few spots, or spots too near to each other")
        .next("show the board to the pointer at four or more distances over the whole range that will be used")
}

/// A straight line through points, by total least squares.
fn line(points: &[Vec3]) -> Option<Ray<Camera>> {
    let c = points.iter().sum::<Vec3>() / points.len() as f64;
    let m = points.iter().map(|p| (p - c) * (p - c).transpose()).sum::<nalgebra::Matrix3<f64>>();
    let e = m.symmetric_eigen();
    let d: Vec3 = e.eigenvectors.column(e.eigenvalues.imax()).into();
    Ray::new(c, if d.z < 0.0 { -d } else { d })
}

type Solved = (State, DMatrix<f64>, f64);

fn fit(
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
    let found = lm(&problem, State { beam: *start, poses: measured }, &LmOptions::default());
    if found.stop == Stop::BadStart {
        return None;
    }
    // Groups alternate: spot, board.
    let cost = found.lengths.iter().map(|l| l * l).sum();
    Some((found.state, found.covariance?, cost))
}

/// Fits the beam. `feature_factor` makes the stated sigmas of the boards' features true
/// ([`crate::calibrate::measured_pose::pooled_factor`]), `camera_covariance` is that of the camera's parameters.
pub fn solve(
    views: &[SpotView],
    camera: &Intrinsics,
    camera_covariance: &ParameterCovariance,
    feature_factor: f64,
    o: &PointerOptions,
) -> Result<PointerFit> {
    o.check()?;
    if views.len() < o.min_spots {
        return Err(refused(format!("{} spots on boards, {} are needed", views.len(), o.min_spots)));
    }
    let points = views
        .iter()
        .map(|v| {
            let normal: Vec3 = v.pose.camera_from_board.rotation.column(2).into();
            let plane = Plane::<Camera>::new(normal, normal.dot(&v.pose.camera_from_board.translation))?;
            camera.ray_from_pixel(&v.pixel)?.meet(&plane)
        })
        .collect::<Option<Vec<Vec3>>>()
        .ok_or_else(|| refused("a spot's viewing ray does not meet its board".into()))?;
    // What a pixel covers at each spot, mm.
    let pixel_mm: Vec<f64> = points.iter().map(|p| o.gate_px * p.z / camera.fx.min(camera.fy)).collect();
    let start = robust_line(&points, &pixel_mm).ok_or_else(|| refused("the spots are all in one place".into()))?;
    // Total least squares in space weighs far spots wrongly; the fit in pixels starts from it.
    let none = Parameters::zeros();
    let mut used: Vec<usize> = near_line(&points, &pixel_mm, &start);
    let fit_to = |used: &[usize]| -> Result<(Solved, Vec<f64>, Vec<f64>)> {
        let chosen: Vec<&SpotView> = used.iter().map(|&i| &views[i]).collect();
        let s = fit(&chosen, camera, &none, &start, feature_factor)
            .ok_or_else(|| refused("the beam is not determined by these spots".into()))?;
        let distance = |i| distance2(&views[i], camera, &s, used.contains(&i), feature_factor);
        let distances: Vec<f64> = (0..views.len()).map(distance).collect();
        let beside = beside(&distances, |i| used.contains(&i));
        Ok((s, distances, beside))
    };
    for _ in 0..2 * views.len() {
        if used.len() < o.min_spots {
            return Err(refused(format!("only {} of {} spots lie on one line", used.len(), views.len())));
        }
        let (_, distances, beside) = fit_to(&used)?;
        // One at a time, judged by the beam of the others: a wrong spot pulls its neighbours out with it.
        let worst = used.iter().copied().max_by(|a, b| distances[*a].total_cmp(&distances[*b])).expect("not empty");
        if distances[worst] > o.gate && used.len() > o.min_spots {
            let rest: Vec<usize> = used.iter().copied().filter(|&i| i != worst).collect();
            if fit_to(&rest)?.2[worst] > o.gate {
                used = rest;
                continue;
            }
        }
        let next: Vec<usize> = (0..views.len()).filter(|i| used.contains(i) || beside[*i] <= o.gate).collect();
        if next == used {
            break;
        }
        used = next;
    }
    let (whole, distances, beside) = fit_to(&used)?;
    let chosen: Vec<&SpotView> = used.iter().map(|&i| &views[i]).collect();
    let along: Vec<f64> = used.iter().map(|&i| points[i].z).collect();
    let reach = [along.iter().copied().fold(f64::INFINITY, f64::min), along.iter().copied().fold(0.0, f64::max)];
    if reach[1] - reach[0] < o.min_spread * reach[1] {
        return Err(refused(format!(
            "the spots lie between {:.1} and {:.1} mm: {:.0} % of the distance, {:.0} % are needed",
            reach[0],
            reach[1],
            100.0 * (reach[1] - reach[0]) / reach[1],
            100.0 * o.min_spread
        )));
    }
    let (state, local, cost) = &whole;
    let freedom = (2 * used.len()) as f64 - 4.0;
    let sigma_ratio = (cost / freedom.max(1.0)).sqrt();
    let exact = {
        let j = basis(&state.beam);
        &j * local.view((0, 0), (4, 4)) * j.transpose() * inflation(sigma_ratio * sigma_ratio, freedom)
    };
    let by_camera = by_camera(&chosen, camera, state, &named(camera_covariance), feature_factor)
        .ok_or_else(|| refused("the beam is not determined by these spots".into()))?;
    let c = DMatrix::from_column_slice(PARAMETERS, PARAMETERS, camera_covariance.as_slice());
    let mut covariance = DMatrix::zeros(6 + PARAMETERS, 6 + PARAMETERS);
    covariance.view_mut((0, 0), (6, 6)).copy_from(&(&exact + &by_camera * &c * by_camera.transpose()));
    covariance.view_mut((0, 6), (6, PARAMETERS)).copy_from(&(&by_camera * &c));
    covariance.view_mut((6, 0), (PARAMETERS, 6)).copy_from(&(&c * by_camera.transpose()));
    covariance.view_mut((6, 6), (PARAMETERS, PARAMETERS)).copy_from(&c);
    let spots = (0..views.len())
        .map(|i| {
            let gap = |beam: &Ray<Camera>| {
                let pose = &views[i].pose.camera_from_board;
                spot(camera, beam, pose).map_or((f64::INFINITY, f64::INFINITY), |(p, q)| {
                    ((q - views[i].pixel).norm(), (p - points[i]).norm())
                })
            };
            let rest: Vec<&SpotView> = used.iter().filter(|&&k| k != i).map(|&k| &views[k]).collect();
            let without = fit(&rest, camera, &none, &state.beam, feature_factor);
            let (px, mm) = gap(&state.beam);
            let (holdout_px, holdout_mm) = without.map_or((f64::INFINITY, f64::INFINITY), |s| gap(&s.0.beam));
            SpotResidual {
                name: views[i].pose.name.clone(),
                used: used.contains(&i),
                depth: points[i].z,
                px,
                mm,
                holdout_px,
                holdout_mm,
                distance2: distances[i],
                beside: beside[i],
            }
        })
        .collect();
    Ok(PointerFit { beam: state.beam, covariance, covariance_camera_exact: exact, spots, sigma_ratio, reach })
}

/// The line through two of the points that most others are near to, refined on those.
pub(in crate::calibrate) fn robust_line(points: &[Vec3], gates: &[f64]) -> Option<Ray<Camera>> {
    let mut best: Option<(f64, Ray<Camera>)> = None;
    for (i, a) in points.iter().enumerate() {
        for b in &points[..i] {
            let Some(ray) = Ray::<Camera>::new(*a, b - a).filter(|_| (b - a).norm() > 2.0 * gates[i]) else { continue };
            let mut d: Vec<f64> = points.iter().map(|p| off(&ray, p)).collect();
            let middle = (points.len() / 2 + 1).min(points.len() - 1);
            let (_, &mut median, _) = d.select_nth_unstable_by(middle, f64::total_cmp);
            if best.as_ref().is_none_or(|b| median < b.0) {
                best = Some((median, ray));
            }
        }
    }
    let ray = best?.1;
    line(&near_line(points, gates, &ray).iter().map(|&i| points[i]).collect::<Vec<_>>())
}

fn off(ray: &Ray<Camera>, p: &Vec3) -> f64 {
    (p - ray.origin).cross(&ray.direction).norm()
}

fn near_line(points: &[Vec3], gates: &[f64], ray: &Ray<Camera>) -> Vec<usize> {
    let d: Vec<f64> = points.iter().map(|p| off(ray, p)).collect();
    let mut sorted = d.clone();
    sorted.sort_by(f64::total_cmp);
    let limit = 6.0 * sorted[points.len() / 2];
    (0..points.len()).filter(|&i| d[i] <= limit.max(gates[i])).collect()
}

fn distance2(view: &SpotView, camera: &Intrinsics, s: &Solved, used: bool, factor: f64) -> f64 {
    let (state, local, _) = s;
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

/// d(ox oy oz dx dy dz)/d(step of the beam).
pub(in crate::calibrate) fn basis(beam: &Ray<Camera>) -> DMatrix<f64> {
    let [a, b] = across(&beam.direction);
    let mut j = DMatrix::zeros(6, 4);
    for i in 0..3 {
        (j[(i, 0)], j[(i, 1)], j[(3 + i, 2)], j[(3 + i, 3)]) = (a[i], b[i], a[i], b[i]);
    }
    j
}

/// d(ox oy oz dx dy dz)/d(camera), by solving again with the camera a little different: the boards'
/// poses follow the camera, too. For the parameters that are uncertain.
fn by_camera(
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
            // All beams are compared where they cross one plane, square to the first.
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

/// Names of the beam's own six parameters; the camera's follow in the file.
pub const BEAM_NAMES: [&str; 6] = ["ox_mm", "oy_mm", "oz_mm", "dx", "dy", "dz"];
