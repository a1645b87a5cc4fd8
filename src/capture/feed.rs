//! In: a source, a mode. Out: its pictures through a bounded queue, filled by a separate thread; an account of all
//! of them. A camera that was lost is opened again.
//! Frame and unit: pictures, bytes; times in ns.

use super::account::{Account, Ledger, Order};
use super::clock::{ClockMap, now_ns};
use super::format::{Format, Pictures};
use super::picture::{Event, Numbering, Picture, PictureSource};
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::recording::stated_once;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Which pictures are delivered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Every one, in order: for recording and scanning.
    All,
    /// The newest: for live view. A picture that was not taken before the next arrived is dropped.
    Newest,
}

/// Options of a feed.
#[derive(Clone, Debug)]
pub struct FeedOptions {
    /// Which pictures are delivered.
    pub mode: Mode,
    /// Memory for waiting pictures, bytes.
    pub memory: usize,
    /// How long to wait for a lost camera; zero: do not wait.
    pub patience: Duration,
    /// Ends after this number of complete pictures.
    pub shots: Option<u64>,
    /// Ends after this time, s.
    pub seconds: Option<f64>,
    /// Set by the caller to end the feed.
    pub stop: Arc<AtomicBool>,
    /// Readout that the user states, if the source does not know it.
    pub readout: Option<Readout>,
}

impl Default for FeedOptions {
    fn default() -> Self {
        let (mode, patience) = (Mode::All, Duration::from_secs(60));
        FeedOptions {
            mode,
            memory: 256 << 20,
            patience,
            shots: None,
            seconds: None,
            stop: Arc::default(),
            readout: None,
        }
    }
}

/// What became of a picture after it arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Recorded, scanned or shown.
    Used,
    /// The disk was full or too slow.
    Disk,
    /// Processing was too slow.
    Processing,
    /// The position of what moves is unknown.
    Unpaired,
    /// It is not needed.
    Spare,
}

/// Result of waiting for a feed.
#[derive(Debug)]
pub enum Fed {
    /// The next picture, or the newest, and how far its number is comparable.
    Picture(Box<Picture>, Numbering),
    /// The time has passed and nothing arrived.
    Quiet,
    /// Nothing will arrive any more; with the reason, unless the end was requested.
    Ended(Option<Fault>),
}

/// Interval of checks for a request to stop.
const GLANCE: Duration = Duration::from_millis(100);
/// Time that a camera may take to be released.
const GIVE_BACK: Duration = Duration::from_millis(1000);
/// Interval of attempts to open a lost camera again.
const RETRY: Duration = Duration::from_millis(500);
/// Interval of readings of the device's clock, and the number of readings at the beginning.
const CLOCK: Duration = Duration::from_millis(200);
const CLOCK_FIRST: usize = 8;

#[derive(Default)]
struct State {
    pictures: VecDeque<(Box<Picture>, Numbering)>,
    bytes: usize,
    ledger: Ledger,
    clock: ClockMap,
    resent: u64,
    ended: bool,
    fault: Option<Fault>,
    /// Messages for the user: the camera was lost, the camera is back.
    said: Vec<String>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A source that is being read.
pub struct Feed {
    shared: Arc<Shared>,
    pictures: Pictures,
    name: String,
    device: String,
    coordinates: Option<String>,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Feed {
    /// Starts requesting pictures.
    ///
    /// # Errors
    /// No thread can be started; a readout is stated although the source knows it.
    pub fn start(source: Box<dyn PictureSource>, options: FeedOptions) -> Result<Feed> {
        let (name, device, coordinates) = (source.name(), source.device(), source.coordinates()?);
        let readout = stated_once(source.readout(), options.readout)?;
        let pictures = Pictures { format: source.format(), readout };
        let shared = Arc::new(Shared::default());
        let (theirs, stop) = (shared.clone(), Arc::new(AtomicBool::new(false)));
        let reader = Reader {
            source,
            shared: theirs,
            options,
            ours: stop.clone(),
            begun: Instant::now(),
            asked: None,
            jump_said: false,
            came: 0,
            first: None,
            numbering: Numbering::default(),
        };
        let thread = std::thread::Builder::new().name("camera".into()).spawn(move || reader.run());
        let thread = Some(thread.map_err(|e| Fault::threads(&e))?);
        Ok(Feed { shared, pictures, name, device, coordinates, stop, thread })
    }

    /// Size and depth of all its pictures.
    pub fn format(&self) -> Format {
        self.pictures.format
    }

    /// Format of all its pictures, and how they are read from the sensor.
    pub fn pictures(&self) -> Pictures {
        self.pictures
    }

    /// Kind and place of the source, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Identity of the device, however it was named.
    pub fn device(&self) -> &str {
        &self.device
    }

    /// What a 3-D camera states about its coordinates, as JSON; none if it sends light.
    pub fn coordinates(&self) -> Option<&str> {
        self.coordinates.as_deref()
    }

    /// The next picture, waiting for at most `within`.
    pub fn next(&self, within: Duration) -> Fed {
        let until = Instant::now() + within;
        let mut state = self.shared.lock();
        loop {
            if let Some((picture, numbering)) = state.pictures.pop_front() {
                state.bytes -= weight(&picture);
                self.shared.changed.notify_all();
                return Fed::Picture(picture, numbering);
            }
            if state.ended {
                return Fed::Ended(state.fault.take());
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Fed::Quiet;
            }
            let waited = self.shared.changed.wait_timeout(state, left);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Notes what became of a picture that [`Feed::next`] returned.
    pub fn fate(&self, fate: Fate) {
        let mut state = self.shared.lock();
        let a = state.ledger.account();
        *match fate {
            Fate::Used => &mut a.used,
            Fate::Disk => &mut a.dropped_disk,
            Fate::Processing => &mut a.dropped_processing,
            Fate::Unpaired => &mut a.unpaired,
            Fate::Spare => &mut a.spare,
        } += 1;
    }

    /// The account so far; pictures in flight count as complete only.
    pub fn account(&self) -> Account {
        let mut state = self.shared.lock();
        let resent = state.resent;
        Account { resent, ..state.ledger.account().clone() }
    }

    /// Recent rate of pictures, per second.
    pub fn rate_hz(&self) -> Option<f64> {
        self.shared.lock().ledger.rate_hz()
    }

    /// Relation of the device's clock to the host's, as far as it is known.
    pub fn clock(&self) -> ClockMap {
        self.shared.lock().clock.clone()
    }

    /// Number of pictures that wait in memory.
    pub fn waiting(&self) -> usize {
        self.shared.lock().pictures.len()
    }

    /// Messages since the last call: the camera was lost, the camera is back.
    pub fn news(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.lock().said)
    }

    /// Requests no more pictures; waiting ones can still be taken.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.stop();
        // A camera is released. A reader that blocks inside a pipe is left alone and ends with the pipe.
        let until = Instant::now() + GIVE_BACK;
        while self.thread.as_ref().is_some_and(|t| !t.is_finished()) && Instant::now() < until {
            std::thread::sleep(GLANCE / 10);
        }
        if let Some(thread) = self.thread.take().filter(|t| t.is_finished()) {
            let _ = thread.join();
        }
    }
}

fn weight(picture: &Picture) -> usize {
    let places = picture.profiles.iter().flatten().map(Vec::len).sum::<usize>();
    Format::of(&picture.image).bytes() + std::mem::size_of::<Picture>() + places * std::mem::size_of::<[f64; 2]>()
}

/// The thread that requests pictures.
struct Reader {
    source: Box<dyn PictureSource>,
    shared: Arc<Shared>,
    options: FeedOptions,
    ours: Arc<AtomicBool>,
    begun: Instant,
    /// Time of the last reading of the clock.
    asked: Option<Instant>,
    /// Whether the user was informed that the clock jumps.
    jump_said: bool,
    came: u64,
    /// The first number since the source was opened.
    first: Option<u64>,
    numbering: Numbering,
}

impl Reader {
    fn run(mut self) {
        for _ in 0..CLOCK_FIRST {
            self.read_clock();
        }
        let fault = loop {
            if self.over() {
                break None;
            }
            if self.asked.is_some_and(|a| a.elapsed() > CLOCK) {
                self.read_clock();
            }
            match self.source.next(GLANCE) {
                Event::Picture(picture) => self.take(picture),
                Event::Incomplete { id, .. } => {
                    self.first.get_or_insert(id);
                    self.shared.lock().ledger.came_in_part(id);
                }
                Event::Spare { id, host_ns } => {
                    self.first.get_or_insert(id);
                    let mut state = self.shared.lock();
                    if state.ledger.came(id, host_ns) == Order::Next {
                        state.ledger.account().spare += 1;
                    }
                }
                Event::Quiet => {}
                Event::Lost(fault) => {
                    if let Err(fault) = self.bring_back(fault) {
                        break fault;
                    }
                }
                Event::Ended => {
                    if let Some(sent) = self.source.sent() {
                        self.shared.lock().ledger.says(sent);
                    }
                    break None;
                }
            }
        };
        let Reader { source, shared, .. } = self;
        let resent = source.resent();
        // Whoever learns of the end can open the camera, because it was released before.
        drop(source);
        let mut state = shared.lock();
        state.ledger.ended(now_ns());
        (state.resent, state.ended, state.fault) = (resent, true, fault);
        shared.changed.notify_all();
    }

    fn stopped(&self) -> bool {
        self.ours.load(Ordering::Relaxed) || self.options.stop.load(Ordering::Relaxed)
    }

    fn over(&self) -> bool {
        let o = &self.options;
        self.stopped()
            || o.shots.is_some_and(|n| self.came >= n)
            || o.seconds.is_some_and(|s| self.begun.elapsed().as_secs_f64() >= s)
    }

    fn read_clock(&mut self) {
        // A device that does not answer is declared lost when it stops sending pictures, not when a clock reading
        // fails.
        if let Ok(Some(trip)) = self.source.clock() {
            self.asked = Some(Instant::now());
            let mut state = self.shared.lock();
            let jumps = state.clock.jumps();
            state.clock.round_trip(trip);
            // Only once: a clock that jumps constantly would drown all other messages.
            if state.clock.jumps() > jumps && !std::mem::replace(&mut self.jump_said, true) {
                let name = self.source.name();
                state
                    .said
                    .push(format!("{name}: its clock jumped: what came around it is paired with no pose by time"));
            }
        }
    }

    fn take(&mut self, picture: Box<Picture>) {
        self.numbering.first = *self.first.get_or_insert(picture.id);
        let mut state = self.shared.lock();
        state.resent = self.source.resent();
        if let (Some(there), None) = (picture.device_ns, self.asked) {
            state.clock.one_way(there + picture.exposure_ns.unwrap_or(0), picture.host_ns);
        }
        if state.ledger.came(picture.id, picture.host_ns) == Order::Late {
            return;
        }
        self.came += 1;
        let weight = weight(&picture);
        match self.options.mode {
            Mode::Newest => {
                let passed = state.pictures.len() as u64;
                state.ledger.account().dropped_processing += passed;
                (state.bytes, _) = (0, state.pictures.drain(..).count());
            }
            Mode::All if self.source.waits() => {
                while state.bytes + weight > self.options.memory && !state.pictures.is_empty() && !self.stopped() {
                    let waited = self.shared.changed.wait_timeout(state, GLANCE);
                    state = waited.unwrap_or_else(PoisonError::into_inner).0;
                }
            }
            Mode::All => {
                if state.bytes + weight > self.options.memory && !state.pictures.is_empty() {
                    state.ledger.account().dropped_queue += 1;
                    return;
                }
            }
        }
        state.bytes += weight;
        state.pictures.push_back((picture, self.numbering));
        self.shared.changed.notify_all();
    }

    /// The source is back: notes which numbers are still comparable, and reads its clock again.
    fn opened_again(&mut self) {
        let trip = self.source.clock().ok().flatten();
        let mut state = self.shared.lock();
        let ran_on = trip.is_some_and(|trip| state.clock.ran_on(trip));
        if !ran_on {
            // Pictures that still wait to be paired have times of the clock before its restart.
            state.clock.begin_anew(now_ns());
        }
        drop(state);
        self.numbering.outages += 1;
        self.numbering.resets += u64::from(!ran_on);
        (self.first, self.asked) = (None, None);
        (0..CLOCK_FIRST).for_each(|_| self.read_clock());
    }

    /// Waits for a lost camera. `Err` if it does not come back; with the reason, unless the end was requested.
    fn bring_back(&mut self, fault: Fault) -> std::result::Result<(), Option<Fault>> {
        if !self.source.reopens() || self.options.patience.is_zero() {
            return Err(Some(fault));
        }
        let (since, gone) = (Instant::now(), now_ns());
        {
            let mut state = self.shared.lock();
            if let Some(sent) = self.source.sent() {
                state.ledger.says(sent);
            }
            state.ledger.gone();
            state.said.push(format!("{}: gone: {}; waiting for it", self.source.name(), fault.what));
        }
        let mut why = fault.what.clone();
        while since.elapsed() < self.options.patience {
            if self.over() {
                return Err(None);
            }
            match self.source.reopen() {
                Ok(()) => {
                    let seconds = (now_ns() - gone) as f64 * 1e-9;
                    self.shared.lock().said.push(format!("{}: back after {seconds:.1} s", self.source.name()));
                    self.opened_again();
                    return Ok(());
                }
                Err(again) if again.what != why => {
                    self.shared.lock().said.push(format!("{}: still waited for: {}", self.source.name(), again.what));
                    why = again.what;
                }
                Err(_) => {}
            }
            std::thread::sleep(RETRY);
        }
        let waited = self.options.patience.as_secs_f64();
        Err(Some(Fault { what: format!("{}; not back within {waited:.0} s", fault.what), ..fault }))
    }
}
