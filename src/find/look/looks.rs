//! In: the same part found from several sides, each scan with its own uncertainty and the levers of errors that all
//! scans share.
//! Out: one pose from all, how far the scans disagree beyond what is expected, and which calibration would explain it.
//! Frame and unit: base frame; differences along the part's axes, mm and degrees. docs/math.md, Second look.

use super::explain::{Explanation, explanations};
use super::stack::{Stack, Vector6, motion, singular};
use crate::fault::Gate;
use crate::fault::{Fault, Result};
use crate::find::insert::budget::both;
use crate::find::insert::recipe::Recipe;
use crate::geometry::{Base, Mat3, Part, Rigid, Vec3, exp};
use nalgebra::{DMatrix, Matrix6};

pub use super::stack::{Look, Witness};

/// How the scans disagree.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Disagreement {
    /// Number of scans that were compared.
    pub looks: usize,
    /// The two scans that disagree most, counted from 1.
    pub between: [usize; 2],
    /// Position in the second scan less that in the first, along the part's axes, mm.
    pub difference_mm: [f64; 3],
    /// Turn of the second relative to the first, about the part's axes, degrees.
    pub difference_deg: [f64; 3],
    /// One standard deviation of the difference along the part's axes, mm.
    pub expected_mm: [f64; 3],
    /// One standard deviation of the turn about the part's axes, degrees.
    pub expected_deg: [f64; 3],
    /// The largest of the six differences over its expected value.
    pub ratio: f64,
    /// All contrasts that should be zero (differences, sizes, distances), combined into one normal variate, in standard
    /// deviations.
    pub misfit_sigmas: f64,
    /// Largest turn about the part's normal between two scans, degrees; 0 where the stations are unknown.
    pub turn_deg: f64,
    /// Largest tilt against the part's normal between two scans, degrees; 0 where the stations are unknown.
    pub tilt_deg: f64,
    /// The calibrations that explain the disagreement, the best first; empty where none has a covariance.
    pub explained_by: Vec<Explanation>,
    /// The largest error that these could hide in the part's plane, mm.
    pub unseen_in_plane_mm: f64,
    /// The largest error that these could hide along the part's normal, mm.
    pub unseen_height_mm: f64,
    /// The largest turn that these could hide about any of the part's axes, degrees.
    pub unseen_deg: f64,
    /// False where a calibration without covariance takes part. It may cause more disagreement than expected, and what
    /// it could hide is unknown.
    pub complete: bool,
    /// Result of a witness of the height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub witness: Option<Witnessed>,
}

/// Heights on the part that something else measured, compared with the agreed pose.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub struct Witnessed {
    /// Number of heights that were measured.
    pub places: usize,
    /// Measured less agreed height, weighted mean, mm.
    pub height_mm: f64,
    /// Standard deviation of that mean, expected from all covariances, mm.
    pub expected_mm: f64,
    /// Size of the mean over its expected value.
    pub ratio: f64,
}

/// The combined result of several scans.
#[derive(Clone, Debug)]
pub struct Agreed {
    /// Pose of least variance over all scans, base frame, mm.
    pub base_from_part: Rigid<Base, Part>,
    /// Covariance over x y z rx ry rz about the part's own axes, mm and rad.
    pub covariance: Matrix6<f64>,
    /// How far the scans contradict each other.
    pub disagreement: Disagreement,
}

impl Disagreement {
    /// The gates that several scans have to pass.
    pub fn gates(&self, recipe: &Recipe) -> Vec<Gate> {
        let (g, bears) = (&recipe.gates, &recipe.insertion);
        let of_witness = self.witness.map(|w| Gate::most("range's ratio", w.ratio, g.max_look_ratio));
        if self.looks < 2 {
            return of_witness.into_iter().collect();
        }
        let mut gates = vec![
            Gate::most("looks' ratio", self.ratio, g.max_look_ratio),
            Gate::most("looks' misfit", self.misfit_sigmas, g.max_look_ratio),
            Gate::least("looks' turn_deg", self.turn_deg, g.min_look_turn_deg),
            Gate::least("looks' tilt_deg", self.tilt_deg, g.min_look_tilt_deg),
            Gate::most("unseen in plane, mm", self.unseen_in_plane_mm, bears.tolerance_mm),
            Gate::most("unseen height, mm", self.unseen_height_mm, g.max_unseen_height_mm),
            Gate::most("unseen turn, deg", self.unseen_deg, bears.tolerance_deg),
        ];
        gates.extend(of_witness);
        gates
    }
}

/// Combines two or more scans, or one scan and a witness. The pose is the one of least variance under the joint
/// covariance, in which a calibration's error is one error seen from several sides (generalised least squares;
/// docs/math.md, Second look). `size_sigma`: standard deviation of the part's own sizes; `ratio`: the largest
/// disagreement that passes. Errors: too few scans, or covariances that cannot be inverted.
pub fn agree(looks: &[Look], witness: Option<&Witness>, size_sigma: f64, ratio: f64) -> Result<Agreed> {
    if looks.is_empty() || (looks.len() < 2 && witness.is_none()) {
        return Err(Fault::usage(format!("{} scan given, two or more can be compared", looks.len()))
            .next("name the second scan's folder behind the first"));
    }
    let stack = Stack::new(looks, witness, size_sigma);
    let (follow, covariance) = stack.agreed()?;
    let step = &follow * &stack.values;
    let first = looks[0].base_from_part;
    let base_from_part = Rigid::new(
        exp(&Vec3::new(step[3], step[4], step[5])) * first.rotation,
        first.translation + Vec3::new(step[0], step[1], step[2]),
    );
    let into_part = both(&base_from_part.rotation.transpose());
    let gauges = stack.gauges(looks, &into_part, &follow)?;
    let explained_by = explanations(&stack, &gauges, &follow, &into_part, ratio)?;
    let most = |f: &dyn Fn(&Explanation) -> f64| explained_by.iter().map(f).fold(0.0, f64::max);
    let (worst, (turn_deg, tilt_deg)) = (worst_pair(looks, &stack, &into_part), sides(looks));
    let Pair { between, difference, expected, ratio } = worst;
    let mm = |v: &Vector6| [v[0], v[1], v[2]];
    let deg = |v: &Vector6| [v[3], v[4], v[5]].map(f64::to_degrees);
    let disagreement = Disagreement {
        looks: looks.len(),
        between,
        difference_mm: mm(&difference),
        difference_deg: deg(&difference),
        expected_mm: mm(&expected),
        expected_deg: deg(&expected),
        ratio,
        misfit_sigmas: misfit(&stack)?,
        turn_deg,
        tilt_deg,
        unseen_in_plane_mm: most(&|e| e.unseen_mm[0].max(e.unseen_mm[1])),
        unseen_height_mm: most(&|e| e.unseen_mm[2]),
        unseen_deg: most(&|e| e.unseen_deg.into_iter().fold(0.0, f64::max)),
        explained_by,
        complete: looks.iter().all(|l| l.budget.complete),
        witness: witness.map(|_| witnessed(&stack, &follow)).transpose()?,
    };
    Ok(Agreed { base_from_part, covariance: into_part * covariance * into_part.transpose(), disagreement })
}

struct Pair {
    between: [usize; 2],
    difference: Vector6,
    expected: Vector6,
    ratio: f64,
}

fn worst_pair(looks: &[Look], stack: &Stack, into_part: &Matrix6<f64>) -> Pair {
    // A single scan, which only a witness checks, disagrees with no other.
    let none = Pair { between: [1, 1], difference: Vector6::zeros(), expected: Vector6::zeros(), ratio: 0.0 };
    let mut worst: Option<Pair> = None;
    for i in 0..looks.len() {
        for j in i + 1..looks.len() {
            let block = |a: usize, b: usize| stack.covariance.view((6 * a, 6 * b), (6, 6)).clone_owned();
            let c = block(j, j) + block(i, i) - block(i, j) - block(j, i);
            let c = into_part * Matrix6::from_iterator(c.iter().copied()) * into_part.transpose();
            let difference = into_part * motion(&looks[i].base_from_part, &looks[j].base_from_part);
            let expected = c.diagonal().map(|v| v.max(0.0).sqrt());
            let ratio = (0..6).map(|k| difference[k].abs() / expected[k].max(1e-12)).fold(0.0, f64::max);
            if worst.as_ref().is_none_or(|w| ratio > w.ratio) {
                worst = Some(Pair { between: [i + 1, j + 1], difference, expected, ratio });
            }
        }
    }
    worst.unwrap_or(none)
}

/// chi² of all that should be zero, as a normal variate of the same probability [wilson31]; below 0 where the scans
/// agree better than on average.
fn misfit(stack: &Stack) -> Result<f64> {
    let rows = stack.contrasts();
    let (d, c) = (&rows * &stack.values, &rows * &stack.covariance * rows.transpose());
    let sum = d.dot(&c.cholesky().ok_or_else(singular)?.solve(&d));
    let n = d.len() as f64;
    let spread = 2.0 / (9.0 * n);
    Ok(((sum / n).cbrt() - (1.0 - spread)) / spread.sqrt())
}

fn witnessed(stack: &Stack, follow: &DMatrix<f64>) -> Result<Witnessed> {
    let off = stack.witnessed(follow) * &stack.values;
    let (weights, variance) = stack.witness_weights(follow)?;
    let (height_mm, expected_mm) = (weights.dot(&off), variance.sqrt());
    Ok(Witnessed { places: off.len(), height_mm, expected_mm, ratio: height_mm.abs() / expected_mm })
}

/// Largest turn about the part's normal and largest tilt against it between two scans, degrees.
fn sides(looks: &[Look]) -> (f64, f64) {
    let views: Vec<Mat3> = looks
        .iter()
        .filter_map(|l| Some(l.base_from_part.rotation.transpose() * l.budget.base_from_camera?.rotation))
        .collect();
    let mut most = (0f64, 0f64);
    for (i, a) in views.iter().enumerate() {
        for b in &views[i + 1..] {
            let (turn, tilt) = turn_and_tilt(&(b * a.transpose()));
            most = (most.0.max(turn), most.1.max(tilt));
        }
    }
    most
}

/// A rotation in the part's axes as a turn about z and a tilt of z, degrees.
pub(in crate::find) fn turn_and_tilt(r: &Mat3) -> (f64, f64) {
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(*r));
    let turn = 2.0 * q.k.abs().atan2(q.w.abs());
    (turn.to_degrees(), r[(2, 2)].clamp(-1.0, 1.0).acos().to_degrees())
}

/// The camera's motion that turns a scan about the part's normal and tilts it about the part's x: base from base.
pub fn other_side(base_from_part: &Rigid<Base, Part>, turn_deg: f64, tilt_deg: f64) -> Rigid<Base, Base> {
    let turn = exp(&(Vec3::z() * turn_deg.to_radians()));
    let tilt = exp(&(Vec3::x() * tilt_deg.to_radians()));
    let part: Rigid<Part, Part> = Rigid::new(tilt * turn, Vec3::zeros());
    *base_from_part * part * base_from_part.inverse()
}

#[cfg(test)]
#[path = "looks_tests.rs"]
mod tests;
