//! In: what a station shows, again and again. Out: the newest of it, and whoever waits for it.
//! Frame and unit: s.

use sheetlight_registers::{Job, Seen};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A station that comes back within this time shows how its job ended.
const LOST: Duration = Duration::from_secs(30);

/// What a station shows.
#[derive(Clone, Debug)]
pub struct Shown {
    /// Or why it is not reached.
    pub seen: Result<Seen, String>,
    /// Since when it is reached or not.
    pub since: Instant,
}

/// The newest of what is shown.
pub struct Watch {
    shown: Mutex<Shown>,
    changed: Condvar,
}

impl Default for Watch {
    fn default() -> Watch {
        let seen = Err("it has not been reached yet".to_owned());
        Watch { shown: Mutex::new(Shown { seen, since: Instant::now() }), changed: Condvar::new() }
    }
}

impl Watch {
    fn lock(&self) -> MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The station shows this, or is not reached.
    pub fn saw(&self, seen: Result<Seen, String>) {
        let mut shown = self.lock();
        if shown.seen.is_ok() != seen.is_ok() {
            match &seen {
                Ok(_) => eprintln!("the station is reached"),
                Err(why) => eprintln!("the station is not reached: {why}; it is tried again"),
            }
            shown.since = Instant::now();
        }
        shown.seen = seen;
        self.changed.notify_all();
    }

    /// The newest.
    pub fn newest(&self) -> Shown {
        self.lock().clone()
    }

    /// The job as it was at its end.
    ///
    /// # Errors
    /// In words: the station was lost, or shows another job.
    pub fn end_of(&self, job: u32) -> Result<Job, String> {
        let mut shown = self.lock();
        loop {
            let patience = match &shown.seen {
                Ok(seen) if seen.job.number != job => return Err("the station shows another job since then".into()),
                Ok(seen) if seen.job.stage.is_over() => return Ok(seen.job.clone()),
                Ok(_) => LOST,
                Err(why) => {
                    let left = LOST.saturating_sub(shown.since.elapsed());
                    if left.is_zero() {
                        return Err(format!("the station is lost: {why}"));
                    }
                    left
                }
            };
            shown = self.changed.wait_timeout(shown, patience).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight_registers::Stage;
    use std::sync::Arc;

    fn seen(number: u32, stage: Stage) -> Result<Seen, String> {
        Ok(Seen { jobs: true, job: Job { number, stage, ..Job::default() }, ..Seen::default() })
    }

    #[test]
    fn a_job_is_waited_for_also_over_a_lost_station() {
        let watch = Arc::new(Watch::default());
        watch.saw(seen(7, Stage::Runs));
        let waits = std::thread::spawn({
            let watch = watch.clone();
            move || watch.end_of(7)
        });
        for shown in [Err("gone".to_owned()), seen(7, Stage::Runs), seen(7, Stage::Done)] {
            std::thread::sleep(Duration::from_millis(20));
            assert!(!waits.is_finished());
            watch.saw(shown);
        }
        assert_eq!(waits.join().unwrap().unwrap().stage, Stage::Done);
        watch.saw(seen(8, Stage::Runs));
        assert!(watch.end_of(7).unwrap_err().contains("another job"));
    }
}
