//! In: shots as a recorder has written them. Out: the same in order for who works on them meanwhile: the next few
//! from memory, what has to wait longer from the recorder's disk.
//! Frame and unit: as [`crate::recording`].

use crate::raster::Image;
use crate::recording::{Slip, Stand};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A shot that has been recorded, and waits in memory.
pub struct Recorded {
    /// Name of its picture in the recording.
    pub name: String,
    /// Place in it, from 0.
    pub index: usize,
    /// The picture.
    pub image: Image,
    /// Where what moves stood.
    pub stand: Option<Stand>,
    /// How far that may be off.
    pub slip: Option<Slip>,
    /// When its last byte was here, ns of the host's clock.
    pub here_ns: u64,
}

/// Where a shot is that is asked for.
pub enum Waits {
    /// Here.
    InMemory(Box<Recorded>),
    /// In the recording: it waited too long.
    OnDisk,
    /// Not recorded yet.
    Nowhere,
    /// It never will be: the recording has ended.
    Never,
}

/// Shots that wait in memory; all others do on the disk, where they take none.
const HANDED: usize = 16;

#[derive(Default)]
struct State {
    handed: VecDeque<Box<Recorded>>,
    recorded: usize,
    ended: bool,
}

/// Shots that were recorded and not yet worked on.
#[derive(Clone, Default)]
pub struct Backlog(Arc<(Mutex<State>, Condvar)>);

/// The recorder's end of it: when it is dropped the recording has ended.
pub struct Handing(Backlog);

impl Backlog {
    /// A recorder's end and its reader's.
    pub fn new() -> (Handing, Backlog) {
        let backlog = Backlog::default();
        (Handing(backlog.clone()), backlog)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where shot `index` is, waited for at most this long. Asked for in order.
    pub fn shot(&self, index: usize, within: Duration) -> Waits {
        let state = self.lock();
        let early = |s: &mut State| s.recorded <= index && !s.ended;
        let waited = self.0.1.wait_timeout_while(state, within, early);
        let mut state = waited.unwrap_or_else(PoisonError::into_inner).0;
        while state.handed.front().is_some_and(|shot| shot.index < index) {
            state.handed.pop_front();
        }
        match state.handed.pop_front_if(|shot| shot.index == index) {
            Some(shot) => Waits::InMemory(shot),
            None if index < state.recorded => Waits::OnDisk,
            None if state.ended => Waits::Never,
            None => Waits::Nowhere,
        }
    }
}

impl Handing {
    /// A shot was recorded, and can be read by others.
    pub fn hand(&self, shot: Recorded) {
        let mut state = self.0.lock();
        state.recorded = shot.index + 1;
        if state.handed.len() < HANDED {
            state.handed.push_back(Box::new(shot));
        }
        self.0.0.1.notify_all();
    }
}

impl Drop for Handing {
    fn drop(&mut self) {
        self.0.lock().ended = true;
        self.0.0.1.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_too_long_is_on_the_disk_and_none_is_given_twice() {
        let (handing, backlog) = Backlog::new();
        let shot = |index: usize| Recorded {
            name: format!("{index}"),
            index,
            image: Image::from_u8(1, 1, vec![0]),
            stand: None,
            slip: None,
            here_ns: 0,
        };
        assert!(matches!(backlog.shot(0, Duration::ZERO), Waits::Nowhere));
        (0..20).for_each(|k| handing.hand(shot(k)));
        let place = |index| match backlog.shot(index, Duration::ZERO) {
            Waits::InMemory(shot) => shot.index,
            Waits::OnDisk => 1000 + index,
            Waits::Nowhere => 2000,
            Waits::Never => 3000,
        };
        assert_eq!((0..14).map(place).collect::<Vec<_>>(), (0..14).collect::<Vec<_>>());
        // There is room again; what came while there was none lies before it on the disk.
        handing.hand(shot(20));
        let want = [14, 15, 1016, 1017, 1018, 1019, 20, 2000];
        assert_eq!((14..22).map(place).collect::<Vec<_>>(), want);
        drop(handing);
        assert_eq!(place(21), 3000);
    }
}
