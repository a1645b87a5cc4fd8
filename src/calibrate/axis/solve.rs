//! In: a board's poses at the stops of a linear axis or turntable, with their counts. Out: direction and pitch, or
//! the axis of rotation, by maximum likelihood, with covariance, the axis' own scatter and hold-out errors.
//! Frame and unit: camera frame, mm, rad, counts (docs/math.md, Axis (1) to (8)).

use super::checks::{self, Suspects};
use super::fit::{AxisFit, Stop};
use super::noise;
use super::start::{Start, start};
use super::terms::{self, Fit, Scatter, Seen, fitted};
use crate::calibrate::measured_pose::pooled_factor;
use crate::calibrate::scatter::inflation;
use crate::camera::CameraCovariance;
use crate::fault::{Fault, Result};
use crate::geometry::{AxisKind, CountUnit};

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct AxisOptions {
    /// A picture is excluded if its board lies farther than this from the position that the others predict: squared
    /// Mahalanobis distance, 6 degrees of freedom. 26.1 excludes one good picture in 5,000. 12..=1000.
    pub gate: f64,
    /// Seed of the random permutations of the counts that the fit is compared with.
    pub seed: u64,
}

impl Default for AxisOptions {
    fn default() -> Self {
        AxisOptions { gate: 26.1, seed: 1 }
    }
}

fn refused(what: String) -> Fault {
    Fault::refused(what)
        .cause("too few stops, an axis that hardly moved, or counts and pictures that do not belong together")
        .next("show the board at eight or more stops, unevenly apart, along as much of the travel as the camera sees")
}

/// Fits the axis. `camera_covariance` is the covariance of the camera's parameters.
///
/// # Errors
/// Fewer than three stops, counts that are all equal, or boards that agree on no motion.
pub fn solve(
    stops: &[Stop],
    kind: AxisKind,
    unit: CountUnit,
    camera_covariance: &CameraCovariance,
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
    let first = start(&seen, kind, unit).ok_or_else(|| refused("no two stops tell a motion".into()))?;
    let order = checks::order(&seen, &first, unit, o.seed);
    let Settled { fit, scatter, suspects } = settle(&seen, first, o.gate)?;
    let state = fit.state;
    let used: Vec<usize> = suspects.used.clone();
    let chosen: Vec<&Seen> = used.iter().map(|&i| &seen[i]).collect();
    let (chi2, inflation) = misfit(&chosen, &fit, &scatter);
    let exact = &fit.covariance * inflation;
    let by = terms::by_camera(&chosen, &fit, &scatter);
    let follows = &by * camera_covariance.matrix() * by.transpose();
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
        end: fit.end,
        axis,
    })
}

/// Motion and scatter that are consistent with each other, and the check of the stops against each other.
struct Settled {
    fit: Fit,
    scatter: Scatter,
    suspects: Suspects,
}

/// Fits, excludes what lies beyond the gate, and fits again until the set of used stops no longer changes.
fn settle(seen: &[Seen], first: Start, gate: f64) -> Result<Settled> {
    let undetermined = || refused("the stops do not determine the axis".into());
    let mut used = first.agreeing;
    let (mut state, mut scatter) = (first.state, first.scatter);
    let mut settled = None;
    for round in 0..12 {
        let chosen: Vec<&Seen> = used.iter().map(|&i| &seen[i]).collect();
        if chosen.len() < 3 {
            return Err(refused(format!("{} of {} stops agree on one motion, 3 are needed", chosen.len(), seen.len())));
        }
        let fit = fitted(&chosen, &state, &scatter).ok_or_else(undetermined)?;
        scatter = noise::estimate(&chosen, &fit);
        let fit = fitted(&chosen, &fit.state, &scatter).ok_or_else(undetermined)?;
        state = fit.state;
        let suspects = Suspects::of(seen, &used, &fit, &scatter);
        let next = suspects.within(gate, &used, round);
        settled = Some(Settled { fit, scatter, suspects });
        if next == used {
            break;
        }
        used = next;
    }
    Ok(settled.expect("at least one round"))
}

/// Squared distances over their degrees of freedom, and the factor on the variance for a scatter estimated from few
/// stops.
fn misfit(chosen: &[&Seen], fit: &Fit, scatter: &Scatter) -> (f64, f64) {
    let freedom = (6 * chosen.len()) as f64 - fit.covariance.nrows() as f64;
    let chi2 = if freedom > 0.0 { fit.cost / freedom } else { 1.0 };
    // Degrees of freedom of the positions alone: rotations say little about a line.
    let few = 3.0 * chosen.len() as f64 - (fit.covariance.nrows() as f64 - 3.0);
    let share = noise::share(chosen, scatter);
    (chi2, inflation(chi2.max(1.0) + share, few) / (1.0 + share))
}
