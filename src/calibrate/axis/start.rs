//! In: boards at stops, some of which may be wrong. Out: the motion that most of them agree on, the stops that agree,
//! and their scatter about it. Every pair (on a turntable: neighbours) proposes a motion. The proposal that
//! 60 % of the stops lie closest to wins.
//! Frame and unit: camera frame, mm, rad, counts (docs/math.md, Axis (5)).

use super::terms::{Scatter, Seen, State};
use crate::geometry::{AxisKind, CountUnit, Mat3, Vec3, log};

/// Start values of the fit.
pub(super) struct Start {
    pub state: State,
    pub agreeing: Vec<usize>,
    pub scatter: Scatter,
    /// Distance from the expected positions within which [`MAJORITY`] of the stops lie, mm.
    pub spread: f64,
}

/// Share of the stops that must lie near a proposal. It is above one half, so that two halves cannot tie.
const MAJORITY: f64 = 0.6;
/// Stops within this many times the usual distance count as agreeing at first.
const NEAR: f64 = 4.0;
/// Pairs on a turntable: each stop with this many next ones.
const REACH: usize = 3;
/// Relative deviation from the stated pitch beyond which a proposal counts as a different rotation.
const OFF: f64 = 0.3;

/// Distance of a stop from its expected position, mm; the rotation counts by its effect at the board's corners.
fn distance(state: &State, s: &Seen) -> f64 {
    let e = state.off(s);
    e.fixed_rows::<3>(0).norm().hypot(s.arm * e.fixed_rows::<3>(3).norm())
}

/// `None` where no two stops have different counts.
pub(super) fn start(seen: &[Seen], kind: AxisKind, unit: CountUnit) -> Option<Start> {
    let proposals: Vec<State> = match kind {
        AxisKind::Linear => (0..seen.len())
            .flat_map(|i| (0..i).map(move |j| (j, i)))
            .filter_map(|(j, i)| line(&seen[j], &seen[i]))
            .collect(),
        AxisKind::Turntable => {
            let mut order: Vec<&Seen> = seen.iter().collect();
            order.sort_by(|a, b| a.count.total_cmp(&b.count));
            let pairs = (0..order.len()).flat_map(|i| (i + 1..order.len().min(i + 1 + REACH)).map(move |j| (i, j)));
            pairs.filter_map(|(i, j)| turn(order[i], order[j], unit)).collect()
        }
    };
    let place = (MAJORITY * seen.len() as f64).ceil() as usize;
    let place = place.clamp(1, seen.len()) - 1;
    let spread = |state: &State| {
        let mut all: Vec<f64> = seen.iter().map(|s| distance(state, s)).collect();
        *all.select_nth_unstable_by(place, f64::total_cmp).1
    };
    let best = proposals.into_iter().map(|p| (spread(&p), p)).filter(|p| p.0.is_finite());
    let (spread, state) = best.min_by(|a, b| a.0.total_cmp(&b.0))?;
    // At least the sigma of the pixels alone: the spread of three exact stops is zero.
    let pixels = seen.iter().map(|s| s.covariance.fixed_view::<3, 3>(0, 0).trace().sqrt()).fold(0.0, f64::max);
    let limit = NEAR * spread.max(pixels);
    let agreeing: Vec<usize> = (0..seen.len()).filter(|&i| distance(&state, &seen[i]) <= limit).collect();
    let usual = spread / 3f64.sqrt();
    let arm = seen.iter().map(|s| s.arm).fold(0.0, f64::max).max(1e-9);
    Some(Start { state, agreeing, scatter: Scatter { mm: usual, rad: usual / arm }, spread })
}

fn state(kind: AxisKind, along: Vec3, pitch: f64, point: Vec3, s: &Seen) -> State {
    let mut out = State { kind, along, pitch, point, place: s.place, turn: s.turn, middle: s.middle };
    // From the stop back to count 0.
    match kind {
        AxisKind::Linear => out.place -= along * s.count,
        AxisKind::Turntable => (out.place, out.turn) = out.expected(-s.count),
    }
    out
}

fn line(a: &Seen, b: &Seen) -> Option<State> {
    let along = (b.place - a.place) / (b.count - a.count);
    let good = along.iter().all(|x| x.is_finite()) && along.norm() > 0.0;
    good.then(|| state(AxisKind::Linear, along, 0.0, Vec3::zeros(), a))
}

/// The rotation between the two stops is less than half a turn unless the unit states the pitch.
fn turn(a: &Seen, b: &Seen, unit: CountUnit) -> Option<State> {
    let counts = b.count - a.count;
    let rotation = b.turn * a.turn.transpose();
    let w = log(&rotation);
    let angle = w.norm();
    if !(counts > 0.0 && angle > 1e-4) {
        return None;
    }
    let d = w / angle;
    let mut pitch = angle / counts;
    if let Some(stated) = unit.stated() {
        // Of all angles that give the same rotation, the one closest to the stated pitch, in either direction.
        let whole = std::f64::consts::TAU;
        let candidates = [stated * counts, -stated * counts].map(|by| angle + whole * ((by - angle) / whole).round());
        pitch = candidates.into_iter().map(|c| c / counts).find(|k| (k.abs() / stated - 1.0).abs() < OFF)?;
    }
    // (1 - R) q = b - R a leaves q free along d: the component along d is set to zero.
    let m = Mat3::identity() - rotation + d * d.transpose();
    let moved = b.place - rotation * a.place;
    let point = m.try_inverse()? * (moved - d * d.dot(&moved));
    let good = point.iter().all(|x| x.is_finite());
    good.then(|| state(AxisKind::Turntable, d, pitch, point, a))
}
