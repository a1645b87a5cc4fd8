//! In: stops and their fit. Out: which stops contradict the others, whether the line is bent, whether the reversed
//! order of the counts fits, and how well random orders fit.
//! Frame and unit: camera frame, mm; squared distances in sigmas (docs/math.md, Axis (7), (8)).

use super::fit::{Order, Stop, StopResidual};
use super::start::{Start, start};
use super::terms::{Fit, Scatter, Seen, State, fitted, information};
use crate::calibrate::scatter::beside;
use crate::geometry::{CountUnit, Vec3};
use nalgebra::DMatrix;
use rand::{SeedableRng, seq::SliceRandom};

/// Number of random permutations of the counts.
const DEALS: u64 = 20;

pub(super) fn order(seen: &[Seen], now: &Start, unit: CountUnit, seed: u64) -> Order {
    let counts: Vec<f64> = seen.iter().map(|s| s.count).collect();
    let with = |counts: &[f64]| {
        let dealt: Vec<Seen> = seen.iter().zip(counts).map(|(s, c)| Seen { count: *c, ..s.clone() }).collect();
        start(&dealt, now.state.kind, unit).map_or(f64::INFINITY, |s| s.spread)
    };
    // Reversed by rank: the stop with the lowest count gets the highest one.
    let mut ranks: Vec<usize> = (0..counts.len()).collect();
    ranks.sort_by(|a, b| counts[*a].total_cmp(&counts[*b]));
    let mut reversed = counts.clone();
    for (k, &i) in ranks.iter().enumerate() {
        reversed[i] = counts[ranks[ranks.len() - 1 - k]];
    }
    let deal = |k: u64| {
        let mut dealt = counts.clone();
        dealt.shuffle(&mut rand_pcg::Pcg64::seed_from_u64(seed.wrapping_add(k)));
        let stayed = dealt.iter().zip(&counts).filter(|(a, b)| a == b).count();
        // A permutation that leaves most counts in place, or reverses most of them, is no sample of chance.
        let turned = dealt.iter().zip(&reversed).filter(|(a, b)| a == b).count();
        if stayed.max(turned) * 3 > counts.len() { f64::INFINITY } else { with(&dealt) }
    };
    Order {
        spread_mm: now.spread,
        reversed_mm: with(&reversed),
        dealt_mm: (0..DEALS).map(deal).fold(f64::INFINITY, f64::min),
    }
}

/// Check of the stops against each other.
pub(super) struct Suspects {
    /// Indices of the stops in the fit.
    pub used: Vec<usize>,
    /// Squared distance of each stop from the position that the others predict; 6 degrees of freedom.
    surprise: Vec<f64>,
    /// The same divided by its usual size among the used stops, if that is larger than chance explains.
    beside: Vec<f64>,
    /// The motion without that stop; `None` where the others determine no motion.
    without: Vec<Option<State>>,
}

impl Suspects {
    pub fn of(seen: &[Seen], used: &[usize], fit: &Fit, scatter: &Scatter) -> Suspects {
        let held = |i: usize| -> (f64, Option<State>) {
            let others: Vec<&Seen> = used.iter().filter(|&&k| k != i).map(|&k| &seen[k]).collect();
            let alone = if used.contains(&i) { fitted(&others, &fit.state, scatter) } else { Some(fit.clone()) };
            let Some(other) = alone.filter(|_| others.len() >= 2) else { return (f64::INFINITY, None) };
            let s = &seen[i];
            let (e, j) = (other.state.off(s), other.state.jacobian(s.count));
            let predicted = &j * &other.covariance * j.transpose();
            let total = s.covariance + scatter.covariance() + nalgebra::Matrix6::from_fn(|a, b| predicted[(a, b)]);
            let surprise = total.cholesky().map_or(f64::INFINITY, |c| e.dot(&c.solve(&e)));
            (surprise, Some(other.state))
        };
        let (surprise, without): (Vec<f64>, Vec<_>) = (0..seen.len()).map(held).unzip();
        // The median of a chi-square with 6 degrees of freedom is 3.9 times that of one with 2.
        let two: Vec<f64> = surprise.iter().map(|s| s / 3.86).collect();
        let beside = beside(&two, |i| used.contains(&i)).into_iter().map(|b| b * 3.86).collect();
        Suspects { used: used.to_vec(), surprise, beside, without }
    }

    /// Stops of the next round's fit: the worst one leaves while enough remain; otherwise those within the gate
    /// enter.
    pub fn within(&self, gate: f64, used: &[usize], round: usize) -> Vec<usize> {
        let worst = used.iter().copied().max_by(|a, b| self.beside[*a].total_cmp(&self.beside[*b]));
        if let Some(worst) = worst.filter(|w| self.beside[*w] > gate && used.len() > 3) {
            return used.iter().copied().filter(|i| *i != worst).collect();
        }
        // Late rounds only remove stops, so that none alternates between in and out.
        let enters = |i: usize| round < 6 && self.beside[i] <= gate;
        (0..self.beside.len()).filter(|&i| used.contains(&i) || enters(i)).collect()
    }

    pub fn residuals(&self, stops: &[Stop], seen: &[Seen], state: &State) -> Vec<StopResidual> {
        let mm = |state: &State, i: usize| {
            let e = state.off(&seen[i]);
            let turned = e.fixed_rows::<3>(3).norm() * seen[i].arm;
            e.fixed_rows::<3>(0).norm().hypot(turned * (2.0f64 / 3.0).sqrt())
        };
        (0..stops.len())
            .map(|i| StopResidual {
                name: stops[i].pose.name.clone(),
                count: stops[i].count,
                used: self.used.contains(&i),
                mm: mm(state, i),
                holdout_mm: self.without[i].as_ref().map_or(f64::INFINITY, |s| mm(s, i)),
                surprise: self.surprise[i],
                off: state.off(&seen[i]).fixed_rows::<3>(0).into(),
            })
            .collect()
    }
}

/// Bow over the entire travel, from end to middle, and its sigma, mm. It is the quadratic term of a polynomial in the
/// count, fitted to the residuals of the positions. A bent linear axis has a bow, and so has a table that does not run
/// true.
pub(super) fn bend(seen: &[&Seen], state: &State, scatter: &Scatter) -> [f64; 2] {
    if seen.len() < 4 {
        return [0.0, 0.0];
    }
    let (low, high) =
        seen.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(s.count), b.max(s.count)));
    let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
    let mut h = DMatrix::<f64>::zeros(9, 9);
    let mut g = DMatrix::<f64>::zeros(9, 1);
    for s in seen {
        let x = (s.count - middle) / half;
        let Some(w) = information(s, scatter) else { return [0.0, 0.0] };
        let w = w.fixed_view::<3, 3>(0, 0).into_owned();
        let off: Vec3 = state.off(s).fixed_rows::<3>(0).into();
        for (a, p) in [1.0, x, x * x].into_iter().enumerate() {
            let mut part = g.view_mut((3 * a, 0), (3, 1));
            part += w * off * p;
            for (b, q) in [1.0, x, x * x].into_iter().enumerate() {
                let mut part = h.view_mut((3 * a, 3 * b), (3, 3));
                part += w * (p * q);
            }
        }
    }
    let Some(c) = h.cholesky() else { return [0.0, 0.0] };
    let found = c.solve(&g);
    let covariance = c.inverse();
    let bow = Vec3::new(found[6], found[7], found[8]);
    let along = bow.try_normalize(1e-12).unwrap_or(Vec3::x());
    let own = covariance.view((6, 6), (3, 3)).into_owned();
    let sigma = (along.transpose() * own * along)[0].max(0.0).sqrt();
    [bow.norm(), sigma]
}
