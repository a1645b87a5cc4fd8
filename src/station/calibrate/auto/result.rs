//! In: the records of a joint solve, a check on poses that the solve did not use, the reason of the end. Out: the
//! verdict with its reasons.
//! Frame and unit: mm.

use super::super::joint::run::JointResult;
use super::check::SelfCheck;
use super::options::AutoRun;
use crate::rig::Verdict;

/// Why no further stop was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// The expected error is below the target.
    Target,
    /// The expected error does not fall any more.
    Stalled,
    /// The allowed number of stops is reached.
    Most,
    /// No pose from which the board can be seen is allowed.
    NoPose,
}

/// Result of [`super::procedure::calibrate_auto`].
pub struct AutoResult {
    /// The rig.
    pub joint: JointResult,
    /// Expected error of a scanned point after each stop of the solve, mm rms; the first is after the small moves.
    pub expected_mm: Vec<f64>,
    /// Number of stops in the solve.
    pub stops: usize,
    /// Why it ended.
    pub ended: Ended,
    /// The check on poses that no solve used; `None` if no such pose was allowed.
    pub check: Option<SelfCheck>,
}

impl AutoResult {
    /// Adds the findings of the check and of the end to every record.
    pub(super) fn judge(&mut self, run: &AutoRun, stranded: Option<String>) {
        let mut reasons: Vec<String> =
            stranded.into_iter().map(|why| format!("the arm did not return to its first pose: {why}")).collect();
        let mut worst = Verdict::Good;
        let last = self.expected_mm.last().copied().unwrap_or(f64::INFINITY);
        if last > run.target_mm {
            let why = match self.ended {
                Ended::Stalled => "more stops do not lower the error",
                Ended::NoPose => "no other allowed pose sees the board",
                _ => "no more stops are allowed",
            };
            reasons.push(format!("the target of {} mm is not reached ({last:.4} mm): {why}", run.target_mm));
            worst = Verdict::Usable;
        }
        match &self.check {
            Some(c) => {
                reasons.push(format!(
                    "{} poses that no solve saw: points lie {:.4} mm from the board (rms), {:.4} mm were expected",
                    c.stops, c.off_mm, c.expected_mm
                ));
                if c.off_mm > 2.0 * c.expected_mm {
                    worst = Verdict::Usable;
                    reasons.push("the error is more than twice the expected one: the model misses a cause".into());
                }
            }
            None => {
                worst = Verdict::Usable;
                reasons.push("the result is not checked: no further pose is allowed".into());
            }
        }
        self.joint.remark(worst, &reasons);
    }
}
