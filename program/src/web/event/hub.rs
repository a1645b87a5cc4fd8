//! In: events of jobs and bar. Out: each event to every viewer; a viewer that falls behind is notified, and
//! requests the whole state. Also what is known of the links to other programs.
//! Frame and unit: none.

use super::Growing;
use super::rate::Rate;
use crate::web::message::{Connection, Event};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;
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
    /// Links to other programs by their door.
    links: Mutex<BTreeMap<&'static str, (Connection, Rate)>>,
}

impl Default for Hub {
    fn default() -> Hub {
        Hub {
            events: broadcast::channel(WAITING).0,
            growing: Growing::default(),
            viewers: AtomicUsize::new(0),
            links: Mutex::default(),
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

    fn doors(&self) -> MutexGuard<'_, BTreeMap<&'static str, (Connection, Rate)>> {
        self.links.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what is known of the link through a door. A problem stays as the last error when it is over.
    pub fn link(&self, door: &'static str, change: impl FnOnce(&mut Connection)) {
        let mut doors = self.doors();
        let (link, rate) = doors
            .entry(door)
            .or_insert_with(|| (Connection { door: door.into(), ..Connection::default() }, Rate::new(Instant::now())));
        change(link);
        if link.problem.is_some() {
            link.last_error = link.problem.clone();
        }
        rate.count(link.sent, Instant::now());
    }

    /// The links to other programs that were asked for when the program was started.
    pub fn links(&self) -> Vec<Connection> {
        let mut doors = self.doors();
        let now = |(link, rate): &mut (Connection, Rate)| Connection {
            rate_hz: rate.count(link.sent, Instant::now()),
            ..link.clone()
        };
        doors.values_mut().map(now).collect()
    }

    /// Number of viewers.
    pub fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_that_is_over_stays_as_the_last_error() {
        let hub = Hub::default();
        hub.link("mqtt", |link| link.problem = Some("it is gone".into()));
        hub.link("mqtt", |link| (link.problem, link.sent) = (None, 3));
        hub.link("modbus", |link| link.peers.push("10.0.0.2:4".into()));
        let [modbus, mqtt] = &hub.links()[..] else { panic!("two links") };
        assert_eq!((mqtt.problem.as_deref(), mqtt.last_error.as_deref(), mqtt.sent), (None, Some("it is gone"), 3));
        assert_eq!((modbus.door.as_str(), modbus.peers.len(), &modbus.last_error), ("modbus", 1, &None));
    }
}
