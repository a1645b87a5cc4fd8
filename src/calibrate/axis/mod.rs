//! In: a board's poses at stops of a linear axis or turntable, with the counts there. Out: direction and pitch, or the axis of
//! rotation, by maximum likelihood, with covariance, the axis' own scatter and hold-out errors.
//! Frame and unit: camera frame, mm, rad, counts (docs/math.md, Axis (1) to (8)).

mod checks;
mod noise;
pub mod report;
mod start;
mod terms;

use super::measured_pose::{MeasuredPose, pooled_factor};
use super::scatter::inflation;
use crate::camera::ParameterCovariance;
use crate::fault::{Fault, Result};
use crate::geometry::{Axis, AxisKind, CountUnit, Vec3, exp};
use checks::Suspects;
use nalgebra::{DMatrix, Matrix6};
use noise::Scatter;
use terms::{Seen, fitted};

pub use checks::Order;

/// One stop of the axis with the board that rides on it.
#[derive(Clone, Debug)]
pub struct Stop {
    /// From the motion's zero.
    pub count: f64,
    pub pose: MeasuredPose,
}

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct AxisOptions {
    /// A picture is left out whose board lies farther than this from where the others predict it: squared Mahalanobis
    /// distance, 6 degrees of freedom; 26.1 leaves one good picture in 5,000 out. 12..=1000.
    pub gate: f64,
    /// Seed of the random deals of counts that the fit is compared with.
    pub seed: u64,
}

impl Default for AxisOptions {
    fn default() -> Self {
        AxisOptions { gate: 26.1, seed: 1 }
    }
}

/// How one picture fits: its step from the expected to the seen board.
#[derive(Clone, Debug)]
pub struct StopResidual {
    pub name: String,
    pub count: f64,
    /// In the fit; false: it contradicts the others and was left out.
    pub used: bool,
    /// Board corners, rms, mm; and with the picture left out of the fit.
    pub mm: f64,
    pub holdout_mm: f64,
    /// Squared distance from where the others predict it, in sigmas of both; 6 is usual.
    pub surprise: f64,
    /// How far the board's middle was from its expected place, camera frame, mm.
    pub off: Vec3,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct AxisFit {
    pub axis: Axis,
    /// Of dx dy dz pitch and for a turntable px py pz, as [`crate::rig::Kind::parameters`] names them; camera uncertainty included.
    pub covariance: DMatrix<f64>,
    pub covariance_camera_exact: DMatrix<f64>,
    pub stops: Vec<StopResidual>,
    /// What the axis scatters by from stop to stop beyond what pixels explain, per axis: mm, and rad about the board's middle.
    pub sigma_mm: f64,
    pub sigma_rad: f64,
    /// Squared distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// What the variance was multiplied by, because scatter is known from few pictures.
    pub inflation: f64,
    /// Counts of the used stops, and the board's corners and middle in axis coordinates at count 0.
    pub counts: Vec<f64>,
    pub landmarks: [Vec3; 5],
    /// How far the used stops lie from a straight line as a bow over the whole way, mm, and its sigma; 0 for a turntable.
    pub bend_mm: [f64; 2],
    pub order: Order,
}

fn refused(what: String) -> Fault {
    Fault::refused(what)
        .cause("too few stops, an axis that hardly moved, or counts and pictures that do not belong together")
        .next("show the board at eight or more stops, unevenly apart, along as much of the way as the camera sees")
}

/// Fits the axis. `camera_covariance` is that of the camera's parameters.
///
/// # Errors
/// Fewer than three stops, counts that are all the same, boards that agree on no motion.
pub fn solve(
    stops: &[Stop],
    kind: AxisKind,
    unit: CountUnit,
    camera_covariance: &ParameterCovariance,
    o: &AxisOptions,
) -> Result<AxisFit> {
    if !(12.0..=1000.0).contains(&o.gate) {
        return Err(
            Fault::usage(format!("gate is {}, 12 to 1000 is allowed", o.gate)).next("choose a value in that range")
        );
    }
    if stops.len() < 3 {
        return Err(refused(format!("{} stops with a board and a count, 3 are needed", stops.len())));
    }
    let factor = pooled_factor(stops.iter().map(|s| &s.pose)).unwrap_or(1.0);
    let seen: Vec<Seen> = stops
        .iter()
        .map(|s| Seen::new(s, factor))
        .collect::<Option<_>>()
        .ok_or_else(|| refused("a board's pose is not determined by its pixels".into()))?;
    let (low, high) =
        seen.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(s.count), b.max(s.count)));
    if !(high > low) {
        return Err(refused(format!("all {} stops have the count {low}", stops.len())));
    }
    let first = start::start(&seen, kind, unit).ok_or_else(|| refused("no two stops tell a motion".into()))?;
    let order = checks::order(&seen, &first, unit, o.seed);
    let mut used = first.agreeing.clone();
    let (mut state, mut scatter) = (first.state, first.scatter);
    let mut settled = None;
    for round in 0..12 {
        let chosen: Vec<&Seen> = used.iter().map(|&i| &seen[i]).collect();
        if chosen.len() < 3 {
            return Err(refused(format!("{} of {} stops agree on one motion, 3 are needed", chosen.len(), seen.len())));
        }
        let fit =
            fitted(&chosen, &state, &scatter).ok_or_else(|| refused("the stops do not determine the axis".into()))?;
        scatter = noise::estimate(&chosen, &fit);
        let fit = fitted(&chosen, &fit.state, &scatter)
            .ok_or_else(|| refused("the stops do not determine the axis".into()))?;
        state = fit.state;
        let suspects = Suspects::of(&seen, &used, &fit, &scatter);
        let next = suspects.within(o.gate, &used, round);
        settled = Some((fit, suspects));
        if next == used {
            break;
        }
        used = next;
    }
    let (fit, suspects) = settled.expect("at least one round");
    let used: Vec<usize> = suspects.used.clone();
    let chosen: Vec<&Seen> = used.iter().map(|&i| &seen[i]).collect();
    let freedom = (6 * chosen.len()) as f64 - fit.covariance.nrows() as f64;
    let chi2 = if freedom > 0.0 { fit.cost / freedom } else { 1.0 };
    // Of places alone: turns say little of a line.
    let few = 3.0 * chosen.len() as f64 - (fit.covariance.nrows() as f64 - 3.0);
    let share = noise::share(&chosen, &scatter);
    let inflation = inflation(chi2.max(1.0) + share, few) / (1.0 + share);
    let exact = &fit.covariance * inflation;
    let by = terms::by_camera(&chosen, &fit, &scatter);
    let follows = &by * camera_covariance * by.transpose();
    let axis = state.axis(unit);
    let to = state.to_parameters(&axis);
    let covariance = &to * (&exact + follows) * to.transpose();
    let back = axis.camera_from_axis.inverse();
    let board = state.board();
    Ok(AxisFit {
        covariance,
        covariance_camera_exact: &to * exact * to.transpose(),
        stops: suspects.residuals(stops, &seen, &state),
        sigma_mm: scatter.mm,
        sigma_rad: scatter.rad,
        chi2,
        inflation,
        counts: chosen.iter().map(|s| s.count).collect(),
        landmarks: stops[used[0]].pose.landmarks.map(|l| back.point(&board.point(&l))),
        bend_mm: checks::bend(&chosen, &state, &scatter),
        order,
        axis,
    })
}

impl AxisFit {
    /// Standard deviation of where a part that rides on the axis is put against where it stood in the middle of the way, rms
    /// over the stops (on a turntable over a whole turn) and the board's corners, mm: of the axis as a whole, and with its
    /// scatter from stop to stop.
    pub fn expected_error(&self, covariance: &DMatrix<f64>) -> [f64; 2] {
        let (low, high) =
            self.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        match self.axis.kind {
            AxisKind::Linear => self.error_over(covariance, (high - low) / 2.0),
            AxisKind::Turntable => self.error_over(covariance, std::f64::consts::PI / self.axis.pitch.abs()),
        }
    }

    /// The same over so many counts to both sides of the middle of the way.
    pub fn error_over(&self, covariance: &DMatrix<f64>, half: f64) -> [f64; 2] {
        let (low, high) =
            self.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        let middle = (low + high) / 2.0;
        let ridden = |p: &Vec3| match self.axis.kind {
            AxisKind::Linear => p + Vec3::x() * (self.axis.pitch * middle),
            AxisKind::Turntable => exp(&(Vec3::z() * (self.axis.pitch * middle))) * p,
        };
        let (mut sum, mut n) = (0.0, 0.0);
        for k in -4..=4 {
            let errors = self.axis.errors(half * f64::from(k) / 4.0);
            for p in self.landmarks.iter().map(ridden) {
                let j = DMatrix::from_fn(3, errors.len(), |i, k| errors[k].at(&p)[i]);
                let c = &j * covariance * j.transpose();
                sum += c.trace().max(0.0);
                n += 1.0;
            }
        }
        let own = sum / n;
        let arm2 = self.landmarks.iter().map(|p| (p - self.landmarks[4]).norm_squared()).sum::<f64>() / 5.0;
        let scatter = 3.0 * self.sigma_mm.powi(2) + 2.0 * self.sigma_rad.powi(2) * arm2;
        [own.sqrt(), (own + scatter).sqrt()]
    }
}

/// Six by six with two variances.
fn diagonal(s: &Scatter) -> Matrix6<f64> {
    let (p, r) = (s.mm * s.mm, s.rad * s.rad);
    Matrix6::from_diagonal(&nalgebra::Vector6::new(p, p, p, r, r, r))
}
