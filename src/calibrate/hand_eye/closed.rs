//! In: board poses seen by the camera and the robot's poses; some pairs may be wrong. Out: the hand-eye transform in
//! closed form, and the pairs that agree with it.
//! Frame and unit: near = what carries the camera, far = what carries the board; mm, rad.

use crate::calibrate::measured_pose::MeasuredPose;
use crate::geometry::{Board, Camera, Frame, Mat3, Rigid, Vec3, log, orthonormalise};
use crate::robot::Written;
use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;

/// Frame of the camera's carrier: the flange (eye in hand) or the base (eye to hand).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Near;
/// Frame of the board's carrier: the base (eye in hand) or the flange (eye to hand).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Far;
impl Frame for Near {
    const NAME: &'static str = "camera's carrier";
}
impl Frame for Far {
    const NAME: &'static str = "board's carrier";
}

/// One pair: the robot's reported pose and the board seen by the camera.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The robot's pose: flange_from_base with eye in hand, base_from_flange with eye to hand; mm.
    pub near_from_far: Rigid<Near, Far>,
    /// The board's pose measured by the camera.
    pub seen: MeasuredPose,
    /// The numbers that the robot's pose was read from; `None` for a pose received over a network connection.
    pub written: Option<Written>,
}

impl Pair {
    /// A pair whose robot pose has no written notation.
    pub fn new(near_from_far: Rigid<Near, Far>, seen: MeasuredPose) -> Pair {
        Pair { near_from_far, seen, written: None }
    }
    /// The same picture with another pose of the robot.
    pub fn at(&self, near_from_far: Rigid<Near, Far>) -> Pair {
        Pair { near_from_far, ..self.clone() }
    }
}

/// The two unknowns of the chain camera ← near ← far ← board.
#[derive(Clone, Copy, Debug)]
pub struct Chain {
    /// The hand-eye transform, mm.
    pub near_from_camera: Rigid<Near, Camera>,
    /// Pose of the board on its carrier, mm.
    pub far_from_board: Rigid<Far, Board>,
}

impl Chain {
    /// The board pose that the chain expects for a robot pose.
    pub fn expected(&self, near_from_far: &Rigid<Near, Far>) -> Rigid<Camera, Board> {
        self.near_from_camera.inverse() * *near_from_far * self.far_from_board
    }
    /// Distance between the seen and the expected board, rms over its landmarks, mm.
    pub fn misfit(&self, pair: &Pair) -> f64 {
        pair.seen.displacement(&self.expected(&pair.near_from_far))
    }
}

/// Indices of the pairs in an order that does not depend on the recording: sorted by the robot's position, then the
/// board's.
pub fn canonical_order(pairs: &[Pair]) -> Vec<usize> {
    let key = |i: usize| {
        let (a, b) = (pairs[i].near_from_far.translation, pairs[i].seen.camera_from_board.translation);
        [a.x, a.y, a.z, b.x, b.y, b.z]
    };
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&i, &j| {
        let unequal = |(x, y): (&f64, &f64)| Some(x.total_cmp(y)).filter(|c| c.is_ne());
        key(i).iter().zip(&key(j)).find_map(unequal).unwrap_or(std::cmp::Ordering::Equal)
    });
    order
}

/// Relative motions of two pairs: (robot, camera), both as rotation vector and translation.
fn motion(a: &Pair, b: &Pair) -> (Rigid<Near, Near>, Rigid<Camera, Camera>) {
    (a.near_from_far * b.near_from_far.inverse(), a.seen.camera_from_board * b.seen.camera_from_board.inverse())
}

/// Rotations beyond this angle are too close to half a turn, where the logarithm is ambiguous; their pairs are
/// excluded (rad).
const HALF_TURN: f64 = 3.05;

/// AX = XB over all pairs of pairs: the rotation by \[park94\] (the polar factor of Σ α βᵀ), then the translation by
/// a linear solve (docs/math.md, Hand-eye (2) to (4)). `None` if the robot rotated about fewer than two axes.
pub fn park_martin(pairs: &[&Pair]) -> Option<Chain> {
    let near_from_camera = {
        let mut m = Mat3::zeros();
        for_each_motion(pairs, |a, b| {
            m += log(&a.rotation) * log(&b.rotation).transpose();
        });
        let s = m.singular_values();
        // Two axes give two singular values; the third direction follows from right-handedness.
        if !(s[1] > 1e-6 * s[0].max(1e-12)) {
            return None;
        }
        let rotation = orthonormalise(&m);
        Rigid::new(rotation, translation(pairs, &rotation, false)?.0)
    };
    Some(Chain { near_from_camera, far_from_board: mean_board(pairs, &near_from_camera) })
}

/// Factor that converts the robot's lengths to the board's: 1 for equal units, 1000 for poses in metres, the ratio of
/// the square sizes for a wrong board.
pub fn robot_scale(pairs: &[&Pair]) -> Option<f64> {
    let chain = park_martin(pairs)?;
    Some(translation(pairs, &chain.near_from_camera.rotation, true)?.1)
}

fn for_each_motion(pairs: &[&Pair], mut f: impl FnMut(&Rigid<Near, Near>, &Rigid<Camera, Camera>)) {
    for (i, a) in pairs.iter().enumerate() {
        for b in &pairs[..i] {
            let (robot, camera) = motion(a, b);
            if log(&robot.rotation).norm() < HALF_TURN && log(&camera.rotation).norm() < HALF_TURN {
                f(&robot, &camera);
            }
        }
    }
}

/// (R_A − I) t = R_X t_B − s t_A for all motions; s = 1 unless `with_scale`.
fn translation(pairs: &[&Pair], rotation: &Mat3, with_scale: bool) -> Option<(Vec3, f64)> {
    let mut h = DMatrix::<f64>::zeros(4, 4);
    let mut g = DVector::<f64>::zeros(4);
    for_each_motion(pairs, |a, b| {
        let left = a.rotation - Mat3::identity();
        let right = rotation * b.translation;
        for r in 0..3 {
            let row = [left[(r, 0)], left[(r, 1)], left[(r, 2)], a.translation[r]];
            for i in 0..4 {
                g[i] += row[i] * right[r];
                for j in 0..4 {
                    h[(i, j)] += row[i] * row[j];
                }
            }
        }
    });
    if with_scale {
        let t = h.lu().solve(&g)?;
        return Some((Vec3::new(t[0], t[1], t[2]), t[3]));
    }
    let fixed: Mat3 = h.fixed_view::<3, 3>(0, 0).into();
    let rest = Vec3::new(g[0] - h[(0, 3)], g[1] - h[(1, 3)], g[2] - h[(2, 3)]);
    let t = fixed.lu().solve(&rest)?;
    t.iter().all(|x| x.is_finite()).then_some((t, 1.0))
}

/// Pose of the board on its carrier: mean over all pairs (chordal mean of the rotations).
fn mean_board(pairs: &[&Pair], near_from_camera: &Rigid<Near, Camera>) -> Rigid<Far, Board> {
    let each: Vec<Rigid<Far, Board>> =
        pairs.iter().map(|p| p.near_from_far.inverse() * *near_from_camera * p.seen.camera_from_board).collect();
    let n = each.len() as f64;
    let rotation = orthonormalise(&each.iter().map(|w| w.rotation).sum::<Mat3>());
    let centre = pairs[0].seen.landmarks[4];
    // Averaged at the board's centre, where translation and rotation errors mix least.
    let middle = each.iter().map(|w| w.point(&centre)).sum::<Vec3>() / n;
    Rigid::new(rotation, middle - rotation * centre)
}

/// The pairs that agree with each other.
#[derive(Clone, Debug)]
pub struct Agreement {
    /// The closed form of the agreeing pairs.
    pub chain: Chain,
    /// Indices of the agreeing pairs, ascending.
    pub agreeing: Vec<usize>,
    /// Robust sigma of the misfit of a board corner, mm.
    pub spread: f64,
}

/// The closed form on the largest set of agreeing pairs: least median of squares over triples \[rousseeuw84\], all
/// triples up to 25 pairs and 3000 drawn ones beyond. Up to half of the pairs may be wrong. The pairs must come in an
/// order that does not depend on the recording.
pub fn agree(pairs: &[Pair], seed: u64) -> Option<Agreement> {
    let n = pairs.len();
    if n < 3 {
        return None;
    }
    let mut best: Option<(f64, Chain)> = None;
    let mut consider = |c: &[usize]| {
        let Some(chain) = park_martin(&c.iter().map(|&i| &pairs[i]).collect::<Vec<_>>()) else { return };
        let mut misfits: Vec<f64> = pairs.iter().map(|p| chain.misfit(p)).collect();
        // The three pairs of the triple fit too well to count in the median.
        let middle = (n / 2 + 1).min(n - 1);
        let (_, &mut median, _) = misfits.select_nth_unstable_by(middle, f64::total_cmp);
        if best.as_ref().is_none_or(|b| median < b.0) {
            best = Some((median, chain));
        }
    };
    if n <= 25 {
        for i in 0..n {
            for j in 0..i {
                for k in 0..j {
                    consider(&[i, j, k]);
                }
            }
        }
    } else {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
        for _ in 0..3000 {
            consider(&rand::seq::index::sample(&mut rng, n, 3).into_vec());
        }
    }
    let (_, mut chain) = best?;
    let mut agreeing = Vec::new();
    let mut spread = 0.0;
    for _ in 0..5 {
        let misfits: Vec<f64> = pairs.iter().map(|p| chain.misfit(p)).collect();
        let mut sorted = misfits.clone();
        sorted.sort_by(f64::total_cmp);
        spread = (sorted[n / 2] / 1.2).max(1e-6);
        let now: Vec<usize> = (0..n).filter(|&i| misfits[i] < 4.0 * spread).collect();
        let Some(next) = park_martin(&now.iter().map(|&i| &pairs[i]).collect::<Vec<_>>()) else { break };
        chain = next;
        let settled = now == agreeing;
        agreeing = now;
        if settled {
            break;
        }
    }
    (agreeing.len() >= 3).then_some(Agreement { chain, agreeing, spread })
}

/// Spread of the rotation axes between the pairs. For each principal direction (near frame, the one with most
/// rotation first) the rms rotation about it over all motions, rad.
pub fn axis_spread(pairs: &[&Pair]) -> [(Vec3, f64); 3] {
    let mut m = Mat3::zeros();
    let mut n = 0.0;
    for (i, a) in pairs.iter().enumerate() {
        for b in &pairs[..i] {
            let w = log(&motion(a, b).0.rotation);
            m += w * w.transpose();
            n += 1.0;
        }
    }
    let e = m.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| e.eigenvalues[b].total_cmp(&e.eigenvalues[a]));
    order.map(|i| (e.eigenvectors.column(i).into(), (e.eigenvalues[i].max(0.0) / f64::max(n, 1.0)).sqrt()))
}
