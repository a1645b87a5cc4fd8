//! In: a joint solve. Out: the source that limits a scanned point's error, and whether the misfits of the robot's
//! poses are noise or follow the arm's configuration (link lengths, joint zeros).
//! Frame and unit: mm, degrees (docs/math.md, Joint calibration (11)).

use super::options::JointOptions;
use super::shots::Part;
use super::solve::JointFit;
use super::terms::link;
use super::volume::expected;
use crate::geometry::{Base, Flange, Rigid};
use nalgebra::{DMatrix, DVector};
use rand::{SeedableRng, seq::SliceRandom};

/// Contribution of each source to the error of a scanned point, rms, mm, the largest first; the squares add up to the
/// total.
pub fn by_part(fit: &JointFit, weights: &DMatrix<f64>) -> Vec<(Part, f64)> {
    let mut all: Vec<(Part, f64)> =
        Part::ALL.into_iter().zip(&fit.shares).map(|(p, share)| (p, expected(weights, share))).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all
}

/// How well the arm's misfits at some poses predict those at excluded poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Systematic {
    /// Share of the squared misfit at an excluded pose that the others predict; zero or negative for noise.
    pub predicted: f64,
    /// The largest such share among random permutations of the same misfits.
    pub by_chance: f64,
}

impl Systematic {
    /// Whether the arm's errors follow its pose. The part of the noise that the fit absorbed makes the misfits less
    /// predictable than permuted ones, never more.
    pub fn found(&self) -> bool {
        self.predicted > self.by_chance
    }
}

/// Smallest number of poses for this test.
const FEWEST: usize = 15;
/// Number of permutations; noise exceeds the largest of 40 by chance once in 41 times.
const DEALS: u64 = 40;
/// Ridge weight of the smooth function's coefficients against the misfits: the part that follows the pose is assumed
/// to be as large as the part that does not.
const RIDGE: f64 = 1.0;

/// Excludes each pose in turn and predicts its misfit from the others, by a function that is linear in the flange's
/// position and in the elements of its rotation. `None` with too few poses.
pub fn systematic(fit: &JointFit, o: &JointOptions) -> Option<Systematic> {
    let placed: Vec<(Rigid<Base, Flange>, [f64; 6])> = fit
        .shots
        .iter()
        .zip(&fit.state.boards)
        .filter_map(|(shot, board)| {
            let r = shot.robot?;
            let e = link(o.mount, &fit.state.near_from_camera, &fit.state.far_from_board[r.place], board, &r.pose).e;
            let sigma = |k: usize| if k < 3 { fit.noise.robot_mm } else { fit.noise.robot_rad };
            Some((r.pose, std::array::from_fn(|k| e[k] / sigma(k))))
        })
        .collect();
    if placed.len() < FEWEST {
        return None;
    }
    let leave = prediction(&placed.iter().map(|p| p.0).collect::<Vec<_>>())?;
    let share = |order: &[usize]| {
        let (mut missed, mut all) = (0.0, 0.0);
        for k in 0..6 {
            let e = DVector::from_iterator(order.len(), order.iter().map(|&i| placed[i].1[k]));
            let rest = &e - &leave * &e;
            missed += rest.norm_squared();
            all += e.norm_squared();
        }
        1.0 - missed / all
    };
    let mut order: Vec<usize> = (0..placed.len()).collect();
    let predicted = share(&order);
    let mut rng = rand_pcg::Pcg64::seed_from_u64(1);
    let by_chance = (0..DEALS).map(|_| {
        order.shuffle(&mut rng);
        share(&order)
    });
    Some(Systematic { predicted, by_chance: by_chance.fold(f64::NEG_INFINITY, f64::max) })
}

/// The matrix that predicts each value from all others: (S - diag S) over 1 - diag S for the ridge smoother S.
fn prediction(poses: &[Rigid<Base, Flange>]) -> Option<DMatrix<f64>> {
    let n = poses.len();
    let raw = DMatrix::from_fn(n, 12, |i, k| match k {
        0..3 => poses[i].translation[k],
        _ => poses[i].rotation[k - 3],
    });
    // Each column is centred at its mean and divided by its own standard deviation.
    let mut x = raw.clone();
    for mut column in x.column_iter_mut() {
        let mean = column.sum() / n as f64;
        column.add_scalar_mut(-mean);
        let scale = (column.norm_squared() / n as f64).sqrt();
        if scale > 1e-9 {
            column /= scale;
        }
    }
    let normal = x.transpose() * &x + DMatrix::identity(12, 12) * RIDGE;
    let smooth = &x * normal.cholesky()?.solve(&x.transpose());
    Some(DMatrix::from_fn(n, n, |i, j| if i == j { 0.0 } else { smooth[(i, j)] / (1.0 - smooth[(i, i)]) }))
}
