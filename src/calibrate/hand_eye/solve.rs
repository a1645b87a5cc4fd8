//! In: board poses with their information matrices and the robot's poses. Out: the hand-eye transform and the board's
//! pose on its carrier by joint maximum likelihood, with the robot's noise, covariance and hold-out errors.
//! Frame and unit: see `closed`; mm, rad (docs/math.md, Hand-eye (1) to (10)).

use super::camera_belief::CameraBelief;
use super::checks;
use super::closed::{Agreement, Pair, agree, canonical_order};
use super::fit::{HandEyeFit, PairResidual};
use super::noise::{Fitted, fit};
use super::options::{HandEyeOptions, Mount, Noise};
use super::otherwise;
use super::terms::{Refined, UNKNOWNS, refine, step_covariance, with_camera};
use crate::calibrate::measured_pose::pooled_factor;
use crate::camera::{CameraCovariance, Intrinsics, PARAMETERS};
use crate::fault::{Fault, Result};
use crate::geometry::Twist;
use nalgebra::{DMatrix, Matrix6, SMatrix};

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
    // If a pair alone determines a direction, its residual there is zero; its own noise is then used instead.
    let solve = |m: Matrix6<f64>| m.cholesky().map(|c| e.dot(&c.solve(&e)));
    solve(total).filter(|d| d.is_finite()).or_else(|| solve(own)).unwrap_or(f64::INFINITY)
}

fn chosen<'a>(pairs: &'a [Pair], used: &[usize]) -> Vec<&'a Pair> {
    used.iter().map(|&i| &pairs[i]).collect()
}

/// Fits the agreeing pairs, then those within the gate, until the set no longer changes. Returns their indices and
/// the fit.
fn settle(
    pairs: &[Pair],
    agreement: &Agreement,
    noise: Noise,
    mount: Mount,
    given: &CameraBelief,
    o: &HandEyeOptions,
) -> Option<(Vec<usize>, Fitted)> {
    let mut used = agreement.agreeing.clone();
    let mut found = fit(&chosen(pairs, &used), &agreement.chain, noise, mount, given, o)?;
    for _ in 0..10 {
        let keeps = |i: usize| distance2(&found, mount, &pairs[i], used.contains(&i)) <= o.gate;
        let next: Vec<usize> = (0..pairs.len()).filter(|&i| keeps(i)).collect();
        if next == used || next.len() < o.min_pairs {
            break;
        }
        used = next;
        found = fit(&chosen(pairs, &used), &found.refined.chain, found.noise, mount, given, o)?;
    }
    Some((used, found))
}

/// Solves for both unknowns of the chain. `camera` is the covariance of the camera's parameters
/// ([`crate::calibrate::measured_pose::intrinsic_covariance`]). The result does not depend on the order of the pairs.
pub fn solve(
    pairs: &[Pair],
    mount: Mount,
    camera: &CameraCovariance,
    model: &Intrinsics,
    o: &HandEyeOptions,
) -> Result<HandEyeFit> {
    o.check()?;
    checks::before(pairs, mount, o)?;
    let given = CameraBelief::given(camera);
    let mispaired = || otherwise::explain(pairs, "pictures and robot poses do not belong together".into(), mount, o);
    let agreement = start(pairs, o).map_err(|_| mispaired())?;
    let seen = || pairs.iter().map(|p| &p.seen);
    let scatter = agreement.spread.max(1e-3);
    // The scatter of the board's landmarks, expressed as a rotation at the board's distance.
    let turn = scatter / mean(seen().map(|s| s.centre().norm()));
    let noise = Noise {
        robot_mm: o.robot_sigma_mm.unwrap_or(scatter),
        robot_rad: o.robot_sigma_deg.map_or(turn, f64::to_radians),
        feature_factor: pooled_factor(seen()).unwrap_or(turn),
    };
    let (used, found) = settle(pairs, &agreement, noise, mount, &given, o).ok_or_else(mispaired)?;
    let residuals = pairs
        .iter()
        .enumerate()
        .map(|(i, pair)| {
            let without: Vec<usize> = used.iter().copied().filter(|&k| k != i).collect();
            let residual = residual(&found, pair, &chosen(pairs, &without), mount, &given, model);
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
    let mut fit = HandEyeFit {
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
        end: refined.end,
        left_out_fit: None,
        start: agreement,
    };
    fit.left_out_fit = checks::after(pairs, &fit, mount, o)?;
    Ok(fit)
}

/// Residuals of a pair in the fit to all, and in the fit to the others.
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
        // The board as seen by that camera: px and mm then do not contain the difference between the cameras.
        let change = belief.mean + belief.root * r.z;
        let mut seen = pair.seen.clone();
        seen.camera_from_board = Twist::new((seen.by_intrinsics * change).as_slice()).moved(&seen.camera_from_board);
        let expected = r.chain.expected(&pair.near_from_far);
        (seen.displacement_px(&expected, &model.changed(&change)), seen.displacement(&expected))
    };
    let (px, mm) = off(&fit.refined, &fit.camera.belief);
    let (holdout_px, holdout_mm) = held_out.map_or((f64::INFINITY, f64::INFINITY), |(r, b)| off(&r, &b));
    PairResidual { name: pair.seen.name.clone(), used: false, distance2: 0.0, px, mm, holdout_px, holdout_mm }
}

/// The closed form on the pairs in an order that does not depend on the recording.
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
