//! In: an expected error, the application's tolerance and its depths. Out: the verdict with its reasons.
//! Frame and unit: along the camera's optical axis (of a profile sensor: its z), mm.

use crate::fault::{Fault, Result};
use crate::rig::{Verdict, Volume};
use crate::solve::End;

/// Share of the sensor's field of view that counts as the tolerance if none is stated: 0.25 mm for insertion at a
/// view of 167 mm, as in the paper. Parts are assumed to be as large as the view that they are measured in.
const TOLERATED_SHARE: f64 = 1.5e-3;

/// What the user stated beforehand; the rest follows from the data ([`Asked::limits`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Asked {
    /// Depths at which the result is judged.
    pub working: Option<Volume>,
    /// Tolerance of the application, mm; above 0.
    pub tolerance_mm: Option<f64>,
}

impl Asked {
    /// Refuses a near depth beyond the far depth, and a tolerance that is not above 0.
    pub fn check(&self) -> Result<()> {
        let w = self.working.as_ref().map_or([0.0, 0.0], |w| [w.near_mm, w.far_mm]);
        let tolerance = self.tolerance_mm.unwrap_or(1.0);
        if !(w[0] <= w[1] && w[0].is_finite() && w[1].is_finite() && tolerance > 0.0 && tolerance.is_finite()) {
            return Err(Fault::usage(format!(
                "judged from {} to {} mm with a tolerance of {tolerance} mm: near at most far, tolerance above 0",
                w[0], w[1]
            ))
            .next("choose values in these ranges"));
        }
        Ok(())
    }
    /// `seen`: depths of the data. `view_mm`: width of the sensor's field of view at a depth, mm.
    pub fn limits(&self, seen: &Volume, view_mm: impl Fn(f64) -> f64) -> Limits {
        let working = self.working.clone().unwrap_or_else(|| seen.clone());
        let view = view_mm(working.middle());
        let (tolerance_mm, tolerance_from) = match self.tolerance_mm {
            Some(mm) => (mm, "stated".to_string()),
            None => {
                let words = format!("{} % of the view", 100.0 * TOLERATED_SHARE);
                (TOLERATED_SHARE * view, format!("{words}, {} mm", Volume::new(0.0, view, "").depth(view)))
            }
        };
        Limits { tolerance_mm, tolerance_from, working }
    }
}

/// Largest expected error for the verdicts good and usable, and the depths at which it is judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Good if the expected error (1 sigma) is at most half of this, usable if it is at most twice this, mm.
    pub tolerance_mm: f64,
    /// Where the tolerance comes from, in words.
    pub tolerance_from: String,
    /// Depths at which the result is judged.
    pub working: Volume,
}

impl Limits {
    /// Depth halfway through the working range, mm.
    pub fn middle(&self) -> f64 {
        self.working.middle()
    }
    /// Largest expected error (1 sigma) for the verdict usable: twice the tolerance, mm.
    pub fn usable_mm(&self) -> f64 {
        2.0 * self.tolerance_mm
    }
    /// The verdict by the expected error alone. `says`: the expected error and its place, in words.
    pub fn by_error(&self, expected_mm: f64, says: String) -> Judgement {
        let verdict = if expected_mm <= 0.5 * self.tolerance_mm {
            Verdict::Good
        } else if expected_mm <= self.usable_mm() {
            Verdict::Usable
        } else {
            Verdict::BadlyDetermined
        };
        let mut j = Judgement { verdict, reasons: vec![says], advice: Vec::new() };
        if verdict != Verdict::Good {
            j.reasons.push(format!(
                "good up to {:.2$} mm, usable up to {:.2$} mm: half and twice the tolerance ({3})",
                0.5 * self.tolerance_mm,
                self.usable_mm(),
                (2.0 - self.tolerance_mm.log10()).ceil().clamp(2.0, 5.0) as usize,
                self.tolerance_from
            ));
        }
        j
    }
}

/// Collects reasons; the worst one determines the verdict.
#[derive(Clone, Debug)]
pub struct Judgement {
    /// The worst verdict so far.
    pub verdict: Verdict,
    /// Why, in words; one sentence each.
    pub reasons: Vec<String>,
    /// What to do about them, in words.
    pub advice: Vec<String>,
}

impl Judgement {
    /// If `when` holds, the verdict is at best this one.
    pub fn at_best(&mut self, verdict: Verdict, when: bool, reason: impl FnOnce() -> String) {
        if when {
            self.verdict = self.verdict.max(verdict);
            self.reasons.push(reason());
        }
    }
    /// A fit that did not end at a minimum is usable at best.
    pub fn ended(&mut self, end: End) {
        if let Some(remark) = end.remark() {
            self.at_best(Verdict::Usable, true, || remark.into());
        }
    }
    /// If `when` holds, adds this advice.
    pub fn advise(&mut self, when: bool, advice: impl FnOnce() -> String) {
        if when {
            self.advice.push(advice());
        }
    }
}

/// rms of the finite values; 0 without finite values.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (s, n) = values.filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    f64::sqrt(s / f64::max(n, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_that_had_not_come_to_rest_is_usable_at_best() {
        let limits =
            Asked { tolerance_mm: Some(1.0), ..Asked::default() }.limits(&Volume::new(100.0, 200.0, ""), |z| z);
        for (expected, found, hasty) in [
            (0.1, Verdict::Good, Verdict::Usable),
            (1.0, Verdict::Usable, Verdict::Usable),
            (9.0, Verdict::BadlyDetermined, Verdict::BadlyDetermined),
        ] {
            for (end, verdict) in [(End::Minimum, found), (End::Exhausted, hasty), (End::Stuck, hasty)] {
                let mut j = limits.by_error(expected, String::new());
                let before = j.reasons.len();
                j.ended(end);
                assert_eq!((j.verdict, j.reasons.len() - before), (verdict, usize::from(end != End::Minimum)));
            }
        }
    }
}
