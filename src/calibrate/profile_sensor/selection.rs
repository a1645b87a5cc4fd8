//! In: measurements of a target, a start. Out: the solution without the profiles beyond the gate, and how well each
//! profile agrees with it.
//! Frame and unit: see `likelihood`; mm.

use super::likelihood::{Item, Noise, Solved, Target, distance2, fit, robot_sigmas};
use crate::solve::Loss;
use nalgebra::SVector;

/// All profiles of one target.
pub struct Data<'a, const K: usize, T: Target<K>> {
    pub target: &'a T,
    pub items: Vec<Item<'a, T::Measured>>,
    /// Squared Mahalanobis distance beyond which a profile counts as wrong.
    pub gate: f64,
    /// Fewest profiles in a fit.
    pub least: usize,
    /// Most profiles that the robot's noise is estimated from; the effort grows with their third power.
    pub most: usize,
}

/// A fit of some of the profiles.
pub struct Solution<S> {
    pub solved: Solved<S>,
    pub noise: Noise,
    /// Profiles in the fit.
    pub used: Vec<usize>,
}

impl<const K: usize, T: Target<K>> Data<'_, K, T> {
    pub fn chosen(&self, used: impl Iterator<Item = usize>) -> Vec<Item<'_, T::Measured>> {
        used.map(|i| self.items[i]).collect()
    }

    /// The solution near a start, first of the profiles `used`, then without those beyond the gate. `None` where
    /// nothing is determined.
    pub fn settled(&self, start: Solved<T::State>, noise: Noise, used: Vec<usize>) -> Option<Solution<T::State>> {
        let mut s = Solution { solved: start, noise, used };
        for _ in 0..12 {
            s.refit(self)?;
            let next = s.within_gate(self);
            if next == s.used || next.len() < self.least {
                break;
            }
            // Exclude one profile per round: a wrong profile also raises the distances of the others.
            let worst = s.worst(self)?;
            if s.distance2(self, worst, true) > self.gate {
                s.used.retain(|&i| i != worst);
            } else {
                s.used = next;
            }
        }
        Some(s)
    }
}

impl<S: Copy> Solution<S> {
    /// Least squares over the used profiles, alternating with the robot's variance components.
    fn refit<const K: usize, T: Target<K, State = S>>(&mut self, data: &Data<'_, K, T>) -> Option<()> {
        let chosen = data.chosen(self.used.iter().copied());
        let step = chosen.len().div_ceil(data.most).max(1);
        let some: Vec<_> = chosen.iter().step_by(step).copied().collect();
        for _ in 0..8 {
            self.solved = fit(data.target, &chosen, &self.solved.state, &self.noise, Loss::Squares)?;
            self.noise.robot = robot_sigmas(data.target, &some, &self.solved.state, &self.noise)?;
        }
        self.solved = fit(data.target, &chosen, &self.solved.state, &self.noise, Loss::Squares)?;
        Some(())
    }

    pub fn distance2<const K: usize, T: Target<K, State = S>>(
        &self,
        data: &Data<'_, K, T>,
        i: usize,
        used: bool,
    ) -> f64 {
        distance2(data.target, &self.solved, &data.items[i], &self.noise, used)
    }

    fn within_gate<const K: usize, T: Target<K, State = S>>(&self, data: &Data<'_, K, T>) -> Vec<usize> {
        let near = |i: &usize| self.distance2(data, *i, self.used.contains(i)) <= data.gate;
        (0..data.items.len()).filter(near).collect()
    }

    fn worst<const K: usize, T: Target<K, State = S>>(&self, data: &Data<'_, K, T>) -> Option<usize> {
        let d = |i: usize| self.distance2(data, i, true);
        self.used.iter().copied().max_by(|&a, &b| d(a).total_cmp(&d(b)))
    }

    /// Residual of one profile with all used profiles, and with the others only.
    pub fn residuals<const K: usize, T: Target<K, State = S>>(
        &self,
        data: &Data<'_, K, T>,
        i: usize,
    ) -> (SVector<f64, K>, Option<SVector<f64, K>>) {
        let (item, state) = (&data.items[i], &self.solved.state);
        let rest = data.chosen(self.used.iter().copied().filter(|&k| k != i));
        let without = fit(data.target, &rest, state, &self.noise, Loss::Squares);
        (data.target.row(state, item).residual, without.map(|s| data.target.row(&s.state, item).residual))
    }
}
