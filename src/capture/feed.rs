//! In: a source, a mode. Out: its pictures through a bounded queue, while a thread of its own asks for them; an
//! account of all of them; a camera that went away and came back.
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

/// Which pictures matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Every one, in order: recording and scanning.
    All,
    /// The newest: looking. One that was not taken before the next came is dropped.
    Newest,
}

/// How a source is fed.
#[derive(Clone, Debug)]
pub struct FeedOptions {
    /// Which pictures matter.
    pub mode: Mode,
    /// Memory for pictures that wait, bytes.
    pub memory: usize,
    /// How long a camera that went away is waited for; zero: not at all.
    pub patience: Duration,
    /// Ends after so many complete pictures.
    pub shots: Option<u64>,
    /// Ends after this time.
    pub seconds: Option<f64>,
    /// Set by somebody who wants it to end.
    pub stop: Arc<AtomicBool>,
    /// How pictures are read from the sensor, by a person's word, where the source does not know.
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

/// What becomes of a picture after it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Recorded, scanned or shown.
    Used,
    /// The disk was full or too slow.
    Disk,
    /// Processing was too slow.
    Processing,
    /// Nobody knows where what moves stood.
    Unpaired,
}

/// What comes of waiting for a feed.
#[derive(Debug)]
pub enum Fed {
    /// The next picture, or the newest, and what its number can be compared with.
    Picture(Box<Picture>, Numbering),
    /// The time is over, nothing came.
    Quiet,
    /// Nothing will come any more, and why where it is nobody's wish.
    Ended(Option<Fault>),
}

/// How often a wish to stop is looked for.
const GLANCE: Duration = Duration::from_millis(100);
/// How long a camera has to be given back.
const GIVE_BACK: Duration = Duration::from_millis(1000);
/// From one attempt to bring a camera back to the next.
const RETRY: Duration = Duration::from_millis(500);
/// From one reading of the device's clock to the next, and how many at the beginning.
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
    /// What a person should hear of: the camera went, the camera is back.
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
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Feed {
    /// Starts asking.
    ///
    /// # Errors
    /// No thread can be started; the readout is stated, and the source knows it.
    pub fn start(source: Box<dyn PictureSource>, options: FeedOptions) -> Result<Feed> {
        let (name, device) = (source.name(), source.device());
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
        Ok(Feed { shared, pictures, name, device, stop, thread })
    }

    /// Size and depth of all its pictures.
    pub fn format(&self) -> Format {
        self.pictures.format
    }

    /// What all its pictures are, and how they are read from the sensor.
    pub fn pictures(&self) -> Pictures {
        self.pictures
    }

    /// What it is and where.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Which device it is, however it was named.
    pub fn device(&self) -> &str {
        &self.device
    }

    /// The next picture, waited for at most this long.
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

    /// Notes what became of a picture that [`Feed::next`] gave.
    pub fn fate(&self, fate: Fate) {
        let mut state = self.shared.lock();
        let a = state.ledger.account();
        *match fate {
            Fate::Used => &mut a.used,
            Fate::Disk => &mut a.dropped_disk,
            Fate::Processing => &mut a.dropped_processing,
            Fate::Unpaired => &mut a.unpaired,
        } += 1;
    }

    /// The account so far; pictures under way are complete and not yet anything more.
    pub fn account(&self) -> Account {
        let mut state = self.shared.lock();
        let resent = state.resent;
        Account { resent, ..state.ledger.account().clone() }
    }

    /// Pictures a second, as they came lately.
    pub fn rate_hz(&self) -> Option<f64> {
        self.shared.lock().ledger.rate_hz()
    }

    /// How the device's clock runs against the host's, as far as it is known.
    pub fn clock(&self) -> ClockMap {
        self.shared.lock().clock.clone()
    }

    /// Pictures that wait in memory.
    pub fn waiting(&self) -> usize {
        self.shared.lock().pictures.len()
    }

    /// What happened since it was asked last: the camera went, the camera is back.
    pub fn news(&self) -> Vec<String> {
        std::mem::take(&mut self.shared.lock().said)
    }

    /// Asks for no more; what waits can still be taken.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
    }
}

impl Drop for Feed {
    fn drop(&mut self) {
        self.stop();
        // A camera is given back; a reader that waits inside a pipe is left alone, and ends with the pipe.
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
    Format::of(&picture.image).bytes() + std::mem::size_of::<Picture>()
}

/// The thread that asks.
struct Reader {
    source: Box<dyn PictureSource>,
    shared: Arc<Shared>,
    options: FeedOptions,
    ours: Arc<AtomicBool>,
    begun: Instant,
    /// When the clock was read last.
    asked: Option<Instant>,
    /// A person was told that the clock jumps.
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
        // Whoever hears of the end can have the camera: it was given back.
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
        // A device that does not answer is lost by its pictures, not by its clock.
        if let Ok(Some(trip)) = self.source.clock() {
            self.asked = Some(Instant::now());
            let mut state = self.shared.lock();
            let jumps = state.clock.jumps();
            state.clock.round_trip(trip);
            // Once: one that jumps all the time would say nothing else.
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

    /// The source is back: what can still be compared with what was before, and a new reading of its clock.
    fn opened_again(&mut self) {
        let trip = self.source.clock().ok().flatten();
        let mut state = self.shared.lock();
        let ran_on = trip.is_some_and(|trip| state.clock.ran_on(trip));
        if !ran_on {
            // Pictures that still wait to be paired carry times of the clock as it was.
            state.clock.begin_anew(now_ns());
        }
        drop(state);
        self.numbering.outages += 1;
        self.numbering.resets += u64::from(!ran_on);
        (self.first, self.asked) = (None, None);
        (0..CLOCK_FIRST).for_each(|_| self.read_clock());
    }

    /// Waits for a camera that went away. `Err` where it does not come back, with why unless somebody wanted the end.
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
