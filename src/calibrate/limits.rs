//! In: an expected error and reasons against trusting it. Out: the verdict.
//! Frame and unit: mm at the working distance.

use crate::fault::{Fault, Result};
use crate::rig::Verdict;

/// What a calibration must promise to be called good or usable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Expected error (1 sigma) at the working distance up to which a calibration is good, mm; above 0.
    pub good_mm: f64,
    /// The same for usable, mm; at least `good_mm`.
    pub usable_mm: f64,
    /// Nearest and farthest working distance along the optical axis, mm.
    pub working_mm: [f64; 2],
}

impl Default for Limits {
    /// Half and twice the insertion tolerance of 0.25 mm that the paper's parts need, at its distances.
    fn default() -> Self {
        Limits { good_mm: 0.12, usable_mm: 0.5, working_mm: [110.0, 210.0] }
    }
}

impl Limits {
    pub fn check(&self) -> Result<()> {
        let [near, far] = self.working_mm;
        if !(self.good_mm > 0.0 && self.usable_mm >= self.good_mm && near > 0.0 && far >= near && far.is_finite()) {
            return Err(Fault::usage(format!(
                "limits: good_mm {} (above 0), usable_mm {} (at least good_mm), working distance {near} to {far} mm",
                self.good_mm, self.usable_mm
            ))
            .next("choose values in these ranges"));
        }
        Ok(())
    }
    pub fn middle(&self) -> f64 {
        (self.working_mm[0] + self.working_mm[1]) / 2.0
    }
    /// The verdict that the expected error alone allows.
    pub fn by_error(&self, expected_mm: f64) -> Verdict {
        if expected_mm <= self.good_mm {
            Verdict::Good
        } else if expected_mm <= self.usable_mm {
            Verdict::Usable
        } else {
            Verdict::BadlyDetermined
        }
    }
}

/// Collects reasons; the worst one makes the verdict.
#[derive(Clone, Debug)]
pub struct Judgement {
    pub verdict: Verdict,
    pub reasons: Vec<String>,
    pub advice: Vec<String>,
}

impl Judgement {
    pub fn new(verdict: Verdict, reason: String) -> Judgement {
        Judgement { verdict, reasons: vec![reason], advice: Vec::new() }
    }
    /// Where `when` holds, the verdict is at best this one.
    pub fn at_best(&mut self, verdict: Verdict, when: bool, reason: impl FnOnce() -> String) {
        if when {
            self.verdict = self.verdict.max(verdict);
            self.reasons.push(reason());
        }
    }
    pub fn advise(&mut self, when: bool, advice: impl FnOnce() -> String) {
        if when {
            self.advice.push(advice());
        }
    }
}

/// rms of some numbers; 0 for none, infinite ones left out.
pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (s, n) = values.filter(|v| v.is_finite()).fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    f64::sqrt(s / f64::max(n, 1.0))
}
