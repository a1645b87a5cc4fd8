//! In: what a module reports. Out: the queue of a registered event, on which a program waits.

use crate::buffer::Buffer;
use crate::standard::error;
use crate::status::{Result, refuse};
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// Most errors that wait for a program; older ones are dropped.
const MOST_ERRORS: usize = 64;

#[derive(Clone)]
pub enum Message {
    Buffer(Arc<Buffer>),
    Error { code: i32, text: String },
}

/// A registered event.
pub struct Event {
    pub kind: i32,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    queue: VecDeque<Message>,
    fired: u64,
    /// Waits that are still to be ended. One that was asked for while nobody waited ends the next wait.
    kills: u64,
    closed: bool,
}

impl Event {
    pub fn new(kind: i32) -> Event {
        Event { kind, state: Mutex::default(), changed: Condvar::new() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    pub fn push(&self, message: Message) {
        let mut state = self.state();
        if matches!(message, Message::Error { .. }) && state.queue.len() >= MOST_ERRORS {
            state.queue.pop_front();
        }
        state.queue.push_back(message);
        state.fired += 1;
        self.changed.notify_all();
    }

    /// Waits for a message and takes it if it fits into `room` bytes.
    pub fn wait(&self, timeout_ms: u64, room: usize) -> Result<Message> {
        // The longest that a clock can add; the standard's "infinite" is more than that.
        let until = Instant::now().checked_add(Duration::from_millis(timeout_ms.min(1 << 50)));
        let mut state = self.state();
        loop {
            if state.closed {
                return refuse(error::ABORT, "the event was unregistered");
            }
            if state.kills > 0 {
                state.kills -= 1;
                return refuse(error::ABORT, "the wait was ended by EventKill");
            }
            if let Some(next) = state.queue.front() {
                let needed = next.bytes().len();
                if needed > room {
                    return refuse(error::BUFFER_TOO_SMALL, format!("{needed} bytes are needed, {room} given"));
                }
                return Ok(state.queue.pop_front().expect("just seen"));
            }
            let left = until.map_or(Duration::MAX, |u| u.saturating_duration_since(Instant::now()));
            if left.is_zero() {
                return refuse(error::TIMEOUT, format!("nothing was reported within {timeout_ms} ms"));
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(|e| e.into_inner()).0;
        }
    }

    /// Ends one wait.
    pub fn kill(&self) {
        self.state().kills += 1;
        self.changed.notify_all();
    }

    /// Ends all waits for good.
    pub fn close(&self) {
        self.state().closed = true;
        self.changed.notify_all();
    }

    /// Takes all messages.
    pub fn drain(&self) -> Vec<Message> {
        self.state().queue.drain(..).collect()
    }

    pub fn waiting(&self) -> usize {
        self.state().queue.len()
    }

    pub fn fired(&self) -> u64 {
        self.state().fired
    }
}

impl Message {
    /// As the program gets it: the standard's structure of a new buffer, or number and text of an error.
    pub fn bytes(&self) -> Vec<u8> {
        match self {
            Message::Buffer(b) => [b.handle.to_ne_bytes(), b.user.to_ne_bytes()].concat(),
            Message::Error { code, text } => [&code.to_ne_bytes()[..], text.as_bytes(), &[0]].concat(),
        }
    }
}
