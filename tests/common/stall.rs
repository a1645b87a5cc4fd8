//! In: a piece of work. Out: how long this machine kept a thread waiting that wanted to run meanwhile.
//! Frame and unit: times of this machine.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::time::{Duration, Instant};

const NAP: Duration = Duration::from_millis(2);
/// As many sleep beside the work: more than one for each core of a small machine, of which one may stand still alone.
const SLEEPERS: usize = 4;

/// Up when it is dropped, also by a panic.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Relaxed);
    }
}

/// Does the work; what came of it, and the longest by which a sleeper beside it woke too late.
pub fn longest_stall<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let (over, longest_ns) = (AtomicBool::new(false), AtomicU64::new(0));
    let came = std::thread::scope(|threads| {
        for _ in 0..SLEEPERS {
            threads.spawn(|| {
                while !over.load(Relaxed) {
                    let slept = Instant::now();
                    std::thread::sleep(NAP);
                    longest_ns.fetch_max(slept.elapsed().saturating_sub(NAP).as_nanos() as u64, Relaxed);
                }
            });
        }
        let _over = Over(&over);
        work()
    });
    (came, Duration::from_nanos(longest_ns.into_inner()))
}
