//! In: events of jobs and bar. Out: each to every viewer; who falls behind hears that, and asks for the whole state.
//! Frame and unit: none.

use super::Growing;
use crate::web::message::Event;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::sync::broadcast;

/// Events that wait for a slow viewer; all viewers share them, so memory does not grow with their number.
const WAITING: usize = 64;
/// Browsers at a time.
const MOST_VIEWERS: usize = 64;

/// Where events go.
pub struct Hub {
    /// As text: written once for all.
    events: broadcast::Sender<Arc<str>>,
    /// The height map of the scan that runs.
    pub growing: Growing,
    viewers: AtomicUsize,
}

impl Default for Hub {
    fn default() -> Hub {
        Hub { events: broadcast::channel(WAITING).0, growing: Growing::default(), viewers: AtomicUsize::new(0) }
    }
}

/// A place among the viewers, given back when it is dropped.
pub struct Seat(Arc<Hub>);

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Hub {
    /// Tells everybody; nobody is waited for.
    pub fn tell(&self, event: &Event) {
        if self.events.receiver_count() > 0 {
            let text = serde_json::to_string(event).expect("plain data");
            let _ = self.events.send(text.into());
        }
    }

    /// A place to look on from; `None` where all are taken.
    pub fn sit(self: &Arc<Hub>) -> Option<(Seat, broadcast::Receiver<Arc<str>>)> {
        if self.viewers.fetch_add(1, Ordering::Relaxed) >= MOST_VIEWERS {
            self.viewers.fetch_sub(1, Ordering::Relaxed);
            return None;
        }
        Some((Seat(self.clone()), self.events.subscribe()))
    }

    /// Browsers that look on.
    pub fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }
}
