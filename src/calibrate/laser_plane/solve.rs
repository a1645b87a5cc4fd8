//! In: stripe peaks on boards of measured pose. Out: the laser plane by robust maximum likelihood with covariance and
//! hold-out errors; the boards' poses may move within their own uncertainty.
//! Frame and unit: camera frame, mm; peaks in px (docs/math.md, Laser plane (1) to (6)).

pub use super::agree::SecondPlane;
use super::agree::{agreeing, majority, near, second_plane};
use super::checks::{Consistency, board_spread, consistency, depth_spread, from_camera, reach};
use super::options::{LaserPlaneOptions, refused};
use super::terms::{Data, Seen, State, basis, by_camera, look, mm_per_px, on_board, ratio};
use super::views::StripeView;
use crate::calibrate::boards::extent::{inside, to_print_edge};
use crate::calibrate::measured_pose::MeasuredPose;
use crate::calibrate::scatter::{inflation, winsorised};
use crate::camera::{CameraCovariance, Intrinsics};
use crate::fault::{Fault, Result};
use crate::geometry::{Board, Camera, Plane, Rigid};
use crate::solve::{End, Loss, Solution};
use nalgebra::{DMatrix, Matrix6};

/// Whether a peak is used, and if not, why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PeakUse {
    /// In the fit.
    Used,
    /// Not on the board: dots, halos, the background, reflections beside the board.
    OffBoard,
    /// Close to an edge of the print.
    AtEdge,
    /// On the board, but off the plane: a reflection.
    Disagrees,
    /// The entire picture was excluded.
    PictureLeftOut,
}

/// Residuals of one picture.
#[derive(Clone, Debug)]
pub struct ViewResidual {
    /// Name of the picture.
    pub name: String,
    /// True if the picture is in the fit; false if it was excluded.
    pub used: bool,
    /// Number of peaks found in the picture.
    pub peaks: usize,
    /// Number of them in the fit.
    pub peaks_used: usize,
    /// rms distance of the used peaks from the fitted stripe, px.
    pub px: f64,
    /// rms of the used peaks' distance from the laser plane, mm.
    pub mm: f64,
    /// rms distance of the peaks from the stripe of the plane fitted without this picture, px.
    pub holdout_px: f64,
    /// rms distance of the peaks from the plane fitted without this picture, mm.
    pub holdout_mm: f64,
    /// Squared distance of the picture's stripe from the position that the others predict, in sigmas of both; 2 is
    /// usual.
    pub surprise: f64,
    /// The same divided by its usual size among these pictures, if that is larger than chance explains.
    pub beside: f64,
    /// The picture shows a stripe but was excluded, because the stripe lies elsewhere.
    pub contradicts: bool,
    /// Factor by which its features fit the board worse than those of the other pictures.
    pub board_misfit: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct LaserPlaneFit {
    /// The laser plane, mm.
    pub plane: Plane<Camera>,
    /// Covariance of nx ny nz offset_mm, rank 3, by pixels, poses and the pictures' scatter; includes the camera's
    /// uncertainty.
    pub covariance: DMatrix<f64>,
    /// The same covariance with the camera taken as exact.
    pub covariance_camera_exact: DMatrix<f64>,
    /// One entry per view, in the order given.
    pub views: Vec<ViewResidual>,
    /// One entry per peak, by view.
    pub uses: Vec<Vec<PeakUse>>,
    /// rms of the peaks' residuals over their stated sigmas: 1 if the sigmas are right.
    pub sigma_ratio: f64,
    /// Factor on the variance because neighbouring peaks share speckle; 1 if they are independent.
    pub neighbour_factor: f64,
    /// Distance of the pictures' stripes from the plane relative to their own sigmas; 1 if these are right.
    pub scatter: f64,
    /// Factor on the variance for this scatter.
    pub inflation: f64,
    /// Another plane that the peaks outside the fit agree on.
    pub second: Option<SecondPlane>,
    /// Largest angle between two boards' normals, rad.
    pub board_spread: f64,
    /// Least and largest depth of a used peak, mm.
    pub reach: [f64; 2],
    /// rms spread of the stripes perpendicular to their own direction, mm; it determines the plane's tilt.
    pub depth_spread: f64,
    /// Whether the fit is a minimum.
    pub end: End,
}

/// State of the fit: the used data, the plane and the boards, and the corrections of the stated sigmas.
struct Fitting {
    data: Data,
    state: State,
    /// Pictures in the fit.
    used: Vec<bool>,
    sigma_ratio: f64,
    neighbours: f64,
    /// Factor on the peaks' sigmas, by both of these.
    factor: f64,
}

/// Fits the laser plane. `feature_factor` corrects the stated sigmas of the boards' features
/// ([`crate::calibrate::measured_pose::pooled_factor`]). `camera_covariance` is the covariance of the camera's
/// parameters.
pub fn solve(
    views: &[StripeView],
    camera: &Intrinsics,
    camera_covariance: &CameraCovariance,
    feature_factor: f64,
    o: &LaserPlaneOptions,
) -> Result<LaserPlaneFit> {
    o.check()?;
    let mut uses: Vec<Vec<PeakUse>> = views.iter().map(|v| vec![PeakUse::OffBoard; v.peaks.len()]).collect();
    let all = select(views, camera, o, &mut uses);
    if views.len() < 2 || all.len() < 3 {
        return Err(refused(format!(
            "{} pictures with {} stripe peaks on their boards: at least 2 pictures and 3 peaks are needed",
            views.len(),
            all.len()
        )));
    }
    let mut fitting = Fitting::start(views, &all, camera, feature_factor, o)?;
    let (solution, end) = fitting.settle(&all, o)?;
    let Fitting { data, state, used, sigma_ratio, neighbours, factor } = fitting;
    let local = solution.covariance.as_ref().ok_or_else(undetermined)?.view((0, 0), (3, 3)).into_owned();
    mark(&mut uses, &all, &data.peaks, &used);
    let by_camera = by_camera(&data, &state, views, camera, &camera_covariance.named(), factor);
    let by_camera = by_camera.ok_or_else(undetermined)?;
    let mut checks = consistency(&data, &state, factor);
    if checks.freedom > 0.0 {
        let explained = from_camera(&data, &state, factor, &by_camera, camera_covariance);
        checks.scatter2 *= checks.freedom / (checks.freedom + explained);
    }
    let residuals = residuals(&data, &state, views, &used, &checks, &all, o);
    let against = residuals.iter().filter(|v| v.contradicts).count();
    let inflation = inflation(winsorised(checks.scatter2, checks.freedom, against), checks.freedom);
    let basis = basis(&state.plane);
    let exact = &basis * &local * basis.transpose() * inflation;
    let follows = by_camera.plane * camera_covariance.matrix() * by_camera.plane.transpose();
    let covariance = &exact + &basis * DMatrix::from_column_slice(3, 3, follows.as_slice()) * basis.transpose();
    // Peaks near this plane are its own light, displaced by an edge of the print or a hot pixel.
    let rest = |p: &&Seen| uses[p.view][p.index] != PeakUse::Used && !near(p, &state.plane, &data.measured, o.gate_px);
    let rest: Vec<Seen> = all.iter().filter(rest).copied().collect();
    let second = second_plane(&rest, &data, &state, views, camera, o);
    Ok(LaserPlaneFit {
        end,
        plane: state.plane,
        covariance,
        covariance_camera_exact: exact,
        views: residuals,
        uses,
        sigma_ratio,
        neighbour_factor: neighbours,
        scatter: checks.scatter2.sqrt(),
        inflation,
        second,
        board_spread: board_spread(&state, &used),
        reach: reach(&data, &state),
        depth_spread: depth_spread(&data, &state),
    })
}

impl Fitting {
    /// Starts with the consensus plane of the peaks, the measured board poses and the pictures that agree.
    fn start(
        views: &[StripeView],
        all: &[Seen],
        camera: &Intrinsics,
        feature_factor: f64,
        o: &LaserPlaneOptions,
    ) -> Result<Fitting> {
        let measured: Vec<_> = views.iter().map(|v| v.pose.camera_from_board).collect();
        let roots = views.iter().map(|v| root(&v.pose, feature_factor)).collect::<Result<_>>()?;
        let plane = majority(all, &measured, camera, o)?;
        let on: Vec<Seen> = all.iter().filter(|p| near(p, &plane, &measured, o.gate_px)).copied().collect();
        let used = agreeing(all, &on, views.len(), o);
        let peaks = on.into_iter().filter(|p| used[p.view]).collect();
        let state = State { plane, poses: measured.clone() };
        let data = Data { peaks, measured, roots };
        Ok(Fitting { data, state, used, sigma_ratio: 1.0, neighbours: 1.0, factor: 1.0 })
    }

    /// Least squares in rounds, until the sigmas are stable and no picture contradicts the others. Each round
    /// excludes the worst contradicting picture.
    fn settle(&mut self, all: &[Seen], o: &LaserPlaneOptions) -> Result<(Solution<State>, End)> {
        let mut solution = None;
        for round in 0..self.used.len() + 3 {
            if self.data.peaks.len() < 3 || self.pictures() < 2 {
                return Err(refused("fewer than two pictures agree on one laser plane".into()));
            }
            if round == 0 {
                self.gate_peaks(all, o)?;
            }
            let s = self.data.solve(&self.state, Loss::Squares, self.factor).ok_or_else(undetermined)?;
            self.state = s.0.state.clone();
            solution = Some(s);
            let settled = self.judge_sigmas();
            let beside = consistency(&self.data, &self.state, self.factor).beside(&self.used);
            let used = (0..self.used.len()).filter(|&i| self.used[i]);
            match used.max_by(|&a, &b| beside[a].total_cmp(&beside[b])) {
                Some(i) if beside[i] > o.gate_surprise && self.pictures() > 3 => {
                    self.used[i] = false;
                    self.data.peaks.retain(|p| p.view != i);
                }
                _ if settled => break,
                _ => {}
            }
        }
        Ok(solution.expect("at least one round"))
    }

    fn pictures(&self) -> usize {
        self.used.iter().filter(|u| **u).count()
    }

    /// Selects the peaks by their distance from a robust fit, in sigmas as estimated from that fit.
    fn gate_peaks(&mut self, all: &[Seen], o: &LaserPlaneOptions) -> Result<()> {
        self.state = self.data.solve(&self.state, Loss::Cauchy(2.4), self.factor).ok_or_else(undetermined)?.0.state;
        let scale = robust_ratio(&self.data, &self.state, self.factor).max(0.2);
        let near = |p: &&Seen| self.used[p.view] && ratio(p, &self.state, 1.0).abs() < o.gate_sigmas * scale;
        self.data.peaks = all.iter().filter(near).copied().collect();
        Ok(())
    }

    /// Sets the factor on the peaks' sigmas from the residuals; returns true when it is stable.
    fn judge_sigmas(&mut self) -> bool {
        let ratios: Vec<f64> = self.data.peaks.iter().map(|p| ratio(p, &self.state, 1.0)).collect();
        self.sigma_ratio = (ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64).sqrt();
        self.neighbours = neighbour_factor(&self.data.peaks, &ratios);
        let next = self.sigma_ratio.max(1e-3) * self.neighbours.sqrt();
        let settled = (next / self.factor - 1.0).abs() < 0.01;
        self.factor = next;
        settled
    }
}

fn undetermined() -> Fault {
    refused("the laser plane is not determined by these stripes".into())
}

/// Sets the use of each peak on the boards.
fn mark(uses: &mut [Vec<PeakUse>], all: &[Seen], fitted: &[Seen], used: &[bool]) {
    for p in all {
        uses[p.view][p.index] = if used[p.view] { PeakUse::Disagrees } else { PeakUse::PictureLeftOut };
    }
    for p in fitted {
        uses[p.view][p.index] = PeakUse::Used;
    }
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

fn root(pose: &MeasuredPose, factor: f64) -> Result<Matrix6<f64>> {
    let own = pose.factor_among(factor);
    (pose.information / (own * own))
        .cholesky()
        .map(|c| c.l().transpose())
        .ok_or_else(|| refused(format!("{}: the board's pose is not determined", pose.name)))
}

fn robust_ratio(data: &Data, s: &State, factor: f64) -> f64 {
    let mut r: Vec<f64> = data.peaks.iter().map(|p| ratio(p, s, factor).abs()).collect();
    crate::solve::robust_scale(&mut r, 1)
}

/// Largest lag of the correlation along the stripe, peaks.
const LONGEST_LAG: usize = 40;

/// 1 + 2 Σ ρₖ over the lags along the stripe whose correlation exceeds the noise. Speckle causes it, and so do pieces
/// of a stripe that are displaced together.
fn neighbour_factor(peaks: &[Seen], ratios: &[f64]) -> f64 {
    let variance = ratios.iter().map(|r| r * r).sum::<f64>() / ratios.len() as f64;
    let apart = |a: &Seen, b: &Seen| (a.view == b.view).then(|| (b.pixel - a.pixel).norm());
    let mut steps: Vec<f64> = peaks.windows(2).filter_map(|w| apart(&w[0], &w[1])).collect();
    steps.sort_by(f64::total_cmp);
    let Some(step) = steps.get(steps.len() / 2) else { return 1.0 };
    let mut factor = 1.0;
    for lag in 1..=LONGEST_LAG {
        let near = |i: &usize| apart(&peaks[i - lag], &peaks[*i]).is_some_and(|d| d < 1.6 * step * lag as f64);
        let (sum, n) = (lag..peaks.len())
            .filter(near)
            .fold((0.0, 0.0), |(sum, n), i| (sum + ratios[i - lag] * ratios[i], n + 1.0));
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
    checks: &Consistency,
    all: &[Seen],
    o: &LaserPlaneOptions,
) -> Vec<ViewResidual> {
    let mut misfits: Vec<f64> = views.iter().map(|v| v.pose.sigma_factor).collect();
    misfits.sort_by(f64::total_cmp);
    let usual = misfits[(misfits.len() - 1) / 2].max(1e-12);
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
    let beside = checks.beside(used);
    (0..views.len())
        .map(|v| {
            let used_here: Vec<&Seen> = data.peaks.iter().filter(|p| p.view == v).collect();
            // For an excluded picture, the peaks that it would have contributed.
            let shown: Vec<&Seen> =
                if used[v] { used_here.clone() } else { all.iter().filter(|p| p.view == v).collect() };
            let (px, mm) = rms(&shown, &state.plane, &state.poses[v]);
            let (holdout_px, holdout_mm) = checks.views[v]
                .plane
                .map_or((f64::INFINITY, f64::INFINITY), |plane| rms(&shown, &plane, &data.measured[v]));
            let used_now = used[v] && used_here.len() >= o.min_peaks.min(3);
            ViewResidual {
                name: views[v].pose.name.clone(),
                used: used_now,
                peaks: views[v].peaks.len(),
                peaks_used: if used[v] { used_here.len() } else { 0 },
                px,
                mm,
                holdout_px,
                holdout_mm,
                surprise: checks.views[v].surprise,
                beside: beside[v],
                contradicts: !used_now && all.iter().filter(|p| p.view == v).count() >= o.min_peaks,
                board_misfit: views[v].pose.sigma_factor / usual,
            }
        })
        .collect()
}
