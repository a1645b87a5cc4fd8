//! The pairs as they are, and by how much a changed set fits better.

use crate::calibrate::hand_eye::chance::{BY_CHANCE, chance, misfit};
use crate::calibrate::hand_eye::closed::{Pair, agree};

/// The pairs as they were given.
pub struct Present<'a> {
    /// In the order given.
    pub pairs: &'a [Pair],
    /// Of the draws.
    pub seed: u64,
}

/// How a changed set fits, mm at the board's corners, rms over the pairs that agree.
pub struct Fits {
    /// Changed.
    pub then: f64,
    /// The same pairs as they are.
    pub now: f64,
}

impl Present<'_> {
    /// How the changed pairs fit; `None` unless four fifths of them agree, `times` better than now and better than by
    /// chance.
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
