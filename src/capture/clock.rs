//! In: the system's clock. Out: the host's time, which runs evenly while the program runs; what another clock said between two
//! of its moments.
//! Frame and unit: ns; the host's time counts from the Unix epoch.

use std::sync::OnceLock;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

/// The host's time, ns since the Unix epoch. The system's clock is asked once; from then on the steady one counts, so that
/// nobody who sets the clock makes time jump.
pub fn now_ns() -> u64 {
    static START: OnceLock<(u64, Instant)> = OnceLock::new();
    let (epoch, began) = START.get_or_init(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        (since.as_nanos() as u64, Instant::now())
    });
    epoch + began.elapsed().as_nanos() as u64
}

/// Another clock was read between two moments of the host's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RoundTrip {
    /// Host, ns: the question left.
    pub before_ns: u64,
    /// The other clock, ns: its answer.
    pub there_ns: u64,
    /// Host, ns: the answer was here.
    pub after_ns: u64,
}
