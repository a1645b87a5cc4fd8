//! In: faults that a test or a person switches on. Out: the same, as the servers query them.
//! Frame and unit: ms, bytes, counts.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Faults on the wire; all off at first. May be changed at any time.
#[derive(Debug, Default)]
pub struct Faults {
    /// Delay of each answer, ms.
    pub delay_ms: AtomicU64,
    /// Answers over TCP are sent in pieces of this many bytes; 0: whole.
    pub piece: AtomicU64,
    /// An answer over TCP waits for the next one, and both are sent together.
    pub merge: AtomicBool,
    /// Before each answer, one with a serial that no client used is sent.
    pub foreign: AtomicBool,
    /// Number of interim replies before each answer.
    pub interim: AtomicU64,
    /// Number of next answers that are lost: computed, remembered, not sent.
    pub lose: AtomicU64,
    /// Number of next calls that close their connection instead of an answer; the calls are executed.
    pub cut: AtomicU64,
    /// The controller is unreachable: connections are closed at once.
    pub gone: AtomicBool,
    /// The camera is unreachable.
    pub camera_gone: AtomicBool,
}

impl Faults {
    /// Uses up one of the remaining faults; false if none is left.
    pub(super) fn take(of: &AtomicU64) -> bool {
        of.fetch_update(Ordering::SeqCst, Ordering::SeqCst, |n| n.checked_sub(1)).is_ok()
    }
    /// Whether a fault is on.
    pub(super) fn on(of: &AtomicBool) -> bool {
        of.load(Ordering::Relaxed)
    }
    /// Switches all faults off.
    pub fn clear(&self) {
        for n in [&self.delay_ms, &self.piece, &self.interim, &self.lose, &self.cut] {
            n.store(0, Ordering::SeqCst);
        }
        for b in [&self.merge, &self.foreign, &self.gone, &self.camera_gone] {
            b.store(false, Ordering::SeqCst);
        }
    }
}
