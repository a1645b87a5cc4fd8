//! In: stripe peaks on boards of measured pose. Out: the laser plane by robust maximum likelihood,
//! the boards' poses free within their own uncertainty, with covariance and hold-out errors.
//! Frame and unit: camera frame, mm; peaks in px (docs/math.md, Laser plane (1) to (6)).

use super::board_print::{inside, to_print_edge};
use super::laser_plane_terms::{
    Data, Seen, State, basis, by_camera, look, mm_per_px, on_board, ratio, strain, tangents, without,
};
use super::measured_pose::MeasuredPose;
use crate::camera::{Intrinsics, PARAMETERS, ParameterCovariance, named};
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Plane, Rigid, Vec2, Vec3, fit_plane};
use crate::recording::BoardSpec;
use crate::solve::{ConsensusOptions, Loss, consensus};
use nalgebra::{DMatrix, Matrix3, Matrix6};

/// One place where the stripe was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripePeak {
    /// px.
    pub pixel: Vec2,
    /// Standard deviation across the stripe, px.
    pub sigma_px: f64,
    /// Standard deviation of the stripe's own profile, px.
    pub width_px: f64,
}

/// One board with the stripe on it.
#[derive(Clone, Debug)]
pub struct StripeView {
    pub pose: MeasuredPose,
    pub board: BoardSpec,
    pub peaks: Vec<StripePeak>,
}

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct LaserPlaneOptions {
    /// Peaks nearer to an edge of the print or the board than this many stripe widths are not used; 0..=20.
    pub edge_widths: f64,
    /// Peaks farther than this from the plane that most agree with never enter, mm; 0.01..=10.
    pub gate_mm: f64,
    /// Peaks with a larger residual than this many sigmas are left out; 2.5..=10.
    pub gate_sigmas: f64,
    /// A picture whose squared pose strain (two degrees of freedom) exceeds this is left out; 9..=1000.
    pub gate_strain: f64,
    /// Share of a picture's peaks that must agree for it to count; 0.1..=0.95.
    pub min_share: f64,
    /// Fewest peaks a picture needs; 2..=10000.
    pub min_peaks: usize,
    /// Seed of the consensus.
    pub seed: u64,
}

impl Default for LaserPlaneOptions {
    fn default() -> Self {
        LaserPlaneOptions {
            edge_widths: 2.5,
            gate_mm: 0.5,
            gate_sigmas: 4.0,
            gate_strain: 25.0,
            min_share: 0.6,
            min_peaks: 10,
            seed: 1,
        }
    }
}

impl LaserPlaneOptions {
    pub fn check(&self) -> Result<()> {
        let ranges = [
            ("edge_widths", self.edge_widths, 0.0, 20.0),
            ("gate_mm", self.gate_mm, 0.01, 10.0),
            ("gate_sigmas", self.gate_sigmas, 2.5, 10.0),
            ("gate_strain", self.gate_strain, 9.0, 1000.0),
            ("min_share", self.min_share, 0.1, 0.95),
            ("min_peaks", self.min_peaks as f64, 2.0, 10000.0),
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

/// Why a peak does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PeakUse {
    Used,
    /// Not on the board: dots, halos, the background, reflections beside it.
    OffBoard,
    /// Near an edge of the print.
    AtEdge,
    /// On the board, but off the plane: a reflection.
    Disagrees,
    /// Its whole picture was left out.
    PictureLeftOut,
}

/// How one picture fits.
#[derive(Clone, Debug)]
pub struct ViewResidual {
    pub name: String,
    pub used: bool,
    pub peaks: usize,
    pub peaks_used: usize,
    /// rms of the used peaks' distance from the fitted stripe, px and mm.
    pub px: f64,
    pub mm: f64,
    /// The same against the plane fitted without this picture.
    pub holdout_px: f64,
    pub holdout_mm: f64,
    /// Squared strain of the board's pose in units of its own uncertainty.
    pub strain: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct LaserPlaneFit {
    pub plane: Plane<Camera>,
    /// nx ny nz offset_mm, rank 3, camera uncertainty included.
    pub covariance: DMatrix<f64>,
    pub covariance_camera_exact: DMatrix<f64>,
    pub views: Vec<ViewResidual>,
    /// One a peak, by view.
    pub uses: Vec<Vec<PeakUse>>,
    /// Peaks' residuals over their stated sigma: 1 where the sigmas are right.
    pub sigma_ratio: f64,
    /// Neighbouring peaks share speckle: variance counts this often; 1 where they are independent.
    pub neighbour_factor: f64,
    /// Largest angle between two boards' normals, rad.
    pub board_spread: f64,
    /// Least and largest depth of a used peak, mm.
    pub reach: [f64; 2],
    /// Spread of the stripes across their own direction, mm (rms): what holds the plane's tilt.
    pub depth_spread: f64,
}

fn refused(what: String) -> Fault {
    Fault::refused(what)
        .cause("the boards were too few, too alike, or hardly lit by the laser")
        .next("show the board at five or more distances and tilts, the stripe right across it")
}

/// Fits the laser plane. `feature_factor` makes the stated sigmas of the boards' features true
/// ([`super::measured_pose::pooled_factor`]),
/// `camera_covariance` that of the camera's parameters.
pub fn solve(
    views: &[StripeView],
    camera: &Intrinsics,
    camera_covariance: &ParameterCovariance,
    feature_factor: f64,
    o: &LaserPlaneOptions,
) -> Result<LaserPlaneFit> {
    o.check()?;
    let mut uses: Vec<Vec<PeakUse>> = views.iter().map(|v| vec![PeakUse::OffBoard; v.peaks.len()]).collect();
    let mut peaks = select(views, camera, o, &mut uses);
    if views.len() < 2 || peaks.len() < 3 {
        return Err(refused(format!(
            "{} pictures with {} stripe peaks on their boards: at least 2 pictures and 3 peaks are needed",
            views.len(),
            peaks.len()
        )));
    }
    let mut data = Data {
        peaks: Vec::new(),
        measured: views.iter().map(|v| v.pose.camera_from_board).collect(),
        roots: views.iter().map(|v| root(&v.pose, feature_factor)).collect::<Result<_>>()?,
    };
    let first = majority(&peaks, &data.measured, o)?;
    let mut used = vec![true; views.len()];
    let all = peaks.clone();
    peaks.retain(|p| near(p, &first, &data.measured, o.gate_mm));
    leave_out_disagreeing(&all, &peaks, &mut used, o);
    data.peaks = peaks.into_iter().filter(|p| used[p.view]).collect();
    let mut state = State { plane: first, poses: data.measured.clone() };
    let (mut factor, mut neighbours, mut sigma_ratio) = (1.0, 1.0, 1.0);
    let mut solution = None;
    for round in 0..views.len() + 3 {
        if data.peaks.len() < 3 || used.iter().filter(|u| **u).count() < 2 {
            return Err(refused("fewer than two pictures agree on one laser plane".into()));
        }
        if round == 0 {
            state = data.solve(&state, Loss::Cauchy(2.4), factor).state;
            let scale = robust_ratio(&data, &state, factor).max(0.2);
            data.peaks = all
                .iter()
                .filter(|p| used[p.view] && ratio(p, &state, 1.0).abs() < o.gate_sigmas * scale)
                .copied()
                .collect();
        }
        let s = data.solve(&state, Loss::Squares, factor);
        state = s.state.clone();
        let ratios: Vec<f64> = data.peaks.iter().map(|p| ratio(p, &state, 1.0)).collect();
        sigma_ratio = (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt();
        neighbours = neighbour_factor(&data.peaks, &ratios, views);
        let next = sigma_ratio.max(1e-3) * neighbours.sqrt();
        let settled = (next / factor - 1.0).abs() < 0.01;
        factor = next;
        let worst = (0..views.len())
            .filter(|&i| used[i])
            .map(|i| (i, strain(&data, &state, i)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        solution = Some(s);
        match worst {
            Some((i, strain)) if strain > o.gate_strain && used.iter().filter(|u| **u).count() > 3 => {
                used[i] = false;
                data.peaks.retain(|p| p.view != i);
            }
            _ if settled => break,
            _ => {}
        }
    }
    let solution = solution.expect("at least one round");
    let local = solution
        .covariance
        .as_ref()
        .ok_or_else(|| refused("the laser plane is not determined by these stripes".into()))?
        .view((0, 0), (3, 3))
        .into_owned();
    for p in &all {
        uses[p.view][p.index] = if used[p.view] { PeakUse::Disagrees } else { PeakUse::PictureLeftOut };
    }
    for p in &data.peaks {
        uses[p.view][p.index] = PeakUse::Used;
    }
    let by_camera = by_camera(&data, &state, views, camera, &named(camera_covariance), factor)
        .ok_or_else(|| refused("the laser plane is not determined by these stripes".into()))?;
    let c = DMatrix::from_column_slice(PARAMETERS, PARAMETERS, camera_covariance.as_slice());
    let basis = basis(&state.plane);
    let exact = &basis * &local * basis.transpose();
    let covariance = &exact + &by_camera * c * by_camera.transpose();
    Ok(LaserPlaneFit {
        plane: state.plane,
        covariance,
        covariance_camera_exact: exact,
        views: residuals(&data, &state, views, &used, factor, &all, o),
        uses,
        sigma_ratio,
        neighbour_factor: neighbours,
        board_spread: board_spread(views, &used),
        reach: reach(&data, &state),
        depth_spread: depth_spread(&data, &state),
    })
}

/// Peaks on the boards and away from the print's edges.
fn select(views: &[StripeView], camera: &Intrinsics, o: &LaserPlaneOptions, uses: &mut [Vec<PeakUse>]) -> Vec<Seen> {
    let mut out = Vec::new();
    for (v, view) in views.iter().enumerate() {
        let board_from_camera = view.pose.camera_from_board.inverse();
        for (i, peak) in view.peaks.iter().enumerate() {
            if !(peak.sigma_px > 0.0 && peak.sigma_px.is_finite()) {
                continue;
            }
            let Some(seen) = look(camera, v, i, peak) else { continue };
            let Some(p) = on_board(&view.pose.camera_from_board, &seen.ray) else { continue };
            let q = board_from_camera.point(&p);
            let margin = o.edge_widths * peak.width_px * p.z / camera.fx.min(camera.fy);
            if inside(&view.board, q.x, q.y) < margin {
                continue;
            }
            if to_print_edge(&view.board, q.x, q.y) < margin {
                uses[v][i] = PeakUse::AtEdge;
                continue;
            }
            out.push(seen);
        }
    }
    out
}

fn root(pose: &MeasuredPose, sigma_px: f64) -> Result<Matrix6<f64>> {
    (pose.information / (sigma_px * sigma_px))
        .cholesky()
        .map(|c| c.l().transpose())
        .ok_or_else(|| refused(format!("{}: the board's pose is not determined", pose.name)))
}

/// The plane that most peaks lie on: consensus over triples from different pictures.
fn majority(peaks: &[Seen], measured: &[Rigid<Camera, Board>], o: &LaserPlaneOptions) -> Result<Plane<Camera>> {
    let points: Vec<Vec3> = peaks.iter().map(|s| on_board(&measured[s.view], &s.ray).expect("selected")).collect();
    let options = ConsensusOptions { threshold: o.gate_mm, max_draws: 20000, seed: o.seed, ..Default::default() };
    let found = consensus(
        points.len(),
        3,
        &options,
        |c| {
            let views = [peaks[c[0]].view, peaks[c[1]].view, peaks[c[2]].view];
            if views[0] == views[1] && views[1] == views[2] {
                return None;
            }
            let normal = (points[c[1]] - points[c[0]]).cross(&(points[c[2]] - points[c[0]]));
            let plane = Plane::<Camera>::new(normal, normal.dot(&points[c[0]]))?;
            (normal.norm() > 1.0).then_some(plane)
        },
        |plane, i| plane.distance(&points[i]),
    )
    .ok_or_else(|| refused("no plane goes through the stripes of several pictures".into()))?;
    let agreeing: Vec<Vec3> = found.inliers.iter().map(|&i| points[i]).collect();
    let plane = fit_plane::<Camera>(&agreeing)
        .ok_or_else(|| refused("the stripes of all pictures lie on one line in space".into()))?
        .0;
    // The normal points away from the camera, as the format's examples do.
    Ok(if plane.offset < 0.0 { plane.flipped() } else { plane })
}

fn near(p: &Seen, plane: &Plane<Camera>, measured: &[Rigid<Camera, Board>], gate: f64) -> bool {
    on_board(&measured[p.view], &p.ray).is_some_and(|x| plane.distance(&x).abs() < gate)
}

fn leave_out_disagreeing(all: &[Seen], near: &[Seen], used: &mut [bool], o: &LaserPlaneOptions) {
    for (v, used) in used.iter_mut().enumerate() {
        let (n, k) = (all.iter().filter(|p| p.view == v).count(), near.iter().filter(|p| p.view == v).count());
        *used = k >= o.min_peaks && k as f64 >= o.min_share * n as f64;
    }
}

fn robust_ratio(data: &Data, s: &State, factor: f64) -> f64 {
    let mut r: Vec<f64> = data.peaks.iter().map(|p| ratio(p, s, factor).abs()).collect();
    crate::solve::robust_scale(&mut r, 1)
}

/// 1 + 2 Σ ρₖ over the lags along the stripe whose correlation stands out of the noise.
fn neighbour_factor(peaks: &[Seen], ratios: &[f64], views: &[StripeView]) -> f64 {
    let variance = ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64;
    let mut factor = 1.0;
    for lag in 1..=8usize {
        let (mut sum, mut n) = (0.0, 0.0);
        for i in lag..peaks.len() {
            let (a, b) = (&peaks[i - lag], &peaks[i]);
            if a.view != b.view {
                continue;
            }
            let at = |p: &Seen| views[p.view].peaks[p.index].pixel;
            if (at(b) - at(a)).norm() < 1.6 * lag as f64 {
                sum += ratios[i - lag] * ratios[i];
                n += 1.0;
            }
        }
        let rho = if n > 20.0 { sum / n / variance } else { 0.0 };
        if rho < 2.5 / f64::max(n, 1.0).sqrt() {
            break;
        }
        factor += 2.0 * rho;
    }
    factor
}

fn residuals(
    data: &Data,
    state: &State,
    views: &[StripeView],
    used: &[bool],
    factor: f64,
    all: &[Seen],
    o: &LaserPlaneOptions,
) -> Vec<ViewResidual> {
    let rms = |peaks: &[&Seen], plane: &Plane<Camera>, pose: &Rigid<Camera, Board>| -> (f64, f64) {
        let (mut px, mut mm) = (0.0, 0.0);
        for p in peaks {
            let Some(x) = on_board(pose, &p.ray) else { continue };
            let d = plane.distance(&x);
            mm += d * d;
            px += (d / mm_per_px(plane, pose, p)).powi(2);
        }
        let n = f64::max(peaks.len() as f64, 1.0);
        ((px / n).sqrt(), (mm / n).sqrt())
    };
    (0..views.len())
        .map(|v| {
            let used_here: Vec<&Seen> = data.peaks.iter().filter(|p| p.view == v).collect();
            // A picture that was left out is shown with the peaks that it would have brought.
            let shown: Vec<&Seen> =
                if used[v] { used_here.clone() } else { all.iter().filter(|p| p.view == v).collect() };
            let (px, mm) = rms(&shown, &state.plane, &state.poses[v]);
            let (holdout_px, holdout_mm) = without(data, state, v, factor)
                .map_or((f64::INFINITY, f64::INFINITY), |plane| rms(&shown, &plane, &data.measured[v]));
            ViewResidual {
                name: views[v].pose.name.clone(),
                used: used[v] && used_here.len() >= o.min_peaks.min(3),
                peaks: views[v].peaks.len(),
                peaks_used: if used[v] { used_here.len() } else { 0 },
                px,
                mm,
                holdout_px,
                holdout_mm,
                strain: strain(data, state, v),
            }
        })
        .collect()
}

fn board_spread(views: &[StripeView], used: &[bool]) -> f64 {
    let normals: Vec<Vec3> = (0..views.len())
        .filter(|&i| used[i])
        .map(|i| views[i].pose.camera_from_board.rotation.column(2).into())
        .collect();
    let angle = |a: &Vec3, b: &Vec3| a.cross(b).norm().atan2(a.dot(b));
    normals
        .iter()
        .enumerate()
        .flat_map(|(i, a)| normals[..i].iter().map(move |b| (a, b)))
        .fold(0.0, |m, (a, b)| f64::max(m, angle(a, b)))
}

fn reach(data: &Data, s: &State) -> [f64; 2] {
    let depths = data.peaks.iter().filter_map(|p| Some(on_board(&s.poses[p.view], &p.ray)?.z));
    depths.fold([f64::INFINITY, 0.0], |[low, high], z| [low.min(z), high.max(z)])
}

/// rms spread of the points in their second principal direction, mm.
fn depth_spread(data: &Data, s: &State) -> f64 {
    let points: Vec<Vec3> = data.peaks.iter().filter_map(|p| on_board(&s.poses[p.view], &p.ray)).collect();
    let n = f64::max(points.len() as f64, 1.0);
    let c = points.iter().sum::<Vec3>() / n;
    let m = points.iter().map(|p| (p - c) * (p - c).transpose()).sum::<Matrix3<f64>>() / n;
    let mut e: Vec<f64> = m.symmetric_eigenvalues().iter().copied().collect();
    e.sort_by(f64::total_cmp);
    e[1].max(0.0).sqrt()
}

/// Sigma of the distance between the fitted and the true plane, rms over a field of view of
/// ±0.4 rad across at distances `near..=far` along the optical axis, mm.
pub fn expected_error(plane: &Plane<Camera>, covariance: &DMatrix<f64>, near: f64, far: f64) -> f64 {
    let [a, b] = tangents(&plane.normal);
    // In the plane: across = the direction with the least z, along = the other.
    let across = (a * b.z - b * a.z).normalize();
    let along = plane.normal.cross(&across);
    let mut sum = 0.0;
    let mut n = 0.0;
    for i in 0..=10 {
        let z = near + (far - near) * f64::from(i) / 10.0;
        let middle = {
            let foot = plane.normal * plane.offset;
            let k = if along.z.abs() > 1e-6 { (z - foot.z) / along.z } else { 0.0 };
            foot + along * k
        };
        for k in -4..=4 {
            let p = middle + across * (z * 0.1 * f64::from(k)) - across * across.dot(&middle);
            let u = nalgebra::DVector::from_vec(vec![p.x, p.y, p.z, -1.0]);
            sum += (covariance * &u).dot(&u).max(0.0);
            n += 1.0;
        }
    }
    f64::sqrt(sum / n)
}
