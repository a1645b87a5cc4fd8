//! Whether the controller's time runs as this machine's does: the speed of the arm is measured by it; s.

use super::super::TimedPose;
use std::time::{Duration, Instant};

/// A second of the controller's lasts between half and twice as long here (as for lines of poses, `capture::pair`):
/// another rate means another unit, or stamps that stand still.
pub const RATE: (f64, f64) = (0.5, 2.0);
/// Rates are judged over at least this time: stamps are whole milliseconds, and poses as old as a cycle of the
/// controller.
pub const RATE_SPAN: Duration = Duration::from_millis(100);

/// Compares the stamps of poses with when they were asked for and when they were here.
#[derive(Debug, Default)]
pub struct Clocks {
    since: Option<(Instant, Instant, f64)>,
}

impl Clocks {
    /// Why the controller's stamps cannot be believed. How long the answers took does not matter: a pose was read
    /// between question and answer, and only a rate that no moment between them explains is wrong.
    pub fn judge(&mut self, pose: &TimedPose) -> Option<String> {
        let device = pose.device?.as_secs_f64();
        let Some((asked, here, before)) = self.since else {
            self.since = Some((pose.asked, pose.here, device));
            return None;
        };
        let least = pose.asked.saturating_duration_since(here);
        if least < RATE_SPAN {
            return None;
        }
        let most = pose.here.saturating_duration_since(asked).as_secs_f64();
        let (passed, least) = (device - before, least.as_secs_f64());
        // Where answers take long the time since is known badly: it is taken over longer.
        if most < 2.0 * least {
            self.since = Some((pose.asked, pose.here, device));
        }
        let wrong = passed < RATE.0 * least || passed > RATE.1 * most;
        wrong.then(|| {
            format!(
                "the controller's time went on by {:.3} s within {least:.3} to {most:.3} s, a rate of {} to {} is \
                 allowed: \
                 its stamps stand still or are in another unit, and speed cannot be watched",
                passed, RATE.0, RATE.1
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rigid;

    fn judged(stamps: impl Fn(f64) -> f64, answer_ms: u64) -> Option<String> {
        let (begun, mut clocks) = (Instant::now(), Clocks::default());
        (0..100).find_map(|k| {
            let asked = begun + Duration::from_millis(k * (4 + answer_ms));
            let here = asked + Duration::from_millis(answer_ms);
            let read = (asked - begun).as_secs_f64() + 0.4e-3 * answer_ms as f64;
            let device = Some(Duration::from_secs_f64(stamps(read)));
            clocks.judge(&TimedPose { base_from_flange: Rigid::identity(), figure: None, asked, here, device })
        })
    }

    #[test]
    fn stamps_in_another_unit_or_standing_still_are_seen_and_slow_answers_are_not() {
        for answer_ms in [1, 30, 700] {
            // Whole milliseconds, a cycle of 8 ms.
            assert_eq!(judged(|t| (t * 125.0).floor() / 125.0, answer_ms), None);
            assert_eq!(judged(|t| 40.0 + 1.4 * t, answer_ms), None);
            for wrong in [0.0, 1e-3, 0.3, 1e3] {
                assert!(judged(|t| 40.0 + wrong * t, answer_ms).is_some(), "{wrong} {answer_ms}");
            }
            assert!(judged(|t| 4000.0 - t, answer_ms).is_some(), "backwards");
        }
        assert!(judged(|t| 40.0 + 2.5 * t, 1).is_some());
    }
}
