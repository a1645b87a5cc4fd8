//! In: the times at which messages were recorded. Out: the moments at which they are played.
//! Frame and unit: ns; seconds where they are floats.

use std::time::{Duration, Instant};

/// Time between two looks at whether to end.
const TICK: Duration = Duration::from_millis(50);
/// A message on the terminal announces a longer pause.
const LONG: Duration = Duration::from_secs(30);

/// The clock of a file that is played.
pub struct Pace {
    rate: f64,
    begun: Option<(u64, Instant)>,
}

impl Pace {
    pub fn new(rate: f64) -> Pace {
        Pace { rate, begun: None }
    }

    /// Time from the first message to this one as it is played. A message that was recorded before the first one is not
    /// waited for.
    fn after(&self, first: u64, at: u64) -> Duration {
        let seconds = at.saturating_sub(first) as f64 / 1e9 / self.rate;
        Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
    }

    /// Waits until it is time for a message. False if it is to stop.
    pub fn wait(&mut self, log_time: u64, stop: &dyn Fn() -> bool) -> bool {
        let (first, begun) = *self.begun.get_or_insert_with(|| (log_time, Instant::now()));
        let after = self.after(first, log_time);
        let mut told = false;
        loop {
            let left = after.saturating_sub(begun.elapsed());
            if left.is_zero() {
                return true;
            }
            if stop() {
                return false;
            }
            if left > LONG && !told {
                told = true;
                eprintln!("the next message is due in {:.0} s", left.as_secs_f64());
            }
            std::thread::sleep(left.min(TICK));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_at_their_distance() {
        let pace = Pace::new(0.5);
        assert_eq!(pace.after(5_000_000_000, 5_250_000_000), Duration::from_millis(500));
        assert_eq!(pace.after(5, 3), Duration::ZERO);
        let begun = Instant::now();
        let mut pace = Pace::new(2.0);
        let never = || false;
        assert!(pace.wait(1_000_000_000, &never) && pace.wait(1_200_000_000, &never));
        let took = begun.elapsed();
        assert!((Duration::from_millis(99)..Duration::from_secs(5)).contains(&took), "{took:?}");
        assert!(!pace.wait(u64::MAX, &|| true));
    }
}
