//! In: a chain, pairs, noise. Out: the steps between seen and expected boards with their derivatives and covariance,
//! and the chain that minimises them.
//! Frame and unit: see `closed`; mm, rad (docs/math.md, Hand-eye (6), (7), (9)).

use super::camera_belief::CameraBelief;
use super::closed::{Chain, Pair};
use super::options::{Mount, Noise};
use crate::camera::{PARAMETERS, Parameters};
use crate::geometry::{LeftStep, Mat3, Twist, Vec3, skew};
use crate::solve::{End, LmOptions, Problem, Residuals, lm};
use nalgebra::{Matrix6, SMatrix, Vector6};

/// Step of one pair and its derivatives by the 12 unknowns, at the present chain.
pub(in crate::calibrate) fn jacobian(chain: &Chain, pair: &Pair) -> (SMatrix<f64, 6, 1>, SMatrix<f64, 6, 12>) {
    let expected = chain.expected(&pair.near_from_far);
    let e = Twist::between(&pair.seen.camera_from_board, &expected).vector();
    let camera_from_near = chain.near_from_camera.rotation.transpose();
    let camera_from_far = camera_from_near * pair.near_from_far.rotation;
    let shift = skew(&Vec3::new(e[0], e[1], e[2]));
    // Camera's side: w = -R_Xᵀ r and v = -R_Xᵀ dt. Board's side: w = A r and v = A dt + g × A r, with g the board's
    // origin in the camera frame. The preceding step adds w × its translation.
    let mut j = SMatrix::<f64, 6, 12>::zeros();
    j.fixed_view_mut::<3, 3>(0, 0).copy_from(&-camera_from_near);
    j.fixed_view_mut::<3, 3>(0, 3).copy_from(&(shift * camera_from_near));
    j.fixed_view_mut::<3, 3>(3, 3).copy_from(&-camera_from_near);
    j.fixed_view_mut::<3, 3>(0, 6).copy_from(&camera_from_far);
    let g = skew(&expected.translation) - shift;
    j.fixed_view_mut::<3, 3>(0, 9).copy_from(&(g * camera_from_far));
    j.fixed_view_mut::<3, 3>(3, 9).copy_from(&camera_from_far);
    (e, j)
}

/// Covariances of a step by the robot's translation and by its rotation, each for a sigma of 1.
pub(in crate::calibrate) fn robot_parts(flange: &Vec3) -> [Matrix6<f64>; 2] {
    let f = skew(flange);
    let mut translation = Matrix6::zeros();
    translation.fixed_view_mut::<3, 3>(0, 0).copy_from(&Mat3::identity());
    let mut rotation = Matrix6::zeros();
    rotation.fixed_view_mut::<3, 3>(0, 0).copy_from(&(f * f.transpose()));
    rotation.fixed_view_mut::<3, 3>(0, 3).copy_from(&f);
    rotation.fixed_view_mut::<3, 3>(3, 0).copy_from(&f.transpose());
    rotation.fixed_view_mut::<3, 3>(3, 3).copy_from(&Mat3::identity());
    [translation, rotation]
}

pub(in crate::calibrate) fn step_covariance(chain: &Chain, pair: &Pair, noise: &Noise, mount: Mount) -> Matrix6<f64> {
    let [t, r] = robot_parts(&mount.flange(chain, &pair.near_from_far));
    pair.seen.covariance(noise.feature_factor) + t * noise.robot_mm.powi(2) + r * noise.robot_rad.powi(2)
}

/// The refinement. The robot's true poses are eliminated in closed form, which leaves whitened steps of six numbers
/// per pair, and the camera's parameters (docs/math.md, Hand-eye (6), (7), (9)).
struct Refinement<'a> {
    pairs: &'a [&'a Pair],
    /// Inverse Cholesky factors of the steps' covariances.
    whiteners: Vec<Matrix6<f64>>,
    camera: &'a CameraBelief,
    /// The free unknowns; directions of the camera's z without any effect are held fixed.
    free: Vec<usize>,
}

/// Number of unknowns: twelve of the chain, and the camera's.
pub(in crate::calibrate) const UNKNOWNS: usize = 12 + PARAMETERS;

/// A refined chain with the camera that was fitted with it.
pub(in crate::calibrate) struct Refined {
    pub chain: Chain,
    /// The camera's z in its belief.
    pub z: Parameters,
    /// Covariance of the chain's twelve parameters and the camera's z.
    pub covariance: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    pub cost: f64,
    /// Whether the fit is a minimum.
    pub end: End,
}

/// Steps from the boards, as seen by the camera `mean + root z`, to the expected ones, with derivatives by all
/// unknowns.
pub(in crate::calibrate) fn with_camera(
    chain: &Chain,
    z: &Parameters,
    pair: &Pair,
    camera: &CameraBelief,
) -> (Vector6<f64>, SMatrix<f64, 6, UNKNOWNS>) {
    let (e, j) = jacobian(chain, pair);
    let follow = pair.seen.by_intrinsics;
    let mut all = SMatrix::<f64, 6, UNKNOWNS>::zeros();
    all.fixed_columns_mut::<12>(0).copy_from(&j);
    all.fixed_columns_mut::<PARAMETERS>(12).copy_from(&-(follow * camera.root));
    (e - follow * (camera.mean + camera.root * z), all)
}

impl Problem for Refinement<'_> {
    type State = (Chain, Parameters);
    fn width(&self) -> usize {
        UNKNOWNS
    }
    fn moved(&self, (c, z): &Self::State, s: &[f64]) -> Self::State {
        let chain = Chain {
            near_from_camera: LeftStep::new(s).moved(&c.near_from_camera),
            far_from_board: LeftStep::new(&s[6..]).moved(&c.far_from_board),
        };
        (chain, z + Parameters::from_column_slice(&s[12..]))
    }
    fn residuals(&self, (chain, z): &Self::State, out: &mut Residuals) -> Option<()> {
        for (pair, w) in self.pairs.iter().zip(&self.whiteners) {
            let (e, j) = with_camera(chain, z, pair, self.camera);
            let r = w * e;
            let j = (w * j).transpose();
            let rows: Vec<f64> = j.column_iter().flat_map(|row| self.free.iter().map(move |&i| row[i])).collect();
            out.group(r.as_slice(), &self.free, &rows);
        }
        for &i in &self.free[12..] {
            out.prior(&[z[i - 12]], &[i], &[1.0]);
        }
        Some(())
    }
}

pub(in crate::calibrate) fn refine(
    pairs: &[&Pair],
    start: &Chain,
    noise: &Noise,
    mount: Mount,
    camera: &CameraBelief,
) -> Option<Refined> {
    let whiteners = pairs
        .iter()
        .map(|p| step_covariance(start, p, noise, mount).cholesky()?.l().try_inverse())
        .collect::<Option<Vec<_>>>()?;
    let free: Vec<usize> = (0..12).chain(camera.directions().into_iter().map(|i| 12 + i)).collect();
    let hold = (0..UNKNOWNS).filter(|i| !free.contains(i)).collect();
    let options = LmOptions { hold, ..LmOptions::default() };
    let (found, end) =
        lm(&Refinement { pairs, whiteners, camera, free }, (*start, Parameters::zeros()), &options).ended()?;
    let cost = found.lengths.iter().map(|l| l * l).sum();
    let covariance = found.covariance?.fixed_view::<UNKNOWNS, UNKNOWNS>(0, 0).into();
    Some(Refined { chain: found.state.0, z: found.state.1, covariance, cost, end })
}
