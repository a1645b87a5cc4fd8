//! In: what a test or a person wants to go wrong. Out: the same, as the servers ask for it.
//! Frame and unit: ms, bytes, counts.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// What goes wrong on the wire; all off at first. May be changed at any time.
#[derive(Debug, Default)]
pub struct Faults {
    /// Each answer comes so much later, ms.
    pub delay_ms: AtomicU64,
    /// Answers over TCP leave in pieces of so many bytes; 0: whole.
    pub piece: AtomicU64,
    /// Answers over TCP wait until the next one leaves, and both leave together.
    pub merge: AtomicBool,
    /// Before each answer comes one to a serial that nobody sent.
    pub foreign: AtomicBool,
    /// Before each answer come so many interim replies.
    pub interim: AtomicU64,
    /// So many of the next answers are lost: made, remembered, not sent.
    pub lose: AtomicU64,
    /// So many of the next calls end their connection instead of an answer; what they ask for is done.
    pub cut: AtomicU64,
    /// The controller is not there: connections are closed at once.
    pub gone: AtomicBool,
    /// The camera is not there.
    pub camera_gone: AtomicBool,
}

impl Faults {
    /// Takes one of a number of faults that is left.
    pub(super) fn take(of: &AtomicU64) -> bool {
        of.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |n| n.checked_sub(1)).is_ok()
    }
    /// Whether a fault is on.
    pub(super) fn on(of: &AtomicBool) -> bool {
        of.load(Ordering::Relaxed)
    }
    /// Everything as it should be.
    pub fn clear(&self) {
        for n in [&self.delay_ms, &self.piece, &self.interim, &self.lose, &self.cut] {
            n.store(0, Ordering::SeqCst);
        }
        for b in [&self.merge, &self.foreign, &self.gone, &self.camera_gone] {
            b.store(false, Ordering::SeqCst);
        }
    }
}
