//! In: shots that a recorder has written. Out: the same shots in order, for a reader that works on them meanwhile.
//! The next few come from memory, later ones from the recorder's disk.
//! Frame and unit: as [`crate::recording`].

use crate::raster::Image;
use crate::recording::{Slip, Stand};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A recorded shot that waits in memory.
pub struct Recorded {
    /// Name of its picture in the recording.
    pub name: String,
    /// Index in the recording, from 0.
    pub index: usize,
    /// The picture.
    pub image: Image,
    /// Position of what moves.
    pub stand: Option<Stand>,
    /// How far that may be off.
    pub slip: Option<Slip>,
    /// Arrival of the last byte, ns of the host's clock.
    pub here_ns: u64,
}

/// State of a requested shot.
pub enum Waits {
    /// In memory.
    InMemory(Box<Recorded>),
    /// In the recording: memory was full when it was recorded.
    OnDisk,
    /// Not recorded yet.
    Nowhere,
    /// It never will be recorded: the recording has ended.
    Never,
}

/// Number of shots that wait in memory; all others wait on disk and use no memory.
const HANDED: usize = 16;

#[derive(Default)]
struct State {
    handed: VecDeque<Box<Recorded>>,
    recorded: usize,
    ended: bool,
}

/// Shots that were recorded and not yet processed.
#[derive(Clone, Default)]
pub struct Backlog(Arc<(Mutex<State>, Condvar)>);

/// The recorder's end of the backlog; dropping it means that the recording has ended.
pub struct Handing(Backlog);

impl Backlog {
    /// The recorder's end and the reader's end.
    pub fn new() -> (Handing, Backlog) {
        let backlog = Backlog::default();
        (Handing(backlog.clone()), backlog)
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// State of shot `index`, waiting for at most `within`. Indices must ascend.
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
    /// Reports a shot that was recorded and that others can read.
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
        // There is room again. The shots recorded while memory was full precede it on disk.
        handing.hand(shot(20));
        let want = [14, 15, 1016, 1017, 1018, 1019, 20, 2000];
        assert_eq!((14..22).map(place).collect::<Vec<_>>(), want);
        drop(handing);
        assert_eq!(place(21), 3000);
    }
}
