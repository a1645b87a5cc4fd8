//! In: what a user or a recipe requests of the search. Out: the same, checked.
//! Frame and unit: degrees, scores from 0 to 1, values per pixel of the layer.

use crate::fault::{Fault, Result};

/// What is searched for.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SearchOptions {
    /// First and last turn, degrees; the last not below the first, at most 360 apart. Default all.
    pub angles_deg: [f64; 2],
    /// Smallest and largest scale, 0.2 to 5. Default 1 alone.
    pub scales: [f64; 2],
    /// Least score, 0.1 to 1: the mean cosine between the model's and the scene's directions.
    pub min_score: f64,
    /// Most matches, 1 to 1000.
    pub max_matches: usize,
    /// Largest overlap of two matches, 0 to 1, as a share of the smaller one's box.
    pub max_overlap: f64,
    /// Accepts dark-to-bright edges for bright-to-dark ones, and the reverse.
    pub ignore_polarity: bool,
    /// Weakest edge, in values per px of the layer; `None` for three times the noise.
    pub min_contrast: Option<f64>,
    /// A runner-up above this share of a match's score makes it ambiguous, 0.5 to 1.
    pub ambiguous_at: f64,
    /// Candidates carried from the coarsest level, 8 to 5000. More find weaker instances in clutter.
    pub candidates: usize,
}

/// What the least squares may change besides the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Free {
    /// Whether the turn may change.
    pub angle: bool,
    /// Whether the scale may change.
    pub scale: bool,
}

/// Number of candidates where several matches are wanted.
const SEVERAL: usize = 2000;

impl Default for SearchOptions {
    fn default() -> Self {
        SearchOptions {
            angles_deg: [-180.0, 180.0],
            scales: [1.0, 1.0],
            min_score: 0.6,
            max_matches: 1,
            max_overlap: 0.5,
            ignore_polarity: false,
            min_contrast: None,
            ambiguous_at: 0.9,
            candidates: 200,
        }
    }
}

impl SearchOptions {
    /// Most matches of one search.
    pub const MOST_MATCHES: usize = 1000;

    /// Whether a turn (rad) lies in the range, or outside by no more than `slack` (rad).
    pub(super) fn holds_angle(&self, angle: f64, slack: f64) -> bool {
        let [first, last] = self.angles_deg.map(f64::to_radians);
        // With enough slack every turn is held; the slack is infinite where the turn is undetermined.
        let width = last - first + 2.0 * slack;
        width >= std::f64::consts::TAU || (angle - first + slack).rem_euclid(std::f64::consts::TAU) <= width
    }

    /// Whether a scale lies in the range, or outside by no more than `slack`.
    pub(super) fn holds_scale(&self, scale: f64, slack: f64) -> bool {
        let [least, most] = self.scales;
        (least - slack..=most + slack).contains(&scale)
    }

    /// Whether turn and scale are measured: a range of a single value fixes them.
    pub(super) fn free(&self) -> Free {
        Free { angle: self.angles_deg[1] > self.angles_deg[0], scale: self.scales[1] > self.scales[0] }
    }

    /// The same options for at most this number of matches; for several, weaker candidates are carried along too.
    pub fn at_most(self, matches: usize) -> SearchOptions {
        let candidates = if matches > 1 { SEVERAL } else { self.candidates };
        SearchOptions { max_matches: matches, candidates, ..self }
    }

    /// A turn (rad) in degrees within the requested range: 350 of 0..360, -10 of -180..180.
    pub fn turn_deg(&self, angle: f64) -> f64 {
        let first = self.angles_deg[0];
        // By rounding, a turn that is held may lie slightly below the first.
        first - 1.0 + (angle.to_degrees() - first + 1.0).rem_euclid(360.0)
    }

    /// Refuses options outside their ranges.
    pub fn check(&self) -> Result<()> {
        let bad = |what: String| Err(Fault::usage(what).next("correct the search options"));
        let [a0, a1] = self.angles_deg;
        if !(a0.is_finite() && a1.is_finite() && a1 >= a0 && a1 - a0 <= 360.0 + 1e-9) {
            return bad(format!("angles_deg are {a0} to {a1}, wanted ascending and at most 360 apart"));
        }
        let [s0, s1] = self.scales;
        if !(s0 >= 0.2 && s1 >= s0 && s1 <= 5.0) {
            return bad(format!("scales are {s0} to {s1}, wanted ascending within 0.2 to 5"));
        }
        if !(0.1..=1.0).contains(&self.min_score) {
            return bad(format!("min_score is {}; allowed: 0.1 to 1", self.min_score));
        }
        if !(1..=Self::MOST_MATCHES).contains(&self.max_matches) {
            return bad(format!("max_matches is {}; allowed: 1 to {}", self.max_matches, Self::MOST_MATCHES));
        }
        if !(0.0..=1.0).contains(&self.max_overlap) {
            return bad(format!("max_overlap is {}; allowed: 0 to 1", self.max_overlap));
        }
        if self.min_contrast.is_some_and(|c| !(c > 0.0 && c.is_finite())) {
            return bad("min_contrast must be above 0".into());
        }
        if !(0.5..=1.0).contains(&self.ambiguous_at) {
            return bad(format!("ambiguous_at is {}; allowed: 0.5 to 1", self.ambiguous_at));
        }
        if !(8..=5000).contains(&self.candidates) {
            return bad(format!("candidates is {}; allowed: 8 to 5000", self.candidates));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold_their_limits_and_what_nothing_tells() {
        let range = |a: f64, b: f64| SearchOptions { angles_deg: [a, b], ..SearchOptions::default() };
        let holds = |o: &SearchOptions, degrees: f64, slack: f64| o.holds_angle(degrees.to_radians(), slack);
        let five = range(-5.0, 5.0);
        assert!([-5.0, 5.0, 355.0, 725.0].iter().all(|&d| holds(&five, d, 1e-9)));
        assert!([-5.1, 5.1, 180.0].iter().all(|&d| !holds(&five, d, 1e-9)) && holds(&five, 5.1, 0.002));
        assert!(holds(&range(170.0, 190.0), -175.0, 0.0) && holds(&range(30.0, 30.0), 390.0, 1e-9));
        // A round part: its turn is arbitrary, which must not reject it.
        assert!(holds(&five, 180.0, f64::INFINITY) && holds(&five, 90.0, 3.5) && !holds(&five, 90.0, 1.0));
        let small = SearchOptions { scales: [0.9, 1.1], ..SearchOptions::default() };
        assert!(small.holds_scale(1.1, 1e-9) && !small.holds_scale(1.2, 0.05) && small.holds_scale(3.0, f64::INFINITY));
    }
}
