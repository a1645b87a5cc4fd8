//! In: stops, a start. Out: all shared unknowns by maximum likelihood, with joint covariance and the noise of every
//! source; excluded parts with their reasons.
//! Frame and unit: see `unknowns`; mm, rad, px (docs/math.md, Joint calibration).

use super::noise::{Leavings, leavings};
use super::options::{JointOptions, Noise};
use super::shots::{LeftOut, Part, Shot};
use super::terms::{Terms, prior};
use super::unknowns::{Layout, State};
use crate::fault::{Fault, Result};
use crate::solve::{End, LmOptions, Loss, lm};
use nalgebra::DMatrix;

/// What a joint solve found.
pub struct JointFit {
    /// The solved unknowns.
    pub state: State,
    /// Positions of the unknowns in the covariance.
    pub layout: Layout,
    /// Covariance of the shared unknowns; zero for those without data (no robot, no stripe, no spot).
    pub covariance: DMatrix<f64>,
    /// Contribution of each source to the covariance, in the order of [`Part::ALL`].
    pub shares: Vec<DMatrix<f64>>,
    /// Noise of each source.
    pub noise: Noise,
    /// Degrees of freedom that determine each noise, in the order of [`Part::ALL`].
    pub freedom: [f64; 5],
    /// The used stops, without excluded parts.
    pub shots: Vec<Shot>,
    /// The excluded parts.
    pub left_out: Vec<LeftOut>,
    /// rms distance of the corners from their expected pixels, per coordinate, px.
    pub features_rms_px: f64,
    /// Whether state and noise converged to a minimum.
    pub end: End,
}

impl JointFit {
    /// Whether the data contains this part.
    pub fn has(&self, part: Part) -> bool {
        has(&self.shots, part)
    }
}

fn has(shots: &[Shot], part: Part) -> bool {
    shots.iter().any(|s| match part {
        Part::Features => true,
        Part::Stripe => !s.stripe.is_empty(),
        Part::Spot => s.spot.is_some(),
        Part::RobotPlace | Part::RobotTurn => s.robot.is_some(),
    })
}

/// Unknowns without data; they are held fixed.
fn held(shots: &[Shot], l: &Layout) -> Vec<usize> {
    let mut hold = Vec::new();
    if !has(shots, Part::RobotPlace) {
        hold.extend(l.hand_eye()..l.hand_eye() + 6);
    }
    for place in 0..l.places {
        if !shots.iter().any(|s| s.robot.is_some_and(|r| r.place == place)) {
            hold.extend(l.place(place)..l.place(place) + 6);
        }
    }
    if !has(shots, Part::Stripe) {
        hold.extend(l.plane()..l.plane() + 3);
    }
    if !has(shots, Part::Spot) {
        hold.extend(l.beam()..l.beam() + 4);
    }
    hold
}

fn undetermined(shots: &[Shot]) -> Fault {
    let with = |f: fn(&Shot) -> bool| shots.iter().filter(|s| f(s)).count();
    Fault::refused(format!(
        "camera, hand-eye, laser plane and pointer are not determined together: {} pictures of boards, {} with a \
         robot's pose, {} with \
         the stripe, {} with the pointer's spot",
        shots.len(),
        with(|s| s.robot.is_some()),
        with(|s| !s.stripe.is_empty()),
        with(|s| s.spot.is_some())
    ))
    .cause("too few pictures of some kind, or all from alike directions and distances")
    .next("add recordings: eight poses tilted about two axes, the stripe and the spot at three distances or more")
}

struct Round {
    state: State,
    leavings: Leavings,
    noise: Noise,
    covariance: DMatrix<f64>,
    end: End,
}

/// Largest number of rounds that alternate between state and noise.
const ROUNDS: usize = 60;

/// Fits the state and estimates the noise in turns until both are stable.
fn settle(shots: &[Shot], start: &State, noise: Noise, layout: &Layout, o: &JointOptions) -> Result<Round> {
    let prior = o.camera_prior.as_ref().and_then(|p| prior(p, &o.camera_free));
    let mut terms = Terms { shots, mount: o.mount, layout, noise, peak_sigma_mm: Vec::new(), prior };
    let options = LmOptions {
        loss: Loss::Huber(o.huber),
        hold: held(shots, layout),
        max_iterations: 40,
        tolerance: 1e-9,
        ..LmOptions::default()
    };
    let mut state = start.clone();
    for round in 0..ROUNDS {
        terms.settle(&state);
        let (found, end) = lm(&terms, state, &options).ended().ok_or_else(|| undetermined(shots))?;
        state = found.state;
        let covariance = found.covariance.ok_or_else(|| undetermined(shots))?;
        let left = leavings(&terms, &state, &covariance, o.huber).ok_or_else(|| undetermined(shots))?;
        let next = left.noise(&terms.noise);
        let settled = next.factors().iter().zip(terms.noise.factors()).all(|(a, b)| (a / b - 1.0).abs() < 2e-3);
        let last = round + 1 == ROUNDS;
        if (settled && round > 0) || last {
            // A noise that still changes means as little convergence as a cost that still falls.
            let end = if settled { end } else { end.max(End::Exhausted) };
            return Ok(Round { state, leavings: left, noise: terms.noise, covariance, end });
        }
        terms.noise = next;
    }
    unreachable!("the last round returns")
}

/// Groups of parts that are excluded together, and the share of the stops that may be excluded.
const GROUPS: [&[Part]; 4] = [&[Part::Features], &[Part::Stripe], &[Part::Spot], &[Part::RobotPlace, Part::RobotTurn]];
const CONTRADICTING: f64 = 1.0 / 3.0;

/// Solves for all shared unknowns. `start` has a board pose for each stop and a fixed pose for each index in
/// [`super::shots::Reported::place`]. `noise`: start values for the noise of each source.
///
/// # Errors
/// Fewer than three stops, or unknowns that are not determined.
pub fn solve(shots: &[Shot], start: &State, noise: Noise, o: &JointOptions) -> Result<JointFit> {
    o.check()?;
    if shots.len() < 3 {
        return Err(undetermined(shots));
    }
    let (mut shots, mut state, mut noise) = (shots.to_vec(), start.clone(), noise);
    let (whole, mut left_out) = (shots.len(), Vec::new());
    loop {
        let layout = Layout { camera: o.camera_free.clone(), places: state.far_from_board.len(), shots: shots.len() };
        let round = settle(&shots, &state, noise, &layout, o)?;
        (state, noise) = (round.state.clone(), round.noise);
        if (left_out.len() + 1) as f64 <= CONTRADICTING * whole as f64
            && let Some((i, group, ratio)) = worst(&round.leavings, shots.len()).filter(|w| w.2 > o.gate)
        {
            let why = format!("{:.1} times as far off as the others", ratio.sqrt());
            left_out.push(LeftOut { name: shots[i].seen.name.clone(), part: group[0], why });
            match group[0] {
                Part::Features => {
                    shots.remove(i);
                    state.boards.remove(i);
                }
                Part::Stripe => shots[i].stripe.clear(),
                Part::Spot => shots[i].spot = None,
                Part::RobotPlace | Part::RobotTurn => shots[i].robot = None,
            }
            continue;
        }
        let shared = layout.shared();
        let features = &round.leavings.parts[0];
        let sigma2 = shots.iter().flat_map(|s| &s.seen.sigmas_px).map(|s| s * s).sum::<f64>()
            / shots.iter().map(|s| s.seen.sigmas_px.len()).sum::<usize>().max(1) as f64;
        return Ok(JointFit {
            covariance: round.covariance.view((0, 0), (shared, shared)).into_owned(),
            features_rms_px: noise.feature * (sigma2 * features.squares / features.count.max(1.0)).sqrt(),
            freedom: round.leavings.parts.map(|p| p.freedom),
            shares: round.leavings.shares,
            end: round.end,
            state,
            layout,
            noise,
            shots,
            left_out,
        });
    }
}

/// The stop and group of parts that stand out most, relative to the usual value of that group: index, parts, squared
/// ratio.
fn worst(left: &Leavings, shots: usize) -> Option<(usize, &'static [Part], f64)> {
    let mut out: Option<(usize, &'static [Part], f64)> = None;
    for group in GROUPS {
        let ratios: Vec<f64> = (0..shots).map(|i| left.stands_out(i, group)).collect();
        let mut known: Vec<f64> = ratios.iter().copied().filter(|r| *r > 0.0).collect();
        known.sort_by(f64::total_cmp);
        // One bad stop among few raises the noise of all, so the median stands for the usual value.
        let usual = known.get(known.len() / 2).copied().unwrap_or(1.0).clamp(1e-6, 1.0);
        for (i, r) in ratios.iter().enumerate() {
            if out.as_ref().is_none_or(|o| r / usual > o.2) {
                out = Some((i, group, r / usual));
            }
        }
    }
    out
}
