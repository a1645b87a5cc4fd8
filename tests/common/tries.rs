//! In: a trial whose outcome the clock decides. Out: what came of the first that this machine did not spoil: a core
//! that was given to others is not ours to answer for.
//! Frame and unit: times of this machine.

use super::stall::longest_stall;
use std::time::Duration;

/// A machine with nothing else to do wakes who sleeps sooner than this.
const STALL: Duration = Duration::from_millis(5);

/// Tries at most so often, again only where the machine kept a thread waiting in the meantime. `Err` is for what that
/// can bring about, and says what; what is wrong however long the machine takes has to panic within the trial.
pub fn tries<T>(most: usize, trial: impl Fn() -> Result<T, String>) -> T {
    let mut spoilt = Vec::new();
    loop {
        let (came, stall) = longest_stall(&trial);
        let why = match came {
            Ok(came) => return came,
            Err(why) => format!("{why} (a thread was kept waiting for {stall:.1?})"),
        };
        println!("try {}: {why}", spoilt.len() + 1);
        spoilt.push(why);
        let again = stall > STALL && spoilt.len() < most;
        assert!(again, "not as it has to be, {} of {most} tries:\n{}", spoilt.len(), spoilt.join("\n"));
    }
}

/// A trial's verdict: `came` where it is as it has to be, else why not.
pub fn judged<T>(came: T, as_it_has_to_be: bool, why: impl std::fmt::Display) -> Result<T, String> {
    if as_it_has_to_be { Ok(came) } else { Err(why.to_string()) }
}
