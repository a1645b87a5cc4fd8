//! In: a plan, the limits, the robot's current situation. Out: every gate with its number and its limit. Pure.
//! Frame and unit: base frame; mm, mm/s, degrees, s; yes-or-no gates have 1 and 0.

use super::super::{Mode, Motion, State};
use super::carried::Carried;
use super::limits::{Limits, MOST_SPEED_MM_S};
use super::pace::pace;
use super::plan::Plan;
use super::straight::Straight;
use crate::fault::Gate;
use crate::geometry::{Base, Flange, Rigid};

/// The robot's current situation.
#[derive(Clone, Debug)]
pub struct Situation {
    /// Mode, motor, errors, frames.
    pub state: State,
    /// Current pose of the flange.
    pub at: Rigid<Base, Flange>,
    /// Its figure, if the controller reports one.
    pub figure: Option<i32>,
    /// Motion is permitted: `--allow-motion` was given and the robot was armed.
    pub armed: bool,
    /// A motion was stopped and no person has looked at the robot since.
    pub unknown: bool,
}

/// Largest orthonormality error of a rotation matrix that is accepted.
const ORTHONORMAL: f64 = 1e-6;

/// Slowest speed of a leg, mm/s: below it a moving arm cannot be distinguished from one at rest.
pub const SLOWEST_MM_S: f64 = 0.1;
/// A path is checked in pieces that turn by at most this angle, rad. A point 300 mm off the flange deviates by 0.02
/// mm from the chord of such a piece.
const PIECE: f64 = 0.02;

/// Orthonormality error of a pose's rotation; infinite if a number is not finite or the determinant is not
/// positive.
fn departure(pose: &Rigid<Base, Flange>) -> f64 {
    let r = &pose.rotation;
    let off = (r.transpose() * r - crate::geometry::Mat3::identity()).norm();
    let finite = pose.to_rows().iter().all(|x| x.is_finite());
    if finite && r.determinant() > 0.0 { off } else { f64::INFINITY }
}

/// A yes-or-no condition as a gate.
fn must(name: &'static str, yes: bool) -> Gate {
    Gate::least(name, f64::from(u8::from(yes)), 1.0)
}

/// All gates of a plan.
pub fn gates(plan: &Plan, limits: &Limits, carried: &Carried, now: &Situation) -> Vec<Gate> {
    let worst = |of: &dyn Fn(&Rigid<Base, Flange>, &Motion) -> f64| {
        let mut from = now.at;
        let mut most = 0f64;
        for leg in &plan.legs {
            let value = of(&from, leg);
            // NaN counts as the worst value.
            most = if value.is_nan() { f64::INFINITY } else { most.max(value) };
            from = leg.to;
        }
        most
    };
    let turning = limits.max_turn_deg_s;
    let mut out = vec![
        must("armed", now.armed),
        must("the arm's place is known", !now.unknown),
        Gate::least("motions", plan.legs.len() as f64, 1.0),
        Gate::most("orthonormality error of the rotation", worst(&|_, leg| departure(&leg.to)), ORTHONORMAL),
        Gate::most("speed, mm/s", worst(&|_, leg| leg.speed_mm_s), limits.speed_mm_s.min(MOST_SPEED_MM_S)),
        Gate::least("slowest speed, mm/s", slowest(plan), SLOWEST_MM_S),
        Gate::most("turning rate, degrees/s", worst(&|from, leg| pace(from, leg, carried, limits).turn_deg_s), turning),
        Gate::most("outside the workspace, mm", worst(&|_, leg| limits.workspace.outside(&leg.to.translation)), 0.0),
        Gate::most("starts outside the workspace, mm", limits.workspace.outside(&now.at.translation), 0.0),
        Gate::most("way through a keep-out, mm", worst(&|from, leg| kept_out(carried, limits, from, &leg.to)), 0.0),
        Gate::most("step, mm", worst(&|from, leg| (leg.to.translation - from.translation).norm()), limits.max_step_mm),
        Gate::most("turn, degrees", worst(&|from, leg| from.difference(&leg.to).0.to_degrees()), limits.max_turn_deg),
    ];
    out.extend(of_the_state(&now.state));
    out.extend(of_the_evidence(plan, limits));
    out
}

fn slowest(plan: &Plan) -> f64 {
    let speeds = plan.legs.iter().map(|leg| if leg.speed_mm_s.is_nan() { f64::NEG_INFINITY } else { leg.speed_mm_s });
    speeds.fold(f64::INFINITY, f64::min)
}

/// The length of the path inside keep-outs, mm: the largest over the flange and all that it carries.
fn kept_out(carried: &Carried, limits: &Limits, from: &Rigid<Base, Flange>, to: &Rigid<Base, Flange>) -> f64 {
    let way = Straight::new(from, to);
    let pieces = (way.turn.norm() / PIECE).ceil().clamp(1.0, 200.0) as usize;
    let stops: Vec<_> = (0..=pieces).map(|k| way.at(k as f64 / pieces as f64)).collect();
    let inside = |[a, b]: [&Rigid<Base, Flange>; 2], p| {
        limits.keep_out.iter().map(|space| space.inside_of(&a.point(p), &b.point(p))).sum::<f64>()
    };
    let through = |p| stops.windows(2).map(|w| inside([&w[0], &w[1]], p)).sum::<f64>();
    carried.points().map(through).fold(0.0, f64::max)
}

/// Whether a straight path ends inside the workspace and avoids the keep-outs.
pub fn free(carried: &Carried, limits: &Limits, from: &Rigid<Base, Flange>, to: &Rigid<Base, Flange>) -> bool {
    limits.workspace.outside(&to.translation) <= 0.0 && kept_out(carried, limits, from, to) <= 0.0
}

/// The conditions on mode, motor, errors and frames for any motion.
pub fn of_the_state(state: &State) -> Vec<Gate> {
    let zero = |n: Option<i32>| n.map_or(f64::INFINITY, |n| f64::from(n.abs()));
    vec![
        must("automatic mode", state.mode == Mode::Automatic),
        must("motor on", state.motor == Some(true)),
        must("standing still", state.busy == Some(false)),
        must("no emergency stop", state.emergency_stop == Some(false)),
        Gate::most("errors on the controller", state.errors.len() as f64, 0.0),
        Gate::most("number of the tool", zero(state.tool), 0.0),
        Gate::most("number of the work frame", zero(state.work), 0.0),
    ]
}

fn of_the_evidence(plan: &Plan, limits: &Limits) -> Vec<Gate> {
    let mut out = Vec::new();
    let evidence = &plan.evidence;
    if let Some(normal) = &evidence.normal {
        // The flange's z axis points against the normal.
        let tilt = |leg: &Motion| (-leg.to.rotation.column(2).dot(normal)).clamp(-1.0, 1.0).acos().to_degrees();
        let worst = plan.legs.iter().map(|leg| if tilt(leg).is_nan() { f64::INFINITY } else { tilt(leg) });
        out.push(Gate::most("tilt to the measured normal, degrees", worst.fold(0.0, f64::max), limits.max_tilt_deg));
    }
    if let Some((station, scan)) = &evidence.fingerprints {
        out.push(must("scan of this calibration", station == scan));
    }
    if let Some(age) = evidence.scan_age_s {
        // A scan dated in the future is refused like one that is too old.
        out.push(Gate::most("age of the scan, s", if age >= 0.0 { age } else { f64::INFINITY }, limits.max_scan_age_s));
    }
    out.extend(evidence.measured.iter().cloned());
    out
}
