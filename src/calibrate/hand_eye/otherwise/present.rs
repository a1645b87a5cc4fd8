//! The pairs as given, and the improvement by a changed set.

use crate::calibrate::hand_eye::chance::{BY_CHANCE, chance, misfit};
use crate::calibrate::hand_eye::closed::{Pair, agree};

/// The pairs as given.
pub struct Present<'a> {
    /// In the order given.
    pub pairs: &'a [Pair],
    /// Seed of the random draws.
    pub seed: u64,
}

/// Misfit of a changed set and of the original one, mm at the board's landmarks, rms over the agreeing pairs.
pub struct Fits {
    /// Misfit with the change.
    pub then: f64,
    /// Misfit of the same pairs without the change.
    pub now: f64,
}

impl Present<'_> {
    /// Misfit of the changed pairs. `None` unless four fifths of them agree, and the fit is `times` better than now
    /// and better than chance.
    pub fn better(&self, changed: &[Pair], times: f64) -> Option<Fits> {
        let found = agree(changed, self.seed)?;
        if found.agreeing.len() * 5 < changed.len() * 4 {
            return None;
        }
        let on = |of: &[Pair]| {
            let chosen: Vec<Pair> = found.agreeing.iter().map(|&i| of[i].clone()).collect();
            let refs: Vec<&Pair> = chosen.iter().collect();
            Some(misfit(&refs)? / (refs.len() as f64).sqrt())
        };
        let (then, now) = (on(changed)?, on(self.pairs).unwrap_or(f64::INFINITY));
        let chosen: Vec<&Pair> = found.agreeing.iter().map(|&i| &changed[i]).collect();
        (then * times < now && chance(&chosen, self.seed) <= BY_CHANCE).then_some(Fits { then, now })
    }
}
