//! Slots for connections. A connection that shows a session gets a slot that it keeps. All other connections share
//! the remaining slots; if these are full, the machine with most connections loses its oldest one.

use futures_util::task::AtomicWaker;
use std::collections::{BTreeMap, HashMap};
use std::net::IpAddr;
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Context;

/// Most connections without a session: those that browsers open in advance, a page before its first request, and
/// clients that never open a session.
const STRANGERS: usize = 128;
/// Most of them from one machine.
const STRANGERS_OF_ONE: usize = 64;
/// Most connections with a session: 64 viewers, each with its WebSocket and six further connections of its browser.
const GUESTS: usize = 448;
/// Most of them from one machine: a program that opens many connections leaves slots for other machines.
const GUESTS_OF_ONE: usize = 384;

/// What counts as one machine: an address. For public IPv6 addresses the network of 64 bits counts, because one
/// machine may use all of its addresses.
pub fn machine(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(v6) if !v6.is_unicast_link_local() && !v6.is_unique_local() => {
            IpAddr::V6((v6.to_bits() & !u128::from(u64::MAX)).into())
        }
        one => one,
    }
}

/// All slots.
#[derive(Debug, Default)]
pub struct Places(Mutex<Taken>);

#[derive(Debug, Default)]
struct Taken {
    next: u64,
    /// By number, so oldest first.
    strangers: BTreeMap<u64, Arc<Place>>,
    guests: HashMap<IpAddr, usize>,
}

const STRANGER: u8 = 0;
const GUEST: u8 = 1;
/// Its slot was given to another connection.
const GONE: u8 = 2;

/// The slot of one connection.
#[derive(Debug)]
pub struct Place {
    number: u64,
    machine: IpAddr,
    is: AtomicU8,
    task: AtomicWaker,
}

impl Place {
    /// True if a session was shown on this connection.
    pub fn is_guest(&self) -> bool {
        self.is.load(Ordering::SeqCst) == GUEST
    }

    /// Whether the connection must close; if not, the task is woken when it must.
    pub fn is_gone(&self, cx: &Context) -> bool {
        self.task.register(cx.waker());
        self.is.load(Ordering::SeqCst) == GONE
    }
}

impl Taken {
    /// The connection without a session that must close before one more of this machine is accepted.
    fn too_many(&self, machine: IpAddr) -> Option<u64> {
        // Count and oldest connection of each machine.
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

    /// A slot for a new connection; it is freed when the seat is dropped.
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

    /// A request on this connection showed a session: from now on the connection keeps its slot. If all such slots
    /// are taken, it stays among those without a session, and is served too.
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

/// A taken slot; dropped with its connection.
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
        // The newest connections are those that stay.
        assert!(flood[1000 - STRANGERS_OF_ONE..].iter().all(|s| !gone(s)));
        // Many machines at once: those with most connections lose some, a machine with one keeps it.
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
