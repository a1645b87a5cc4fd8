//! In: a pressed button, a signal, an expired lease. Out: whether the arm has to stop, and why.
//! Frame and unit: times of this machine.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

#[derive(Default)]
struct Inside {
    pressed: AtomicBool,
    /// The reason, if it was not the button itself.
    reason: Mutex<Option<String>>,
    signals: Mutex<Vec<Arc<AtomicBool>>>,
    lease: Mutex<Option<(Instant, Duration)>>,
}

/// Stops a motion from any thread. All clones share one button.
#[derive(Clone, Default)]
pub struct StopButton(Arc<Inside>);

impl StopButton {
    /// Stops any motion; nothing moves until [`StopButton::release`].
    pub fn press(&self) {
        self.0.pressed.store(true, Ordering::SeqCst);
    }
    /// The same with a reason, which is then reported; the first reason is retained.
    pub fn press_for(&self, why: &str) {
        self.0.reason.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| why.to_owned());
        self.press();
    }
    /// Lets motions be proposed again.
    pub fn release(&self) {
        *self.0.reason.lock().unwrap_or_else(PoisonError::into_inner) = None;
        self.0.pressed.store(false, Ordering::SeqCst);
    }
    /// Registers a flag (Ctrl-C) that counts as a pressed button while it is set.
    pub fn listen(&self, flag: Arc<AtomicBool>) {
        self.0.signals.lock().unwrap_or_else(PoisonError::into_inner).push(flag);
    }
    /// From now on the operator has to call [`StopButton::renew`] at least this often.
    pub fn lease(&self, every: Duration) {
        *self.lock() = Some((Instant::now(), every));
    }
    /// Renews the lease: the operator is still present.
    pub fn renew(&self) {
        if let Some((since, _)) = self.lock().as_mut() {
            *since = Instant::now();
        }
    }
    /// Ends the lease: no renewal is required any more.
    pub fn end_lease(&self) {
        *self.lock() = None;
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<(Instant, Duration)>> {
        self.0.lease.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The reason why nothing may move; `None` if motion is allowed.
    pub fn why(&self) -> Option<String> {
        if self.0.pressed.load(Ordering::SeqCst) {
            let reason = self.0.reason.lock().unwrap_or_else(PoisonError::into_inner).clone();
            return Some(reason.unwrap_or_else(|| "STOP was pressed".into()));
        }
        let signals = self.0.signals.lock().unwrap_or_else(PoisonError::into_inner);
        if signals.iter().any(|s| s.load(Ordering::SeqCst)) {
            return Some("the program was told to end".into());
        }
        let lease = *self.lock();
        let late = lease.filter(|(since, every)| since.elapsed() > *every)?;
        Some(format!(
            "the operator's lease ran out: nothing was heard for {:.1} s, limit {:.1} s",
            late.0.elapsed().as_secs_f64(),
            late.1.as_secs_f64()
        ))
    }
}
