//! Places of connections. Who shows a session gets a place that nobody takes from him; everybody else shares others, of
//! which the machine that has most gives up its oldest.

use futures_util::task::AtomicWaker;
use std::collections::{BTreeMap, HashMap};
use std::net::IpAddr;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Context;

/// Connections that have shown no session: those that browsers open in advance, a page before its first request, and
/// whoever only knocks.
const STRANGERS: usize = 128;
/// Of these one machine has at most so many.
const STRANGERS_OF_ONE: usize = 64;
/// Connections of sessions: 64 viewers, each with its socket and the six that a browser has beside it.
const GUESTS: usize = 448;
/// Of these one machine has at most so many: a program that opens ever more leaves places for others.
const GUESTS_OF_ONE: usize = 384;

/// What counts as one machine: an address, of IPv6 on the internet a network of 64 bits, because there one machine may
/// choose among all of its addresses.
pub fn machine(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) if !v6.is_unicast_link_local() && !v6.is_unique_local() => {
            IpAddr::V6((v6.to_bits() & !u128::from(u64::MAX)).into())
        }
        one => one,
    }
}

/// All places.
#[derive(Debug, Default)]
pub struct Places(Mutex<Taken>);

#[derive(Debug, Default)]
struct Taken {
    next: u64,
    /// By number: the oldest first.
    strangers: BTreeMap<u64, Arc<Place>>,
    guests: HashMap<IpAddr, usize>,
}

const STRANGER: u8 = 0;
const GUEST: u8 = 1;
/// It made room for another one.
const GONE: u8 = 2;

/// The place of one connection.
#[derive(Debug)]
pub struct Place {
    number: u64,
    machine: IpAddr,
    is: AtomicU8,
    task: AtomicWaker,
}

impl Place {
    /// A session was shown on this connection.
    pub fn is_guest(&self) -> bool {
        self.is.load(Ordering::SeqCst) == GUEST
    }

    /// Whether it has to go; else the task is woken when it has.
    pub fn is_gone(&self, cx: &Context) -> bool {
        self.task.register(cx.waker());
        self.is.load(Ordering::SeqCst) == GONE
    }
}

impl Taken {
    /// The stranger that makes room for one more of this machine.
    fn too_many(&self, machine: IpAddr) -> Option<u64> {
        // Of each machine how many, and the oldest.
        let mut of = HashMap::<IpAddr, (usize, u64)>::new();
        self.strangers.values().for_each(|p| of.entry(p.machine).or_insert((0, p.number)).0 += 1);
        let own = of.get(&machine).filter(|(many, _)| *many >= STRANGERS_OF_ONE);
        let most = || of.values().filter(|_| self.strangers.len() >= STRANGERS).max_by_key(|(many, _)| *many);
        own.or_else(most).map(|(_, oldest)| *oldest)
    }
}

impl Places {
    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A place for a connection that was just made, which is given back with the seat.
    pub fn take(self: &Arc<Places>, from: IpAddr) -> Seat {
        let machine = machine(from);
        let mut taken = self.taken();
        if let Some(goes) = taken.too_many(machine).and_then(|number| taken.strangers.remove(&number)) {
            goes.is.store(GONE, Ordering::SeqCst);
            goes.task.wake();
        }
        let number = taken.next;
        taken.next += 1;
        let place = Arc::new(Place { number, machine, is: AtomicU8::new(STRANGER), task: AtomicWaker::new() });
        taken.strangers.insert(number, place.clone());
        Seat { places: self.clone(), place }
    }

    /// A request on this connection showed a session: from now on nobody takes its place. Where all those places are
    /// taken it stays a stranger, and is served all the same.
    pub fn shows_session(&self, place: &Place) {
        if place.is.load(Ordering::SeqCst) != STRANGER {
            return;
        }
        let mut taken = self.taken();
        let (all, own) = (taken.guests.values().sum::<usize>(), taken.guests.get(&place.machine).copied().unwrap_or(0));
        if all < GUESTS && own < GUESTS_OF_ONE && taken.strangers.remove(&place.number).is_some() {
            taken.guests.insert(place.machine, own + 1);
            place.is.store(GUEST, Ordering::SeqCst);
        }
    }
}

/// A place that is taken; dropped with its connection.
#[derive(Debug)]
pub struct Seat {
    pub places: Arc<Places>,
    pub place: Arc<Place>,
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut taken = self.places.taken();
        if !self.place.is_guest() {
            taken.strangers.remove(&self.place.number);
        } else if let Some(many) = taken.guests.get_mut(&self.place.machine) {
            *many -= 1;
            if *many == 0 {
                taken.guests.remove(&self.place.machine);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ip(text: &str) -> IpAddr {
        text.parse().unwrap()
    }
    fn gone(seat: &Seat) -> bool {
        seat.place.is.load(Ordering::SeqCst) == GONE
    }

    #[test]
    fn a_machine_that_opens_ever_more_loses_its_own_connections_alone() {
        let places = Arc::new(Places::default());
        let guest = places.take(ip("10.0.0.9"));
        places.shows_session(&guest.place);
        let quiet = places.take(ip("10.0.0.2"));
        let flood: Vec<Seat> = (0..1000).map(|_| places.take(ip("10.0.0.9"))).collect();
        assert!(!gone(&guest) && !gone(&quiet) && flood.iter().filter(|s| !gone(s)).count() == STRANGERS_OF_ONE);
        // The newest of them are those that stay.
        assert!(flood[1000 - STRANGERS_OF_ONE..].iter().all(|s| !gone(s)));
        // Many machines at once: those that have most give way, whoever has one keeps it.
        let floods: Vec<Seat> = (0..300).map(|k| places.take(ip(&format!("10.0.1.{}", k % 3)))).collect();
        assert!(!gone(&guest) && !gone(&quiet));
        let open = flood.iter().chain(&floods).filter(|s| !gone(s)).count();
        assert!(open < STRANGERS, "{open}");
        drop((flood, floods, quiet, guest));
        assert!(places.taken().strangers.is_empty() && places.taken().guests.is_empty());
    }

    #[test]
    fn places_of_sessions_are_bounded_and_left_for_other_machines() {
        let places = Arc::new(Places::default());
        let sits = |from: &str| {
            let seat = places.take(ip(from));
            places.shows_session(&seat.place);
            seat
        };
        let many: Vec<Seat> = (0..GUESTS_OF_ONE + 10).map(|_| sits("10.0.0.2")).collect();
        assert_eq!(many.iter().filter(|s| s.place.is_guest()).count(), GUESTS_OF_ONE);
        let others: Vec<Seat> = (0..100).map(|k| sits(&format!("10.0.1.{k}"))).collect();
        assert_eq!(others.iter().filter(|s| s.place.is_guest()).count(), GUESTS - GUESTS_OF_ONE);
        assert!(others.iter().all(|s| !gone(s)), "one that stays a stranger is served all the same");
    }

    #[test]
    fn a_network_of_ipv6_on_the_internet_is_one_machine() {
        assert_ne!(machine(ip("fd00::1")), machine(ip("fd00::2")));
        assert_ne!(machine(ip("fe80::1")), machine(ip("fe80::2")));
        assert_eq!(machine(ip("2001:db8::1")), machine(ip("2001:db8::ffff:2")));
        assert_ne!(machine(ip("2001:db8::1")), machine(ip("2001:db8:0:1::1")));
        assert_eq!(machine(ip("::ffff:10.0.0.2")), ip("10.0.0.2"));
    }
}
