//! In: the size of what each thread is about to decode. Out: permission to decode it, so that all threads together stay
//! within one limit.
//! Frame and unit: bytes.

use std::sync::{Condvar, Mutex, PoisonError};

/// Memory that is lent in parts.
pub struct Budget {
    left: Mutex<u64>,
    returned: Condvar,
    most: u64,
}

/// A part of the budget; it is returned when it is dropped.
pub struct Part<'a> {
    budget: &'a Budget,
    bytes: u64,
}

impl Budget {
    pub const fn new(most: u64) -> Budget {
        Budget { left: Mutex::new(most), returned: Condvar::new(), most }
    }

    /// Waits until this number of bytes is left. A request above the limit gets the whole budget: one picture of any
    /// size is decoded alone. A thread that holds a part must not wait for another.
    pub fn hold(&self, bytes: u64) -> Part<'_> {
        let bytes = bytes.min(self.most);
        let left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let mut left = self.returned.wait_while(left, |left| *left < bytes).unwrap_or_else(PoisonError::into_inner);
        *left -= bytes;
        Part { budget: self, bytes }
    }
}

impl Drop for Part<'_> {
    fn drop(&mut self) {
        *self.budget.left.lock().unwrap_or_else(PoisonError::into_inner) += self.bytes;
        self.budget.returned.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn threads_together_stay_within_the_limit() {
        let (budget, now, most) = (Budget::new(100), AtomicU64::new(0), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for i in 0..8u64 {
                let (budget, now, most) = (&budget, &now, &most);
                scope.spawn(move || {
                    for k in 0..200 {
                        let bytes = (i * 31 + k * 17) % 130;
                        let _part = budget.hold(bytes);
                        let held = now.fetch_add(bytes.min(100), Ordering::SeqCst) + bytes.min(100);
                        most.fetch_max(held, Ordering::SeqCst);
                        std::thread::yield_now();
                        now.fetch_sub(bytes.min(100), Ordering::SeqCst);
                    }
                });
            }
        });
        assert!((50..=100).contains(&most.load(Ordering::SeqCst)), "{most:?}");
    }
}
