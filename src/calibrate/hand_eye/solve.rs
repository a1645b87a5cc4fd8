//! In: board poses with their information and the robot's poses. Out: the hand-eye transform and the
//! board's place by joint maximum likelihood, with the robot's noise, covariance and hold-out errors.
//! Frame and unit: see `closed`; mm, rad (docs/math.md, Hand-eye (1) to (10)).

use super::camera_belief::CameraBelief;
use super::checks;
use super::closed::{Agreement, Chain, Far, Near, Pair, agree, canonical_order};
use super::noise::{Fitted, fit};
use super::terms::{Refined, UNKNOWNS, refine, step_covariance, with_camera};
use crate::calibrate::measured_pose::{moved, pooled_factor};
use crate::camera::{Intrinsics, PARAMETERS, ParameterCovariance};
use crate::fault::{Fault, Result};
use crate::geometry::{Rigid, Vec3};
use nalgebra::{DMatrix, Matrix6, SMatrix};

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct HandEyeOptions {
    /// Sigma of the robot's position per axis, mm; `None`: estimated. 1e-6..=10.
    pub robot_sigma_mm: Option<f64>,
    /// Sigma of the robot's orientation per axis, degrees; `None`: estimated. 1e-7..=5.
    pub robot_sigma_deg: Option<f64>,
    /// A pair is wrong where its squared Mahalanobis distance (6 degrees of freedom) exceeds this;
    /// 26.1 leaves one good pair in 5,000 out. 12..=1000.
    pub gate: f64,
    /// Rotation about the second axis (rms over all motions) below which the result is refused, degrees; 0.1..=30.
    pub min_second_axis_deg: f64,
    /// Fewest agreeing pairs; 3..=1000.
    pub min_pairs: usize,
    /// What states the board's lengths, as a message names it.
    pub board_length: String,
    /// Seed of the draws among more than 25 pairs.
    pub seed: u64,
}

impl Default for HandEyeOptions {
    fn default() -> Self {
        HandEyeOptions {
            robot_sigma_mm: None,
            robot_sigma_deg: None,
            gate: 26.1,
            min_second_axis_deg: 3.0,
            min_pairs: 4,
            board_length: "the board's description".into(),
            seed: 1,
        }
    }
}

impl HandEyeOptions {
    pub fn check(&self) -> Result<()> {
        let bad = |name: &str, value: f64, range: &str| {
            Err(Fault::usage(format!("{name} is {value}, {range} is allowed")).next("choose a value in that range"))
        };
        if let Some(s) = self.robot_sigma_mm.filter(|s| !(1e-6..=10.0).contains(s)) {
            return bad("robot_sigma_mm", s, "1e-6 to 10");
        }
        if let Some(s) = self.robot_sigma_deg.filter(|s| !(1e-7..=5.0).contains(s)) {
            return bad("robot_sigma_deg", s, "1e-7 to 5");
        }
        if !(12.0..=1000.0).contains(&self.gate) {
            return bad("gate", self.gate, "12 to 1000");
        }
        if !(0.1..=30.0).contains(&self.min_second_axis_deg) {
            return bad("min_second_axis_deg", self.min_second_axis_deg, "0.1 to 30");
        }
        if !(3..=1000).contains(&self.min_pairs) {
            return bad("min_pairs", self.min_pairs as f64, "3 to 1000");
        }
        Ok(())
    }
}

/// Standard deviations of the robot's reported poses per axis, and the factor of the features' sigmas; for board poses
/// that were given without sigmas the factor is their turn's, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    pub robot_mm: f64,
    pub robot_rad: f64,
    pub feature_factor: f64,
}

/// Where the flange is, as the noise of its pose moves the board in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mount {
    EyeInHand,
    EyeToHand,
}

impl Mount {
    /// The flange's origin in the camera frame.
    pub(in crate::calibrate) fn flange(self, chain: &Chain, near_from_far: &Rigid<Near, Far>) -> Vec3 {
        match self {
            Mount::EyeInHand => chain.near_from_camera.inverse().translation,
            Mount::EyeToHand => (chain.near_from_camera.inverse() * *near_from_far).translation,
        }
    }
}

/// How one pair fits: its step from the expected to the seen board pose.
#[derive(Clone, Debug)]
pub struct PairResidual {
    pub name: String,
    /// In the fit; false: it disagreed and was left out.
    pub used: bool,
    /// Squared Mahalanobis distance, 6 degrees of freedom.
    pub distance2: f64,
    /// Board corners, rms: px in the picture and mm in space.
    pub px: f64,
    pub mm: f64,
    /// The same with the pair left out of the fit.
    pub holdout_px: f64,
    pub holdout_mm: f64,
}

/// What [`solve`] found.
#[derive(Clone, Debug)]
pub struct HandEyeFit {
    pub chain: Chain,
    /// Covariance of 12 numbers: translation (mm) and left rotation (rad) of near_from_camera in
    /// the near frame, then of far_from_board in the far frame. Camera uncertainty included.
    pub covariance: DMatrix<f64>,
    /// The 12 numbers by the given camera's z: how the result follows the camera it was given.
    pub by_camera: SMatrix<f64, 12, PARAMETERS>,
    /// The camera that was given, as a belief about itself.
    pub camera: Intrinsics,
    pub given: CameraBelief,
    /// The camera that all pixels and poses together speak for, and the covariance of the 12 numbers and of its
    /// parameters.
    pub joint_camera: Intrinsics,
    pub joint_covariance: DMatrix<f64>,
    /// Squared Mahalanobis distance between the given camera and what these pictures say of it, and its freedom.
    pub camera_surprise: (f64, f64),
    pub noise: Noise,
    /// One per pair, in the order given.
    pub pairs: Vec<PairResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// The closed form that it started from.
    pub start: Agreement,
}

fn undetermined() -> Fault {
    Fault::refused("the hand-eye transform is not determined by these poses")
        .cause("the flange turned about one axis only, or hardly at all")
        .next("turn the flange about a second axis by 20 degrees or more and take more pictures")
}

/// Squared Mahalanobis distance of a pair from a chain that was fitted with or without it.
fn distance2(fit: &Fitted, mount: Mount, pair: &Pair, used: bool) -> f64 {
    let (e, j) = with_camera(&fit.refined.chain, &fit.refined.z, pair, &fit.camera.belief);
    let own = step_covariance(&fit.refined.chain, pair, &fit.noise, mount);
    let fitted = j * fit.refined.covariance * j.transpose();
    let total = if used { own - fitted } else { own + fitted };
    // Where a pair determines a direction alone its residual there is zero: its own noise stands in.
    let solve = |m: Matrix6<f64>| m.cholesky().map(|c| e.dot(&c.solve(&e)));
    solve(total).filter(|d| d.is_finite()).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}

/// Solves for both unknowns of the chain. `camera` is the covariance of the camera's parameters
/// ([`crate::calibrate::measured_pose::intrinsic_covariance`]). The result does not depend on the pairs' order.
pub fn solve(
    pairs: &[Pair],
    mount: Mount,
    camera: &ParameterCovariance,
    model: &Intrinsics,
    o: &HandEyeOptions,
) -> Result<HandEyeFit> {
    o.check()?;
    checks::before(pairs, o)?;
    let given = CameraBelief::given(camera);
    let mispaired = || checks::explain(pairs, "pictures and robot poses do not belong together".into(), o);
    let agreement = start(pairs, o).map_err(|_| mispaired())?;
    let seen = || pairs.iter().map(|p| &p.seen);
    let scatter = agreement.spread.max(1e-3);
    // The scatter of the board's corners seen as a rotation over the board's distance.
    let turn = scatter / mean(seen().map(|s| s.centre().norm()));
    let noise = Noise {
        robot_mm: o.robot_sigma_mm.unwrap_or(scatter),
        robot_rad: o.robot_sigma_deg.map_or(turn, f64::to_radians),
        feature_factor: pooled_factor(seen()).unwrap_or(turn),
    };
    let chosen = |used: &[usize]| -> Vec<&Pair> { used.iter().map(|&i| &pairs[i]).collect() };
    let mut used = agreement.agreeing.clone();
    let mut found = fit(&chosen(&used), &agreement.chain, noise, mount, &given, o).ok_or_else(mispaired)?;
    for _ in 0..10 {
        let keeps = |i: usize| distance2(&found, mount, &pairs[i], used.contains(&i)) <= o.gate;
        let next: Vec<usize> = (0..pairs.len()).filter(|&i| keeps(i)).collect();
        if next == used || next.len() < o.min_pairs {
            break;
        }
        used = next;
        found = fit(&chosen(&used), &found.refined.chain, found.noise, mount, &given, o).ok_or_else(mispaired)?;
    }
    let residuals = pairs
        .iter()
        .enumerate()
        .map(|(i, pair)| {
            let without: Vec<usize> = used.iter().copied().filter(|&k| k != i).collect();
            let residual = residual(&found, pair, &chosen(&without), mount, &given, model);
            PairResidual {
                used: used.contains(&i),
                distance2: distance2(&found, mount, pair, used.contains(&i)),
                ..residual
            }
        })
        .collect();
    let freedom = (used.len() * 6) as f64 - 12.0;
    let Fitted { refined, noise, camera } = found;
    let c = refined.covariance;
    // From the camera's z to its parameters.
    let mut to_parameters = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::identity();
    to_parameters.fixed_view_mut::<PARAMETERS, PARAMETERS>(12, 12).copy_from(&camera.belief.root);
    let joint = to_parameters * c * to_parameters.transpose();
    let fit = HandEyeFit {
        chain: refined.chain,
        covariance: DMatrix::from_fn(12, 12, |i, j| c[(i, j)]),
        by_camera: c.fixed_view::<12, PARAMETERS>(0, 12) * camera.by_given,
        camera: *model,
        given,
        joint_camera: model.changed(&(camera.belief.mean + camera.belief.root * refined.z)),
        joint_covariance: DMatrix::from_column_slice(UNKNOWNS, UNKNOWNS, joint.as_slice()),
        camera_surprise: (camera.surprise, camera.freedom),
        noise,
        pairs: residuals,
        chi2: refined.cost / freedom.max(1.0),
        start: agreement,
    };
    checks::after(pairs, &fit, o)?;
    Ok(fit)
}

/// How a pair fits the whole, and how the others predict it.
fn residual(
    fit: &Fitted,
    pair: &Pair,
    others: &[&Pair],
    mount: Mount,
    given: &CameraBelief,
    model: &Intrinsics,
) -> PairResidual {
    let held_out = given
        .after(others, fit.noise.feature_factor)
        .and_then(|c| Some((refine(others, &fit.refined.chain, &fit.noise, mount, &c.belief)?, c.belief)));
    let off = |r: &Refined, belief: &CameraBelief| {
        // The board as that camera sees it: px and mm are then free of what the cameras differ by.
        let change = belief.mean + belief.root * r.z;
        let mut seen = pair.seen.clone();
        seen.camera_from_board = moved(&seen.camera_from_board, (seen.by_intrinsics * change).as_slice());
        let expected = r.chain.expected(&pair.near_from_far);
        (seen.displacement_px(&expected, &model.changed(&change)), seen.displacement(&expected))
    };
    let (px, mm) = off(&fit.refined, &fit.camera.belief);
    let (holdout_px, holdout_mm) = held_out.map_or((f64::INFINITY, f64::INFINITY), |(r, b)| off(&r, &b));
    PairResidual { name: pair.seen.name.clone(), used: false, distance2: 0.0, px, mm, holdout_px, holdout_mm }
}

/// The closed form in an order that does not depend on the recording's.
fn start(pairs: &[Pair], o: &HandEyeOptions) -> Result<Agreement> {
    let order = canonical_order(pairs);
    let sorted: Vec<Pair> = order.iter().map(|&i| pairs[i].clone()).collect();
    let mut found = agree(&sorted, o.seed).ok_or_else(undetermined)?;
    found.agreeing = found.agreeing.iter().map(|&i| order[i]).collect();
    found.agreeing.sort_unstable();
    Ok(found)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (s, n) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
    s / f64::max(n, 1.0)
}
