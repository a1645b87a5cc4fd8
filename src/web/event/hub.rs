//! In: events of jobs and bar. Out: each event to every viewer; a viewer that falls behind is notified, and
//! requests the whole state.
//! Frame and unit: none.

use super::Growing;
use crate::web::message::{Connection, Event};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use tokio::sync::broadcast;

/// Events queued for slow viewers; all viewers share the queue, so memory does not grow with their number.
const WAITING: usize = 64;
/// Most viewers at a time.
const MOST_VIEWERS: usize = 64;

/// Distributes events to viewers.
pub struct Hub {
    /// Events as text, serialized once for all viewers.
    events: broadcast::Sender<Arc<str>>,
    /// The height map of the running scan.
    pub growing: Growing,
    viewers: AtomicUsize,
    /// The link to an MQTT broker; None if no broker was named.
    broker: Mutex<Option<Connection>>,
}

impl Default for Hub {
    fn default() -> Hub {
        Hub {
            events: broadcast::channel(WAITING).0,
            growing: Growing::default(),
            viewers: AtomicUsize::new(0),
            broker: Mutex::default(),
        }
    }
}

/// A slot among the viewers, freed when it is dropped.
pub struct Seat(Arc<Hub>);

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Hub {
    /// Sends an event to all viewers, without waiting for any.
    pub fn tell(&self, event: &Event) {
        if self.events.receiver_count() > 0 {
            let text = serde_json::to_string(event).expect("plain data");
            let _ = self.events.send(text.into());
        }
    }

    /// A slot for a viewer; `None` if all are taken.
    pub fn sit(self: &Arc<Hub>) -> Option<(Seat, broadcast::Receiver<Arc<str>>)> {
        if self.viewers.fetch_add(1, Ordering::Relaxed) >= MOST_VIEWERS {
            self.viewers.fetch_sub(1, Ordering::Relaxed);
            return None;
        }
        Some((Seat(self.clone()), self.events.subscribe()))
    }

    /// Events for the program itself, which takes no viewer's slot.
    pub fn listen(&self) -> broadcast::Receiver<Arc<str>> {
        self.events.subscribe()
    }

    /// Whether anybody receives events.
    pub fn is_heard(&self) -> bool {
        self.events.receiver_count() > 0
    }

    /// Changes what is known of the link to the MQTT broker.
    pub fn link(&self, change: impl FnOnce(&mut Connection)) {
        let mut broker = self.broker.lock().unwrap_or_else(PoisonError::into_inner);
        change(broker.get_or_insert_with(|| Connection { door: "mqtt".into(), ..Connection::default() }));
    }

    /// The link to the MQTT broker; `None` if no broker was named.
    pub fn broker(&self) -> Option<Connection> {
        self.broker.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Number of viewers.
    pub fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }
}
