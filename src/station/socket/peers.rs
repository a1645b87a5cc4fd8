//! In: connections of a Modbus server, what they ask and what they are refused. Out: who is admitted and when a
//! connection is answered; figures for people. A program that asks without pause costs no more than a PLC.
//! Frame and unit: s.

use std::net::{IpAddr, SocketAddr};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Most connections at a time, and of one machine. A PLC needs one, a panel another.
const MOST: usize = 16;
const MOST_OF_ONE: usize = 8;
/// Frames of a connection that are answered at once, and how many a second after those. A PLC asks every 10 ms.
const AT_ONCE: f64 = 100.0;
const A_SECOND: f64 = 200.0;
/// Most characters of the last error, as the page Settings shows it.
const MOST_WORDS: usize = 160;

/// What came over the wire since the start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Traffic {
    /// Addresses of the connections that are open.
    pub peers: Vec<String>,
    /// Frames that were answered.
    pub answered: u64,
    /// Frames, requests and connections that were refused.
    pub refused: u64,
    /// The last of these refusals, and whose it was.
    pub last_error: Option<String>,
}

/// All connections.
#[derive(Default)]
pub struct Peers(Mutex<Known>);

#[derive(Default)]
struct Known {
    open: Vec<SocketAddr>,
    traffic: Traffic,
}

impl Peers {
    fn known(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place for a connection, until the place is dropped; `None` if too many are open.
    pub fn admit(&self, from: SocketAddr) -> Option<Place<'_>> {
        let mut known = self.known();
        let of_one = known.open.iter().filter(|a| a.ip() == from.ip()).count();
        if known.open.len() < MOST && of_one < MOST_OF_ONE {
            known.open.push(from);
            return Some(Place { peers: self, from });
        }
        drop(known);
        self.refused(from.ip(), &format!("{MOST} connections are open, or {MOST_OF_ONE} of this machine"));
        None
    }

    /// A frame was answered.
    pub fn answered(&self) {
        self.known().traffic.answered += 1;
    }

    /// Something was refused.
    pub fn refused(&self, from: IpAddr, why: &str) {
        let plain = |c: char| if c.is_ascii_graphic() || c == ' ' { c } else { '?' };
        let mut known = self.known();
        known.traffic.refused += 1;
        known.traffic.last_error = Some(format!("{from}: {why}").chars().map(plain).take(MOST_WORDS).collect());
    }

    /// The present figures.
    pub fn traffic(&self) -> Traffic {
        let known = self.known();
        Traffic { peers: known.open.iter().map(SocketAddr::to_string).collect(), ..known.traffic.clone() }
    }
}

/// The place of a connection.
pub struct Place<'a> {
    peers: &'a Peers,
    from: SocketAddr,
}

impl Drop for Place<'_> {
    fn drop(&mut self) {
        let mut known = self.peers.known();
        if let Some(k) = known.open.iter().position(|a| *a == self.from) {
            known.open.swap_remove(k);
        }
    }
}

/// The pace of one connection.
pub struct Pace {
    left: f64,
    at: Instant,
}

impl Pace {
    /// A connection that has asked nothing yet.
    pub fn new(now: Instant) -> Pace {
        Pace { left: AT_ONCE, at: now }
    }

    /// Counts a frame; how long its answer has to wait.
    pub fn frame(&mut self, now: Instant) -> Duration {
        let passed = now.saturating_duration_since(self.at).as_secs_f64();
        (self.left, self.at) = ((self.left + passed * A_SECOND).min(AT_ONCE) - 1.0, now);
        Duration::from_secs_f64((-self.left).max(0.0) / A_SECOND)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_machine_leaves_places_for_others() {
        let peers = Peers::default();
        let of = |machine: u8, port: u16| SocketAddr::from(([10, 0, 0, machine], port));
        let mut first: Vec<_> = (0..10).filter_map(|k| peers.admit(of(1, k))).collect();
        assert_eq!(first.len(), MOST_OF_ONE);
        let second: Vec<_> = (0..10).filter_map(|k| peers.admit(of(2, k))).collect();
        assert!(second.len() == MOST_OF_ONE && peers.admit(of(3, 1)).is_none());
        first.truncate(3);
        assert!(peers.admit(of(3, 1)).is_some());
        let told = peers.traffic();
        assert_eq!((told.peers.len(), told.refused), (11, 5));
        assert!(told.last_error.unwrap().starts_with("10.0.0.3: 16 connections"));
    }

    #[test]
    fn who_asks_without_pause_waits_and_a_plc_does_not() {
        let begun = Instant::now();
        let mut plc = Pace::new(begun);
        for k in 0..10_000 {
            assert_eq!(plc.frame(begun + Duration::from_millis(10 * k)), Duration::ZERO);
        }
        let mut flood = Pace::new(begun);
        let mut now = begun;
        for _ in 0..1100 {
            now += flood.frame(now);
        }
        // A thousand frames after the first hundred.
        assert!((now - begun).as_secs_f64() > 4.9, "{:?}", now - begun);
    }
}
