//! In: board poses with their information and the robot's poses. Out: the hand-eye transform and the
//! board's place by joint maximum likelihood, with the robot's noise, covariance and hold-out errors.
//! Frame and unit: see `hand_eye_closed`; mm, rad (docs/math.md, Hand-eye (1) to (10)).

use super::components::Components;
use super::hand_eye_checks as checks;
use super::hand_eye_closed::{Agreement, Chain, Far, Near, Pair, agree, canonical_order};
use super::hand_eye_terms::{jacobian, refine, robot_parts, step_covariance};
use super::measured_pose::pooled_factor;
use crate::fault::{Fault, Result};
use crate::geometry::{Rigid, Vec3};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix};

/// Settings of [`solve`].
#[derive(Clone, Debug)]
pub struct HandEyeOptions {
    /// Sigma of the robot's position per axis, mm; `None`: estimated. 1e-6..=10.
    pub robot_sigma_mm: Option<f64>,
    /// Sigma of the robot's orientation per axis, degrees; `None`: estimated. 1e-7..=5.
    pub robot_sigma_deg: Option<f64>,
    /// An estimated robot noise above this means that pictures and poses do not belong together, mm; above 0.
    pub max_robot_sigma_mm: f64,
    /// The same for orientation, degrees; above 0.
    pub max_robot_sigma_deg: f64,
    /// A pair is wrong where its squared Mahalanobis distance (6 degrees of freedom) exceeds this;
    /// 26.1 leaves one good pair in 5,000 out. 12..=1000.
    pub gate: f64,
    /// Rotation about the second axis (rms over all motions) below which the result is refused, degrees; 0.1..=30.
    pub min_second_axis_deg: f64,
    /// Fewest agreeing pairs; 3..=1000.
    pub min_pairs: usize,
    /// Seed of the draws among more than 25 pairs.
    pub seed: u64,
}

impl Default for HandEyeOptions {
    fn default() -> Self {
        HandEyeOptions {
            robot_sigma_mm: None,
            robot_sigma_deg: None,
            max_robot_sigma_mm: 1.0,
            max_robot_sigma_deg: 0.5,
            gate: 26.1,
            min_second_axis_deg: 3.0,
            min_pairs: 4,
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
        if !(self.max_robot_sigma_mm > 0.0) {
            return bad("max_robot_sigma_mm", self.max_robot_sigma_mm, "above 0");
        }
        if !(self.max_robot_sigma_deg > 0.0) {
            return bad("max_robot_sigma_deg", self.max_robot_sigma_deg, "above 0");
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

/// Standard deviations of the robot's reported poses per axis, and the factor of the features' sigmas.
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
    pub(super) fn flange(self, chain: &Chain, near_from_far: &Rigid<Near, Far>) -> Vec3 {
        match self {
            Mount::EyeInHand => chain.near_from_camera.inverse().translation,
            Mount::EyeToHand => (chain.near_from_camera.inverse() * *near_from_far).translation,
        }
    }
}

/// What is known beforehand: where the camera is, and the covariance of its parameters.
struct Given {
    mount: Mount,
    camera: SMatrix<f64, 9, 9>,
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
    /// The part of it that the pictures and the robot's noise make, the camera taken as exact.
    pub covariance_camera_exact: DMatrix<f64>,
    /// The 12 numbers by the nine camera parameters: how the result follows the camera it was given.
    pub by_camera: SMatrix<f64, 12, 9>,
    /// The camera that was held, and the covariance of its parameters.
    pub camera: crate::camera::Intrinsics,
    pub camera_covariance: SMatrix<f64, 9, 9>,
    pub noise: Noise,
    /// One per pair, in the order given.
    pub pairs: Vec<PairResidual>,
    /// Squared Mahalanobis distances over their degrees of freedom; near 1.
    pub chi2: f64,
    /// The closed form that it started from.
    pub start: Agreement,
}

/// One round of variance components at a fitted chain.
///
/// The camera's own error moves all boards together; it is part of the known covariance, so that
/// it is not taken for noise of the robot.
fn components(pairs: &[&Pair], chain: &Chain, noise: &Noise, given: &Given, o: &HandEyeOptions) -> Option<Noise> {
    let mount = given.mount;
    let n = pairs.len() * 6;
    let mut model = Components {
        residual: DVector::zeros(n),
        jacobian: DMatrix::zeros(n, 12),
        known: DMatrix::zeros(n, n),
        parts: Vec::new(),
    };
    let mut parts = [DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
    for (i, pair) in pairs.iter().enumerate() {
        let (e, j) = jacobian(chain, pair);
        let at = 6 * i;
        model.residual.rows_mut(at, 6).copy_from(&e);
        model.jacobian.view_mut((at, 0), (6, 12)).copy_from(&j);
        let mut known = pair.seen.covariance(noise.feature_factor);
        let [t, r] = robot_parts(&mount.flange(chain, &pair.near_from_far));
        for (k, (part, given)) in
            [(t, o.robot_sigma_mm), (r, o.robot_sigma_deg.map(f64::to_radians))].into_iter().enumerate()
        {
            match given {
                Some(s) => known += part * (s * s),
                None => parts[k].view_mut((at, at), (6, 6)).copy_from(&part),
            }
        }
        model.known.view_mut((at, at), (6, 6)).copy_from(&known);
    }
    let mut by_camera = DMatrix::zeros(n, 9);
    for (i, pair) in pairs.iter().enumerate() {
        by_camera.view_mut((6 * i, 0), (6, 9)).copy_from(&pair.seen.by_intrinsics);
    }
    model.known += &by_camera * DMatrix::from_column_slice(9, 9, given.camera.as_slice()) * by_camera.transpose();
    // Below these the robot's noise no longer matters beside any camera's.
    let (floor_mm, floor_rad) = (1e-4f64, 1e-6f64);
    let (mut theta, mut floor) = (Vec::new(), Vec::new());
    let mut estimated = Vec::new();
    for (k, part) in parts.into_iter().enumerate() {
        let (given, now, low) = [
            (o.robot_sigma_mm.is_some(), noise.robot_mm, floor_mm),
            (o.robot_sigma_deg.is_some(), noise.robot_rad, floor_rad),
        ][k];
        if !given {
            model.parts.push(part);
            theta.push(now * now);
            floor.push(low * low);
            estimated.push(k);
        }
    }
    let mut out = Noise {
        robot_mm: o.robot_sigma_mm.unwrap_or(noise.robot_mm),
        robot_rad: o.robot_sigma_deg.map_or(noise.robot_rad, f64::to_radians),
        ..*noise
    };
    if !theta.is_empty() {
        let next = model.step(&theta, &floor)?;
        for (k, t) in estimated.iter().zip(next) {
            *[&mut out.robot_mm, &mut out.robot_rad][*k] = t.sqrt();
        }
    }
    Some(out)
}

fn undetermined() -> Fault {
    Fault::refused("the hand-eye transform is not determined by these poses")
        .cause("the flange turned about one axis only, or hardly at all")
        .next("turn the flange about a second axis by 20 degrees or more and take more pictures")
}

/// Alternates the fit and the noise until both stand still.
fn fit(
    pairs: &[&Pair],
    start: &Chain,
    noise: Noise,
    given: &Given,
    o: &HandEyeOptions,
) -> Result<(Chain, DMatrix<f64>, f64, Noise)> {
    let (mut chain, mut noise) = (*start, noise);
    for _ in 0..30 {
        chain = refine(pairs, &chain, &noise, given.mount).ok_or_else(undetermined)?.0;
        let next = components(pairs, &chain, &noise, given, o).ok_or_else(undetermined)?;
        let settled = (next.robot_mm / noise.robot_mm - 1.0).abs() < 1e-3
            && (next.robot_rad / noise.robot_rad - 1.0).abs() < 1e-3;
        noise = next;
        if settled {
            break;
        }
    }
    let (chain, covariance, cost) = refine(pairs, &chain, &noise, given.mount).ok_or_else(undetermined)?;
    Ok((chain, covariance, cost, noise))
}

/// d(12 unknowns)/d(camera): the boards' poses move with the camera, and the fit follows them.
fn by_camera(
    pairs: &[&Pair],
    chain: &Chain,
    covariance: &DMatrix<f64>,
    noise: &Noise,
    mount: Mount,
) -> Option<SMatrix<f64, 12, 9>> {
    let mut cross = SMatrix::<f64, 12, 9>::zeros();
    for pair in pairs {
        let (_, j) = jacobian(chain, pair);
        cross += j.transpose() * step_covariance(chain, pair, noise, mount).try_inverse()? * pair.seen.by_intrinsics;
    }
    let c: SMatrix<f64, 12, 12> = covariance.fixed_view::<12, 12>(0, 0).into();
    Some(c * cross)
}

/// A fit that pairs are judged by.
struct Judge<'a> {
    chain: &'a Chain,
    covariance: &'a DMatrix<f64>,
    noise: &'a Noise,
    given: &'a Given,
    by_camera: SMatrix<f64, 12, 9>,
}

/// Squared Mahalanobis distance of a pair from a chain that was fitted with or without it.
fn distance2(judge: &Judge<'_>, pair: &Pair, used: bool) -> f64 {
    let Judge { chain, covariance, noise, given, by_camera } = judge;
    let (e, j) = jacobian(chain, pair);
    // What the camera's error leaves after the fit has followed it.
    let left = j * by_camera - pair.seen.by_intrinsics;
    let own = step_covariance(chain, pair, noise, given.mount) + left * given.camera * left.transpose();
    let fitted = {
        let c: SMatrix<f64, 12, 12> = covariance.fixed_view::<12, 12>(0, 0).into();
        j * c * j.transpose()
    };
    let total = if used { own - fitted } else { own + fitted };
    // Where a pair determines a direction alone its residual there is zero: its own noise stands in.
    let solve = |m: Matrix6<f64>| m.cholesky().map(|c| e.dot(&c.solve(&e)));
    solve(total).filter(|d| d.is_finite()).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}

/// Solves for both unknowns of the chain. `camera` is the covariance of the camera's parameters
/// ([`super::measured_pose::intrinsic_covariance`]). The result does not depend on the pairs' order.
pub fn solve(
    pairs: &[Pair],
    mount: Mount,
    camera: &SMatrix<f64, 9, 9>,
    model: &crate::camera::Intrinsics,
    o: &HandEyeOptions,
) -> Result<HandEyeFit> {
    o.check()?;
    checks::before(pairs, o)?;
    let given = Given { mount, camera: *camera };
    let mispaired = |_| checks::explain(pairs, "pictures and robot poses do not belong together".into(), o);
    let agreement = start(pairs, o).map_err(mispaired)?;
    let seen: Vec<_> = pairs.iter().map(|p| p.seen.clone()).collect();
    let scatter = agreement.spread.max(1e-3);
    let mut noise = Noise {
        robot_mm: o.robot_sigma_mm.unwrap_or(scatter),
        // The scatter of the board's corners seen as a rotation over the board's distance.
        robot_rad: o.robot_sigma_deg.map_or(scatter / mean(seen.iter().map(|s| s.centre().norm())), f64::to_radians),
        feature_factor: pooled_factor(&seen),
    };
    let mut used = agreement.agreeing.clone();
    let mut chain = agreement.chain;
    let (mut covariance, mut cost);
    let mut rounds = 0;
    loop {
        let chosen: Vec<&Pair> = used.iter().map(|&i| &pairs[i]).collect();
        (chain, covariance, cost, noise) = fit(&chosen, &chain, noise, &given, o).map_err(mispaired)?;
        rounds += 1;
        let by_camera = by_camera(&chosen, &chain, &covariance, &noise, mount).ok_or_else(undetermined)?;
        let judge = Judge { chain: &chain, covariance: &covariance, noise: &noise, given: &given, by_camera };
        let keeps = |i: usize| distance2(&judge, &pairs[i], used.contains(&i)) <= o.gate;
        let next: Vec<usize> = (0..pairs.len()).filter(|&i| keeps(i)).collect();
        if next == used || rounds == 10 || next.len() < o.min_pairs {
            break;
        }
        used = next;
    }
    let chosen: Vec<&Pair> = used.iter().map(|&i| &pairs[i]).collect();
    let by_camera = by_camera(&chosen, &chain, &covariance, &noise, mount).ok_or_else(undetermined)?;
    let judge = Judge { chain: &chain, covariance: &covariance, noise: &noise, given: &given, by_camera };
    let followed = by_camera * camera * by_camera.transpose();
    let whole = &covariance + DMatrix::from_column_slice(12, 12, followed.as_slice());
    let residuals = pairs
        .iter()
        .enumerate()
        .map(|(i, pair)| {
            let without: Vec<&Pair> = used.iter().filter(|&&k| k != i).map(|&k| &pairs[k]).collect();
            let left_out = refine(&without, &chain, &noise, mount).map(|f| f.0);
            let inside = chain.expected(&pair.near_from_far);
            let outside = left_out.map(|c| c.expected(&pair.near_from_far));
            PairResidual {
                name: pair.seen.name.clone(),
                used: used.contains(&i),
                distance2: distance2(&judge, pair, used.contains(&i)),
                px: pair.seen.displacement_px(&inside, model),
                mm: pair.seen.displacement(&inside),
                holdout_px: outside.map_or(f64::INFINITY, |t| pair.seen.displacement_px(&t, model)),
                holdout_mm: outside.map_or(f64::INFINITY, |t| pair.seen.displacement(&t)),
            }
        })
        .collect();
    let freedom = (used.len() * 6) as f64 - 12.0;
    let fit = HandEyeFit {
        chain,
        covariance: whole,
        covariance_camera_exact: covariance,
        by_camera,
        camera: *model,
        camera_covariance: *camera,
        noise,
        pairs: residuals,
        chi2: cost / freedom.max(1.0),
        start: agreement,
    };
    checks::after(pairs, &fit, o)?;
    Ok(fit)
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
