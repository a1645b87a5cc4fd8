//! In: work for a device that nobody waits for yet. Out: the work, done on other threads. None is running when the
//! device is gone: the process must not end, and unload the driver, while its compiler runs. Frame and unit: none.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, PoisonError, RwLock};

/// Whether work may begin. A thread that works holds the lock for reading.
pub(super) struct Background(Arc<RwLock<bool>>);

impl Default for Background {
    fn default() -> Background {
        Background(Arc::new(RwLock::new(true)))
    }
}

impl Background {
    /// Does work as soon as a thread is free, or never if the device is dropped first. A panic is caught here: the user
    /// of the result must panic again.
    pub(super) fn begin(&self, work: impl FnOnce() + Send + 'static) {
        let allowed = self.0.clone();
        rayon::spawn_fifo(move || {
            let allowed = allowed.read().unwrap_or_else(PoisonError::into_inner);
            if *allowed {
                let _ = catch_unwind(AssertUnwindSafe(work));
            }
        });
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        *self.0.write().unwrap_or_else(PoisonError::into_inner) = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::sync::mpsc::channel;
    use std::time::Duration;

    #[test]
    fn no_work_is_under_way_when_the_device_is_gone_and_a_panic_stays_where_it_is() {
        let background = Background::default();
        background.begin(|| panic!("expected by the test"));
        let done = Arc::new(AtomicBool::new(false));
        let ((told, begun), (go, may_end)) = (channel(), channel());
        let ends = done.clone();
        background.begin(move || {
            told.send(()).unwrap();
            may_end.recv().unwrap();
            ends.store(true, Ordering::SeqCst);
        });
        begun.recv_timeout(Duration::from_secs(60)).unwrap();
        let gone = std::thread::spawn(move || drop(background));
        std::thread::sleep(Duration::from_millis(100));
        assert!(!gone.is_finished() && !done.load(Ordering::SeqCst), "it goes while work is under way");
        go.send(()).unwrap();
        gone.join().unwrap();
        assert!(done.load(Ordering::SeqCst));
    }
}
