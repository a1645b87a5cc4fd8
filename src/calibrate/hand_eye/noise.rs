//! In: pairs of robot poses and boards, a start. Out: the chain, its camera and the robot's noise, each fitted with
//! the others.
//! Frame and unit: see `closed`; mm, rad (docs/math.md, Hand-eye (6) to (9)).

use super::camera_belief::{CameraBelief, Sharpened};
use super::closed::{Chain, Pair};
use super::options::{HandEyeOptions, Mount, Noise};
use super::terms::{Refined, refine, robot_parts, with_camera};
use crate::calibrate::components::Components;
use crate::calibrate::measured_pose::pooled_factor;
use crate::camera::{PARAMETERS, Parameters};
use nalgebra::{DMatrix, DVector};

/// One round of variance components at a fitted chain.
///
/// The camera's own error moves all boards together. It is part of the known covariance, so that it is not attributed
/// to the robot's noise.
fn components(
    pairs: &[&Pair],
    chain: &Chain,
    noise: &Noise,
    mount: Mount,
    camera: &CameraBelief,
    o: &HandEyeOptions,
) -> Option<Noise> {
    let boards_open = open(pairs);
    let (mut model, parts) = model(pairs, chain, noise, mount, camera, o);
    // Below these values the robot's noise is negligible beside any camera's.
    let (floor_mm, floor_rad) = (1e-4f64, 1e-6f64);
    let (mut theta, mut floor) = (Vec::new(), Vec::new());
    let mut estimated = Vec::new();
    for (k, part) in parts.into_iter().enumerate() {
        let (given, now, low) = [
            (o.robot_sigma_mm.is_some(), noise.robot_mm, floor_mm),
            (o.robot_sigma_deg.is_some(), noise.robot_rad, floor_rad),
            (!boards_open, noise.feature_factor, floor_rad),
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
            *[&mut out.robot_mm, &mut out.robot_rad, &mut out.feature_factor][*k] = t.sqrt();
        }
    }
    Some(out)
}

/// The model of a chain's residuals without its parts, and its parts for a variance of 1: the robot's positions, its
/// rotations and the boards.
fn model(
    pairs: &[&Pair],
    chain: &Chain,
    noise: &Noise,
    mount: Mount,
    camera: &CameraBelief,
    o: &HandEyeOptions,
) -> (Components, [DMatrix<f64>; 3]) {
    let n = pairs.len() * 6;
    let mut model = Components {
        residual: DVector::zeros(n),
        jacobian: DMatrix::zeros(n, 12),
        known: DMatrix::zeros(n, n),
        parts: Vec::new(),
    };
    let mut parts = [DMatrix::zeros(n, n), DMatrix::zeros(n, n), DMatrix::zeros(n, n)];
    let boards_open = open(pairs);
    let mut by_camera = DMatrix::zeros(n, PARAMETERS);
    for (i, pair) in pairs.iter().enumerate() {
        let (e, j) = with_camera(chain, &Parameters::zeros(), pair, camera);
        let at = 6 * i;
        model.residual.rows_mut(at, 6).copy_from(&e);
        model.jacobian.view_mut((at, 0), (6, 12)).copy_from(&j.fixed_columns::<12>(0));
        by_camera.view_mut((at, 0), (6, PARAMETERS)).copy_from(&j.fixed_columns::<PARAMETERS>(12));
        let mut known = nalgebra::Matrix6::zeros();
        if boards_open {
            parts[2].view_mut((at, at), (6, 6)).copy_from(&pair.seen.covariance(1.0));
        } else {
            known += pair.seen.covariance(noise.feature_factor);
        }
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
    model.known += &by_camera * by_camera.transpose();
    (model, parts)
}

/// Whether the boards' own scatter is unknown: their poses were given without sigmas.
fn open(pairs: &[&Pair]) -> bool {
    pooled_factor(pairs.iter().map(|p| &p.seen)).is_none()
}

/// A fit of some pairs.
pub(in crate::calibrate) struct Fitted {
    pub refined: Refined,
    pub noise: Noise,
    /// The camera updated by the pairs' pixels, before the robot's poses are used.
    pub camera: Sharpened,
}

/// Alternates between fit and noise until both are stable. `None` if something is not determined.
pub(in crate::calibrate) fn fit(
    pairs: &[&Pair],
    start: &Chain,
    noise: Noise,
    mount: Mount,
    given: &CameraBelief,
    o: &HandEyeOptions,
) -> Option<Fitted> {
    let camera = given.after(pairs, noise.feature_factor)?;
    let (mut chain, mut noise) = (*start, noise);
    for _ in 0..30 {
        chain = refine(pairs, &chain, &noise, mount, &camera.belief)?.chain;
        let next = components(pairs, &chain, &noise, mount, &camera.belief, o)?;
        let settled = (next.robot_mm / noise.robot_mm - 1.0).abs() < 1e-3
            && (next.robot_rad / noise.robot_rad - 1.0).abs() < 1e-3
            && (next.feature_factor / noise.feature_factor - 1.0).abs() < 1e-3;
        noise = next;
        if settled {
            break;
        }
    }
    // Reaching the limit of rounds is no fault of the chain: for a robot whose noise is too small to be seen, the
    // estimate keeps shrinking.
    let refined = refine(pairs, &chain, &noise, mount, &camera.belief)?;
    Some(Fitted { refined, noise, camera })
}
