//! In: memory that a program announced. Out: where the buffer is, and what it holds.

use crate::settings::{Part, Region};
use std::sync::Mutex;
use std::sync::atomic::{AtomicPtr, AtomicU8, Ordering};

/// Where a buffer is.
pub mod place {
    /// With the program, or announced only.
    pub const IDLE: u8 = 0;
    pub const INPUT: u8 = 1;
    pub const FILLING: u8 = 2;
    pub const OUTPUT: u8 = 3;
}

/// An announced buffer.
pub struct Buffer {
    pub handle: usize,
    pub address: AtomicPtr<u8>,
    pub size: usize,
    pub user: usize,
    /// The memory, if this library allocated it.
    pub own: Option<Box<[u8]>>,
    pub place: AtomicU8,
    pub content: Mutex<Content>,
}

/// What a buffer holds.
#[derive(Clone, Default)]
pub struct Content {
    pub frame_id: u64,
    pub timestamp_ns: u64,
    pub region: Option<Region>,
    pub parts: Vec<Part>,
    pub filled: usize,
    /// The frame did not fit.
    pub too_large: bool,
    pub new: bool,
}

impl Buffer {
    pub fn content(&self) -> Content {
        self.content.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    pub fn is_at(&self, place: u8) -> bool {
        self.place.load(Ordering::Relaxed) == place
    }

    pub fn put(&self, place: u8) {
        self.place.store(place, Ordering::Relaxed);
    }
}
