//! In: something that another thread or program will bring about. Out: whether it has; how long it takes is not judged.
//! Frame and unit: none.

use std::time::{Duration, Instant};

/// What has not come by then does not come.
const HANGS: Duration = Duration::from_secs(120);

/// Waits until something holds; false where it never does.
pub fn until(mut holds: impl FnMut() -> bool) -> bool {
    let begun = Instant::now();
    while begun.elapsed() < HANGS {
        if holds() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    holds()
}
