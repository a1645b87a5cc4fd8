//! In: speed of the cell's time. Out: the cell's time. It is held while a picture is rendered, because a real cell
//! does not wait for that.
//! Frame and unit: s of the cell since it was started.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Polling interval of a waiting thread.
const LOOK: Duration = Duration::from_micros(500);

struct Since {
    real: Instant,
    cell: f64,
    holds: usize,
}

/// The cell's time.
pub struct Clock {
    speed: f64,
    since: Mutex<Since>,
}

/// Holds the cell's time until it is dropped.
pub struct Held<'a>(&'a Clock);

impl Clock {
    /// `speed`: seconds of the cell per real second.
    pub fn new(speed: f64) -> Clock {
        Clock { speed, since: Mutex::new(Since { real: Instant::now(), cell: 0.0, holds: 0 }) }
    }

    fn since(&self) -> MutexGuard<'_, Since> {
        self.since.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn of(&self, since: &Since) -> f64 {
        since.cell + if since.holds > 0 { 0.0 } else { since.real.elapsed().as_secs_f64() * self.speed }
    }

    /// The cell's time, s.
    pub fn now(&self) -> f64 {
        self.of(&self.since())
    }

    /// Stops the cell's time until all holders have dropped their `Held`.
    pub fn hold(&self) -> Held<'_> {
        let mut since = self.since();
        since.cell = self.of(&since);
        since.holds += 1;
        Held(self)
    }

    /// Waits until the cell's time is `t`, at most `most` of real time; true if the time has come.
    pub fn wait(&self, t: f64, most: Duration) -> bool {
        let give_up = Instant::now() + most;
        loop {
            let left = t - self.now();
            if left <= 0.0 {
                return true;
            }
            let now = Instant::now();
            if now >= give_up {
                return false;
            }
            let nap = Duration::from_secs_f64((left / self.speed).clamp(0.0, 0.05)).max(LOOK);
            std::thread::sleep(nap.min(give_up - now).max(Duration::from_micros(50)));
        }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        let mut since = self.0.since();
        since.holds -= 1;
        if since.holds == 0 {
            since.real = Instant::now();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn held_time_stands_still() {
        let clock = Clock::new(100.0);
        std::thread::sleep(Duration::from_millis(5));
        let held = clock.hold();
        let then = clock.now();
        assert!(then >= 0.4 && !clock.wait(then + 0.1, Duration::from_millis(5)));
        assert_eq!(clock.now(), then);
        drop(held);
        assert!(clock.wait(then + 0.1, Duration::from_secs(5)));
    }
}
