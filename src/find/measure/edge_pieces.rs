//! In: rows of light beside edges, each from a shot and a piece of an edge. Out: the step that explains them, and its
//! covariance with the errors that samples share: their shot's pose and their piece of edge (docs/math.md, Insertion
//! (4)).
//! Frame and unit: as `lit_edges`; light as a share, mm, rad.

use nalgebra::SVector;
use nalgebra::{Cholesky, SMatrix};
use std::collections::BTreeMap;

type Square = SMatrix<f64, N, N>;

/// One sample: measured less predicted light, and its derivative by the unknowns.
pub(in crate::find) struct Row {
    pub j: Unknowns,
    pub residual: f64,
    pub shot: u32,
    /// Change of light for a millimetre across the edge.
    pub slope: f64,
    pub normal: [f64; 2],
    pub piece: (usize, usize, i32, i32),
}

pub(in crate::find) struct Solved {
    pub step: Unknowns,
    pub covariance: Square,
    pub sigma: f64,
}

/// Residuals beyond this many robust sigmas have no weight.
const TUKEY: f64 = 4.0;
/// Weight of the prior on the pieces' offsets, in pieces.
const PRIOR_PIECES: f64 = 8.0;
/// Expectation-maximisation rounds for the size of the offsets.
const ROUNDS: usize = 15;

/// The contribution of a piece to the normal equations: its offset is a separate unknown, eliminated at once.
struct Piece {
    cross: Unknowns,
    own: f64,
    right: f64,
    rows: Vec<usize>,
}

/// Solves for the step from `x`. `bias`: expected size of a piece's offset, mm; `scatter`: standard deviation of a
/// shot's position, mm; `unit`: the recipe's unit of length, mm.
pub(in crate::find) fn solve(
    rows: &[Row],
    x: &Unknowns,
    priors: &[Prior],
    [bias, scatter]: [f64; 2],
    unit: f64,
) -> Option<Solved> {
    let mut sizes: Vec<f64> = rows.iter().map(|r| r.residual.abs()).collect();
    let middle = sizes.len() / 2;
    let sigma = (1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1).max(0.01);
    let weights: Vec<f64> = rows
        .iter()
        .map(|r| (1.0 - (r.residual / (TUKEY * sigma)).powi(2)).max(0.0).powi(2) / (sigma * sigma))
        .collect();
    let (a, b, pieces) = gathered(rows, &weights, x, priors);
    let least = 1e-4 * unit;
    let mut size = bias.max(least);
    let (mut inverse, mut step) = (Square::zeros(), Unknowns::zeros());
    let mut reduced = a;
    for _ in 0..ROUNDS {
        let (mut left, mut right) = (a, b);
        for p in &pieces {
            let k = 1.0 / (p.own + size.powi(-2));
            left -= k * p.cross * p.cross.transpose();
            right -= k * p.right * p.cross;
        }
        inverse = inverted(&left)?;
        reduced = left;
        step = inverse * right;
        let mut sum = PRIOR_PIECES * bias * bias;
        for p in &pieces {
            let k = 1.0 / (p.own + size.powi(-2));
            sum +=
                (k * (p.right - p.cross.dot(&step))).powi(2) + k + k * k * (p.cross.transpose() * inverse * p.cross)[0];
        }
        size = (sum / (PRIOR_PIECES + pieces.len() as f64)).sqrt().max(least);
    }
    let covariance = spread(rows, &weights, &pieces, &reduced, &inverse, &step, size, scatter);
    Some(Solved { step, covariance, sigma })
}

/// Normal matrix and right side of the priors and all rows, and the terms that each piece subtracts from them.
fn gathered(rows: &[Row], weights: &[f64], x: &Unknowns, priors: &[Prior]) -> (Square, Unknowns, Vec<Piece>) {
    let (mut a, mut b) = (Square::zeros(), Unknowns::zeros());
    for &(k, mean, sd) in priors {
        a[(k, k)] += 1.0 / (sd * sd);
        b[k] += (mean - x[k]) / (sd * sd);
    }
    let mut pieces = BTreeMap::<_, Piece>::new();
    for (i, (r, w)) in rows.iter().zip(weights).enumerate() {
        a += *w * r.j * r.j.transpose();
        b += *w * r.residual * r.j;
        let p = pieces.entry(r.piece).or_insert_with(|| Piece {
            cross: Unknowns::zeros(),
            own: 0.0,
            right: 0.0,
            rows: vec![],
        });
        p.cross += *w * r.slope * r.j;
        p.own += w * r.slope * r.slope;
        p.right += w * r.slope * r.residual;
        p.rows.push(i);
    }
    (a, b, pieces.into_values().collect())
}

/// The inverse, scaled to unit diagonal first; `None` where a motion is undetermined.
fn inverted(a: &Square) -> Option<Square> {
    let scale = Unknowns::from_fn(|k, _| a[(k, k)].max(1e-300).sqrt().recip());
    let unit = Square::from_fn(|i, k| a[(i, k)] * scale[i] * scale[k]);
    let factor = Cholesky::new(unit)?;
    if (0..N).any(|k| factor.l()[(k, k)] < 1e-3) {
        return None;
    }
    let inverse = factor.inverse();
    Some(Square::from_fn(|i, k| inverse[(i, k)] * scale[i] * scale[k]))
}

/// Covariance: offsets of the pieces, plus the larger of two estimates of noise and poses. One comes from the residuals
/// of whole shots, each excluded in turn; the other from the samples' own noise and the poses' scatter.
#[allow(clippy::too_many_arguments)]
fn spread(
    rows: &[Row],
    weights: &[f64],
    pieces: &[Piece],
    reduced: &Square,
    inverse: &Square,
    step: &Unknowns,
    size: f64,
    scatter: f64,
) -> Square {
    let mut offsets = Square::zeros();
    let mut share = vec![(Unknowns::zeros(), 0.0); rows.len()];
    for p in pieces {
        let k = 1.0 / (p.own + size.powi(-2));
        let offset = k * (p.right - p.cross.dot(step));
        let pull = p.cross * (size / (1.0 + size * size * p.own));
        offsets += pull * pull.transpose();
        for &i in &p.rows {
            let r = &rows[i];
            share[i] = (r.j - p.cross * (k * r.slope), r.residual - r.j.dot(step) - r.slope * offset);
        }
    }
    let mut shots = BTreeMap::<u32, (Unknowns, Square, [Unknowns; 2])>::new();
    let mut noise = Square::zeros();
    for ((r, w), (j, left)) in rows.iter().zip(weights).zip(&share) {
        let shot = shots.entry(r.shot).or_insert_with(|| (Unknowns::zeros(), Square::zeros(), [Unknowns::zeros(); 2]));
        shot.0 += *w * *left * j;
        let own = *w * j * j.transpose();
        shot.1 += own;
        noise += own;
        for k in 0..2 {
            shot.2[k] += *w * r.slope * r.normal[k] * j;
        }
    }
    let (mut seen, mut known) = (Square::zeros(), inverse * noise * inverse);
    for (score, information, moved) in shots.values() {
        let without = inverted(&(reduced - information)).unwrap_or(*inverse);
        let change = without * score;
        seen += change * change.transpose();
        for m in moved {
            let m = inverse * m * scatter;
            known += m * m.transpose();
        }
    }
    let grow = Unknowns::from_fn(|k, _| (seen[(k, k)] / known[(k, k)].max(1e-300)).max(1.0).sqrt());
    inverse * offsets * inverse + Square::from_fn(|i, k| known[(i, k)] * grow[i] * grow[k])
}

/// Unknowns: x, y, turn, growth along the stripe and from shot to shot, width of the light's fall in these two
/// directions, sizes ([`super::shape::Shape`]).
pub(in crate::find) const N: usize = 10;

pub(in crate::find) type Unknowns = SVector<f64, N>;

/// Index of an unknown, its expected mean and its standard deviation.
pub(in crate::find) type Prior = (usize, f64, f64);
