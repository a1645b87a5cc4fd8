//! Checks that the controller's clock runs at the rate of this machine's, because the arm's speed is measured with
//! it; s.

use super::super::TimedPose;
use std::time::{Duration, Instant};

/// Allowed rate of the controller's clock: half to twice that of this machine's, as for lines of poses in
/// `capture::pair`. Another rate means another unit, or stamps that do not advance.
pub const RATE: (f64, f64) = (0.5, 2.0);
/// Rates are judged over at least this time: stamps are whole milliseconds, and a pose may be one controller cycle
/// old.
pub const RATE_SPAN: Duration = Duration::from_millis(100);

/// Compares the stamps of poses with the times of their requests and answers.
#[derive(Debug, Default)]
pub struct Clocks {
    since: Option<(Instant, Instant, f64)>,
}

impl Clocks {
    /// The reason why the controller's stamps cannot be trusted. The duration of the answers does not matter: a
    /// pose was read between request and answer, and only a rate that no moment between them explains is wrong.
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
        // Slow answers leave the elapsed time uncertain: it is then measured over a longer span.
        if most < 2.0 * least {
            self.since = Some((pose.asked, pose.here, device));
        }
        let wrong = passed < RATE.0 * least || passed > RATE.1 * most;
        wrong.then(|| {
            format!(
                "the controller's clock advanced by {:.3} s in {least:.3} to {most:.3} s, a rate of {} to {} is \
                 allowed: its time stamps stand still or have another unit, so the speed cannot be monitored",
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
            // Stamps in whole milliseconds, from a controller cycle of 8 ms.
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
