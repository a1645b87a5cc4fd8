//! In: the residuals of a solve with their derivatives and its covariance. Out: the noise of each source, the degrees
//! of freedom that determine it, and the stops that stand out.
//! Frame and unit: mm, rad; factors of stated sigmas (docs/math.md, Joint calibration (6), (7)).

use super::options::Noise;
use super::shots::Part;
use super::terms::{Term, Terms};
use super::unknowns::State;
use nalgebra::DMatrix;

/// Lower limits, below which a source is negligible beside any other; mm and rad for the robot.
const FLOOR: [f64; 5] = [1e-3, 1e-3, 1e-3, 1e-4, 1e-6];

/// Squared residuals of a part and their remaining degrees of freedom.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Left {
    /// Sum of squared residuals, in sigmas, robustly weighted.
    pub squares: f64,
    /// Number of residuals minus the degrees of freedom that the fit absorbed.
    pub freedom: f64,
    /// Number of residuals.
    pub count: f64,
}

/// The residuals of a solve, by part and by stop.
pub struct Leavings {
    /// In the order of [`Part::ALL`].
    pub parts: [Left; 5],
    /// By stop, then by part.
    pub shots: Vec<[Left; 5]>,
    /// Contribution of each part's noise to the covariance of the shared unknowns; their sum is that covariance.
    pub shares: Vec<DMatrix<f64>>,
}

/// Redundancies \[foerstner79\] at a solution: a residual r with derivatives J keeps 1 - J C Jᵀ degrees of freedom.
pub fn leavings(terms: &Terms<'_>, s: &State, covariance: &DMatrix<f64>, huber: f64) -> Option<Leavings> {
    let shared = terms.layout.shared();
    let mut out = Leavings {
        parts: [Left::default(); 5],
        shots: vec![[Left::default(); 5]; terms.shots.len()],
        shares: vec![DMatrix::zeros(shared, shared); 5],
    };
    let mut moves = vec![0.0; shared];
    terms.visit(s, true, &mut |t: Term<'_>| {
        let Some(part) = t.part else { return };
        let k = part as usize;
        let length = t.residual.iter().map(|r| r * r).sum::<f64>().sqrt();
        let robot = matches!(part, Part::RobotPlace | Part::RobotTurn);
        let weight = if robot || length <= huber { 1.0 } else { huber / length };
        let mut taken = 0.0;
        for row in t.jacobian.chunks_exact(t.columns.len()) {
            for (b, &cb) in t.columns.iter().enumerate() {
                let column = covariance.column(cb);
                let along: f64 = t.columns.iter().zip(row).map(|(&ca, x)| column[ca] * x).sum();
                taken += along * row[b];
            }
            moves.fill(0.0);
            for (&c, x) in t.columns.iter().zip(row) {
                let column = covariance.column(c);
                moves.iter_mut().zip(column.iter()).for_each(|(m, v)| *m += v * x);
            }
            let share = &mut out.shares[k];
            for (j, m) in moves.iter().enumerate().filter(|(_, m)| **m != 0.0) {
                share.column_mut(j).iter_mut().zip(&moves).for_each(|(s, v)| *s += weight * m * v);
            }
        }
        let count = t.residual.len() as f64;
        for left in [&mut out.parts[k], &mut out.shots[t.shot][k]] {
            left.squares += weight * length * length;
            left.freedom += weight * (count - taken * weight);
            left.count += count;
        }
    })?;
    Some(out)
}

impl Leavings {
    /// The noise that these residuals show: each part's squared residuals over their redundancy. A part with less
    /// than one remaining degree of freedom keeps its assumed noise.
    pub fn noise(&self, now: &Noise) -> Noise {
        let mut f = now.factors();
        for (k, left) in self.parts.iter().enumerate() {
            if left.freedom >= 1.0 {
                // Sources that share redundancy exchange it slowly, so a round changes a factor by 10 at most.
                f[k] = (f[k] * (left.squares / left.freedom).sqrt().clamp(0.1, 10.0)).max(FLOOR[k]);
            }
        }
        Noise::of(f)
    }

    /// A stop's squared residuals of some parts over their degrees of freedom: 1 is usual.
    pub fn stands_out(&self, shot: usize, parts: &[Part]) -> f64 {
        let of = |f: fn(&Left) -> f64| parts.iter().map(|p| f(&self.shots[shot][*p as usize])).sum::<f64>();
        let (squares, freedom, count) = (of(|l| l.squares), of(|l| l.freedom), of(|l| l.count));
        // What determines something alone leaves nothing to judge it by.
        if count == 0.0 || freedom < 0.05 * count { 0.0 } else { squares / freedom }
    }
}
