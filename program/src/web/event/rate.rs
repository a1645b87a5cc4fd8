//! In: a growing count. Out: how much it grows in a second, over the last ten. Pure.
//! Frame and unit: 1/s.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time over which a rate is taken, and how often a count is kept meanwhile.
const OVER: Duration = Duration::from_secs(10);
const KEPT: Duration = Duration::from_millis(500);

/// The last counts, oldest first; never empty.
pub(super) struct Rate(VecDeque<(Instant, u64)>);

impl Rate {
    /// The rate of a count that is 0 now.
    pub fn new(now: Instant) -> Rate {
        Rate([(now, 0)].into())
    }

    /// Takes the present count; returns the rate.
    pub fn count(&mut self, count: u64, now: Instant) -> f64 {
        // The newest count older than the time stays: between it and now the rate is taken.
        while self.0.len() > 1 && now.saturating_duration_since(self.0[1].0) >= OVER {
            self.0.pop_front();
        }
        let (oldest, was) = self.0[0];
        if self.0.back().is_none_or(|(last, _)| now.saturating_duration_since(*last) >= KEPT) {
            self.0.push_back((now, count));
        }
        let passed = now.saturating_duration_since(oldest).as_secs_f64();
        if passed > 0.0 { count.saturating_sub(was) as f64 / passed } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_is_that_of_the_last_seconds() {
        let begun = Instant::now();
        let mut rate = Rate::new(begun);
        let mut last = 0.0;
        for k in 1..=600 {
            last = rate.count(5 * k, begun + Duration::from_millis(100 * k));
        }
        assert!((last - 50.0).abs() < 1e-9, "{last}");
        // Nothing comes any more.
        for k in 601..=720 {
            last = rate.count(3000, begun + Duration::from_millis(100 * k));
        }
        assert_eq!(last, 0.0);
        assert!(rate.0.len() <= 22, "{}", rate.0.len());
    }
}
