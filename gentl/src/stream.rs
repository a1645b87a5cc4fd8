//! In: a device's frames and the buffers that a program announced. Out: filled buffers, in order; none is lost, because
//! the next frame waits for a free buffer.

use crate::buffer::{Buffer, Content, place};
use crate::camera::{Camera, State};
use crate::event::{Event, Message};
use crate::source::Taken;
use crate::standard::error;
use crate::status::{Refusal, Result, caught, refuse};
use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// A folder is looked at for new scans this often.
const LOOK: Duration = Duration::from_millis(200);

/// The one data stream of an open device, guarded with the device's state.
#[derive(Default)]
pub struct Stream {
    pub buffers: BTreeMap<usize, Arc<Buffer>>,
    pub input: VecDeque<Arc<Buffer>>,
    /// Filled buffers while no event is registered.
    pub output: VecDeque<Arc<Buffer>>,
    pub event: Option<Arc<Event>>,
    pub errors: Option<Arc<Event>>,
    /// Frames that are still to be acquired; `None` while the stream stands.
    pub to_acquire: Option<u64>,
    pub delivered: u64,
    pub started: u64,
    pub filling: bool,
}

/// An open data stream with its thread.
pub struct Acquirer {
    pub camera: Arc<Camera>,
    thread: Mutex<Option<JoinHandle<()>>>,
    end: Arc<AtomicBool>,
}

impl Acquirer {
    pub fn start(camera: Arc<Camera>) -> Result<Acquirer> {
        let end = Arc::new(AtomicBool::new(false));
        camera.state().stream = Some(Stream::default());
        let (of_thread, ended) = (camera.clone(), end.clone());
        let thread = std::thread::Builder::new().name("sheetlight-gentl".into());
        let thread = thread.spawn(move || acquire(&of_thread, &ended)).map_err(|e| Refusal {
            code: error::RESOURCE_EXHAUSTED,
            text: format!("no further thread can be started: {e}"),
        })?;
        Ok(Acquirer { camera, thread: Mutex::new(Some(thread)), end })
    }

    /// Ends the thread; a scan that it makes is given up. The buffers are the program's again.
    pub fn close(&self) {
        self.end.store(true, Ordering::Relaxed);
        self.stop();
        let thread = self.thread.lock().unwrap_or_else(|e| e.into_inner()).take();
        if let Some(thread) = thread {
            // The thread catches its own panics.
            let _ = thread.join();
        }
        self.camera.state().stream = None;
    }

    /// Runs `what` on the stream.
    pub fn with<T>(&self, what: impl FnOnce(&mut Stream) -> Result<T>) -> Result<T> {
        let mut state = self.camera.state();
        let done = match &mut state.stream {
            Some(stream) => what(stream),
            None => refuse(error::INVALID_HANDLE, "the data stream was closed"),
        };
        self.camera.changed.notify_all();
        done
    }

    /// Stops the acquisition and waits for the buffer that is being filled.
    pub fn stop(&self) {
        let mut state = self.camera.state();
        if let Some(stream) = &mut state.stream {
            stream.to_acquire = None;
        }
        self.camera.stop.store(true, Ordering::Relaxed);
        self.camera.changed.notify_all();
        while state.stream.as_ref().is_some_and(|s| s.filling) {
            state = self.camera.changed.wait(state).unwrap_or_else(|e| e.into_inner());
        }
    }
}

impl Stream {
    /// Puts a filled buffer where the program finds it.
    pub fn give(&mut self, buffer: Arc<Buffer>) {
        buffer.put(place::OUTPUT);
        self.delivered += 1;
        match &self.event {
            Some(event) => event.push(Message::Buffer(buffer)),
            None => self.output.push_back(buffer),
        }
    }

    /// Takes all filled buffers from the queue.
    pub fn take_output(&mut self) -> Vec<Arc<Buffer>> {
        let mut all: Vec<Arc<Buffer>> = self.output.drain(..).collect();
        for message in self.event.iter().flat_map(|e| e.drain()) {
            if let Message::Buffer(buffer) = message {
                all.push(buffer);
            }
        }
        all.iter().for_each(|b| b.put(place::IDLE));
        all
    }

    /// Takes all buffers that wait to be filled.
    pub fn take_input(&mut self) -> Vec<Arc<Buffer>> {
        let all: Vec<Arc<Buffer>> = self.input.drain(..).collect();
        all.iter().for_each(|b| b.put(place::IDLE));
        all
    }

    pub fn queue(&mut self, buffer: Arc<Buffer>) {
        buffer.put(place::INPUT);
        self.input.push_back(buffer);
    }

    /// Filled buffers that the program has not taken yet.
    pub fn awaiting(&self) -> usize {
        self.output.len() + self.event.as_ref().map_or(0, |e| e.waiting())
    }

    /// Hands filled buffers to an event that was just registered.
    pub fn register(&mut self, event: Arc<Event>) {
        for b in self.output.drain(..) {
            event.push(Message::Buffer(b));
        }
        self.event = Some(event);
    }

    /// Gives unread buffers back to the queue when the event goes.
    pub fn unregister(&mut self) {
        let unread = self.take_output();
        unread.iter().for_each(|b| b.put(place::OUTPUT));
        self.output.extend(unread);
        self.event = None;
    }
}

/// When the next frame is due.
enum Due {
    Now,
    In(Duration),
    WhenSomethingChanges,
}

fn due(state: &State, last: Option<Instant>) -> Due {
    let Some(stream) = &state.stream else { return Due::WhenSomethingChanges };
    let ready = state.running && stream.to_acquire.is_some_and(|n| n > 0) && !stream.input.is_empty();
    if !ready || (state.settings.triggered && state.triggers == 0 && !state.external) {
        return Due::WhenSomethingChanges;
    }
    let pause = if state.external { LOOK } else { Duration::from_secs_f64(1.0 / state.settings.rate_hz) };
    let paced = state.external || !state.settings.triggered;
    let passed = last.map_or(pause, |l| l.elapsed());
    if !paced || passed >= pause { Due::Now } else { Due::In(pause - passed) }
}

fn acquire(camera: &Camera, end: &AtomicBool) {
    let mut last: Option<Instant> = None;
    loop {
        let mut state = camera.state();
        let begun = loop {
            if end.load(Ordering::Relaxed) {
                return;
            }
            let wait = match due(&state, last) {
                Due::Now => break state.epoch,
                Due::In(wait) => wait,
                Due::WhenSomethingChanges => Duration::MAX,
            };
            state = camera.changed.wait_timeout(state, wait).unwrap_or_else(|e| e.into_inner()).0;
        };
        // At an even pace; after a late frame the pace begins anew.
        let pace = Duration::from_secs_f64(1.0 / state.settings.rate_hz);
        last = Some(last.map_or_else(Instant::now, |l| if l.elapsed() < 2 * pace { l + pace } else { Instant::now() }));
        let stream = state.stream.as_mut().expect("a frame is due");
        let buffer = stream.input.pop_front().expect("a frame is due");
        buffer.put(place::FILLING);
        (stream.filling, stream.started) = (true, stream.started + 1);
        camera.stop.store(false, Ordering::Relaxed);
        drop(state);
        let taken = caught(|| camera.next());
        let mut state = camera.state();
        let current = state.running && state.epoch == begun;
        match taken {
            Ok(Some(taken)) if current => {
                if let Err(fault) = caught(|| {
                    deliver(camera, &mut state, &taken, buffer);
                    Ok(())
                }) {
                    failed(camera, &mut state, fault);
                }
            }
            taken => {
                let stream = state.stream.as_mut().expect("closed only after the thread");
                buffer.put(place::INPUT);
                stream.input.push_front(buffer);
                stream.started -= 1;
                match taken {
                    Err(fault) if current => failed(camera, &mut state, fault),
                    Ok(None) => last = Some(Instant::now()),
                    _ => {}
                }
            }
        }
        if let Some(stream) = &mut state.stream {
            stream.filling = false;
        }
        camera.changed.notify_all();
    }
}

/// A frame that could not be made: the program reads why, and the acquisition stops unless the next may be better.
fn failed(camera: &Camera, state: &mut State, fault: Refusal) {
    state.triggers = state.triggers.saturating_sub(1);
    state.running = state.external || state.settings.triggered;
    let message = Message::Error { code: fault.code, text: fault.text.clone() };
    let of_stream = state.stream.as_ref().and_then(|s| s.errors.as_ref());
    of_stream.iter().for_each(|e| e.push(message.clone()));
    camera.errors().iter().for_each(|e| e.push(message.clone()));
    state.fault = fault.text;
}

fn deliver(camera: &Camera, state: &mut State, taken: &Taken, buffer: Arc<Buffer>) {
    state.frame_id += 1;
    state.triggers = state.triggers.saturating_sub(1);
    state.seen(taken);
    let parts = state.settings.parts();
    let payload = state.settings.payload();
    let fits = payload <= buffer.size;
    if fits {
        // SAFETY: the program announced `size` bytes at `address` and may not touch or free them before it gets the
        // buffer back; while it is `FILLING`, this thread alone uses them, and it cannot be revoked.
        let bytes = unsafe { std::slice::from_raw_parts_mut(buffer.address.load(Ordering::Relaxed), payload) };
        state.settings.fill(taken, &camera.layout, bytes);
    }
    *buffer.content.lock().unwrap_or_else(|e| e.into_inner()) = Content {
        frame_id: state.frame_id,
        timestamp_ns: camera.now_ns(),
        region: Some(state.settings.region),
        parts,
        filled: if fits { payload } else { 0 },
        too_large: !fits,
        new: true,
    };
    if let Some(left) = &mut state.left {
        *left -= 1;
        state.running = *left > 0;
    }
    let stream = state.stream.as_mut().expect("closed only after the thread");
    stream.to_acquire = stream.to_acquire.map(|n| if n == u64::MAX { n } else { n - 1 });
    stream.give(buffer);
}
