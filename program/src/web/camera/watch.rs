//! In: a camera's URI, the station's rig. Out: the newest picture with its peaks by `fate`, and the time that took.
//! Pictures that arrive meanwhile are skipped and counted. A job that moves the robot borrows the camera; its
//! pictures are then shown.
//! Frame and unit: px of the picture, grey levels of 8 bits, ms.

use super::lent::Lent;
use super::state::{Looked, State, Use, lock};
use crate::web::message::Frames;
use sheetlight::camera::Readout;
use sheetlight::capture::{
    Account, CameraUri, Fate, Fed, Feed, FeedOptions, Mode, PictureSource, Pictures, RawFormat, now_ns,
};
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::Rig;
use sheetlight::scan::{Live, Where};
use sheetlight::station::{Settings, volume};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Longest wait for a picture before checking whether to end.
const WITHIN: Duration = Duration::from_millis(200);
/// Interval at which a missing camera is opened again.
const AGAIN: Duration = Duration::from_secs(1);
/// Time within which the watching thread releases the camera to a job.
const GIVEN_UP: Duration = Duration::from_secs(5);
/// While a job runs: largest age of a picture, at the time of the request, at which it counts as fresh, ns.
pub const FRESH: u64 = 50_000_000;
/// Number of delays from which p50 and p99 are computed.
const DELAYS: usize = 512;

/// A camera that is being watched.
pub struct Camera {
    uri: CameraUri,
    pub(super) state: Arc<Mutex<State>>,
    ended: Arc<AtomicBool>,
    use_: Arc<Use>,
}

impl Camera {
    /// Starts watching; the camera need not be connected yet. `raw` states the format of frames on standard input.
    /// Returns an error if the URI names no camera, or no thread can be started.
    pub fn watch(uri: &str, raw: Option<RawFormat>, station: &Path) -> Result<Camera> {
        let parsed: CameraUri =
            uri.parse().map_err(|e: String| Fault::usage(e).next("name a camera as docs/live.md shows"))?;
        let (state, ended) = (Arc::new(Mutex::new(State::default())), Arc::new(AtomicBool::new(false)));
        let use_ = Arc::new(Use::default());
        let (tell, end, station, uses, uri) =
            (state.clone(), ended.clone(), station.to_owned(), use_.clone(), parsed.clone());
        let body = move || {
            while !end.load(Ordering::Relaxed) {
                if uses.lent.load(Ordering::SeqCst) {
                    std::thread::sleep(Duration::from_millis(20));
                    continue;
                }
                uses.open.store(true, Ordering::SeqCst);
                let ends = || end.load(Ordering::Relaxed) || uses.lent.load(Ordering::SeqCst);
                let why = open(&parsed, raw, &tell).and_then(|source| look(source, &station, &tell, &uses, &ends));
                uses.open.store(false, Ordering::SeqCst);
                if ends() {
                    continue;
                }
                lock(&tell).wrong =
                    Some(why.map_or_else(|fault| fault.what, |()| "the camera's pictures have ended".into()));
                if parsed == CameraUri::Input {
                    // What was read from a pipe cannot be read again.
                    return;
                }
                std::thread::sleep(AGAIN);
            }
        };
        std::thread::Builder::new().name("look".into()).spawn(body).map_err(|e| Fault::threads(&e))?;
        Ok(Camera { uri, state, ended, use_ })
    }

    /// The camera for a job that requests each picture, until the returned value is dropped. Nobody else reads from
    /// it meanwhile; its pictures are shown.
    ///
    /// # Errors
    /// The camera is not connected, is lent already, or is a pipe.
    pub fn lend(&self) -> Result<Box<dyn PictureSource>> {
        let uri = match self.uri.clone() {
            CameraUri::Cell { address, .. } => CameraUri::Cell { address, rate_hz: -1.0 },
            uri => uri,
        };
        Ok(Box::new(self.borrowed(&uri, Arc::default())?))
    }

    /// The camera at its own frame rate, to change its settings; the user loses it once `stop` is set.
    ///
    /// # Errors
    /// As for [`Camera::lend`].
    pub fn lend_running(&self, stop: &Arc<AtomicBool>) -> Result<Box<dyn PictureSource>> {
        Ok(Box::new(self.borrowed(&self.uri, stop.clone())?))
    }

    fn borrowed(&self, uri: &CameraUri, stop: Arc<AtomicBool>) -> Result<Lent> {
        if self.uri == CameraUri::Input {
            return Err(Fault::refused("a pipe can neither be set nor asked for a picture")
                .next("serve the screen with a camera that has an address"));
        }
        if self.use_.lent.swap(true, Ordering::SeqCst) {
            return Err(Fault::refused("another job has the camera").next("wait until it has ended"));
        }
        // Any error from here on returns the camera.
        let mut lent = Lent { inner: None, state: self.state.clone(), use_: self.use_.clone(), stop, set: false };
        let give_up = Instant::now() + GIVEN_UP;
        while self.use_.open.load(Ordering::SeqCst) && Instant::now() < give_up {
            std::thread::sleep(Duration::from_millis(5));
        }
        lent.inner = Some(open(uri, None, &self.state)?);
        Ok(lent)
    }

    /// The station's settings or calibrations have changed: the next picture is measured with the new ones.
    pub fn renew(&self) {
        self.use_.renewed.store(true, Ordering::SeqCst);
    }

    /// A job runs: pictures are measured only on a viewer's request, and on a separate thread, so that the job has
    /// all others.
    pub fn make_way(&self, busy: bool) {
        self.use_.busy.store(busy, Ordering::SeqCst);
    }

    /// The next picture whose number is not `number`, within the time limit. While a job runs it waits for a fresh
    /// one, and returns an older one if none comes.
    pub async fn next(&self, number: u64, within: Duration) -> Option<Arc<Looked>> {
        let (asked, until) = (now_ns(), tokio::time::Instant::now() + within);
        loop {
            let came = self.use_.came.notified();
            self.use_.asked_ns.store(now_ns(), Ordering::SeqCst);
            let looked = self.other_than(number);
            // A job that has the camera takes pictures when it needs them: the newest is as fresh as possible.
            let on_demand = self.use_.busy.load(Ordering::SeqCst) && !self.use_.lent.load(Ordering::SeqCst);
            match looked {
                Some(looked) if !on_demand || looked.came_ns + FRESH >= asked => return Some(looked),
                _ => {}
            }
            if tokio::time::timeout_at(until, came).await.is_err() {
                return self.other_than(number);
            }
        }
    }

    /// The newest picture, if its number is not `number`.
    pub fn other_than(&self, number: u64) -> Option<Arc<Looked>> {
        lock(&self.state).newest.as_ref().filter(|l| l.number != number).cloned()
    }

    /// How its pictures are read from the sensor, if the camera reports it.
    pub fn readout(&self) -> Option<Readout> {
        lock(&self.state).readout
    }

    /// Recent frame rate, Hz; `None`: unknown.
    pub fn rate_hz(&self) -> Option<f64> {
        lock(&self.state).rate_hz
    }

    /// What became of its pictures.
    pub fn account(&self) -> Account {
        lock(&self.state).account.clone()
    }

    /// Time at which a picture's last byte arrived, ns of the host's clock; `None` if the picture is too old.
    pub fn moment(&self, number: u64) -> Option<u64> {
        lock(&self.state).moments.iter().find(|(n, _)| *n == number).map(|(_, at)| *at)
    }

    /// Counts of frames by fate, delays p50 and p99 in ms, what is wrong.
    pub fn seen(&self) -> (Frames, Option<[f64; 2]>, Option<String>) {
        let state = lock(&self.state);
        let a = &state.account;
        let dropped = [
            ("skipped: a newer one came", a.dropped_processing),
            ("no stripe", state.without_stripe),
            ("nobody looked while a job ran", state.unlooked),
            ("incomplete", a.incomplete),
            ("missed by the camera", a.missed),
            ("late", a.late),
            ("no room", a.dropped_queue),
        ];
        let dropped = dropped.into_iter().filter(|(_, n)| *n > 0).map(|(why, n)| (why.to_owned(), n)).collect();
        let frames = Frames { seen: a.sent.max(a.complete), measured: state.measured, dropped };
        let mut delays: Vec<f64> = state.delays.iter().copied().collect();
        delays.sort_by(f64::total_cmp);
        let at = |q: f64| delays[((delays.len() - 1) as f64 * q).round() as usize];
        let both = (!delays.is_empty()).then(|| [at(0.5), at(0.99)]);
        (frames, both, state.wrong.clone())
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
    }
}

/// Opens the camera and sets again what was set from here.
fn open(uri: &CameraUri, raw: Option<RawFormat>, state: &Mutex<State>) -> Result<Box<dyn PictureSource>> {
    let mut source = uri.open(raw)?;
    let (kept, known) = {
        let state = lock(state);
        (state.kept.clone(), state.features.is_some())
    };
    for (name, value) in kept {
        if let Err(fault) = source.set(&name, &value) {
            // It is now another camera, or it is set elsewhere: its settings are left unchanged.
            let mut state = lock(state);
            state.kept.retain(|(n, _)| *n != name);
            state.wrong = Some(fault.what);
        }
    }
    lock(state).readout = source.readout();
    if !known {
        let features = source.features().unwrap_or_default();
        lock(state).features = Some(features);
    }
    Ok(source)
}

/// Measures the newest picture repeatedly, until the source ends.
fn look(
    source: Box<dyn PictureSource>,
    station: &Path,
    tell: &Mutex<State>,
    uses: &Use,
    ends: &dyn Fn() -> bool,
) -> Result<()> {
    let feed = Feed::start(source, FeedOptions { mode: Mode::Newest, ..FeedOptions::default() })?;
    uses.renewed.store(true, Ordering::SeqCst);
    let mut live = Err(Fault::input("no picture was measured yet").next("wait for the next picture"));
    // A scan keeps its threads busy for a batch at a time; with a separate thread a picture does not wait for them.
    let beside = rayon::ThreadPoolBuilder::new().num_threads(1).thread_name(|_| "look beside".into()).build();
    let mut number = lock(tell).newest.as_ref().map_or(0, |l| l.number);
    while !ends() {
        if uses.renewed.swap(false, Ordering::SeqCst) {
            live = begin(station, feed.pictures());
            lock(tell).wrong = live.as_ref().err().map(|fault| fault.what.clone());
        }
        let picture = match feed.next(WITHIN) {
            Fed::Picture(picture, _) => picture,
            Fed::Quiet => continue,
            Fed::Ended(fault) => {
                lock(tell).account = feed.account();
                return fault.map_or(Ok(()), Err);
            }
        };
        let busy = uses.busy.load(Ordering::SeqCst);
        if uses.asked_ns.swap(0, Ordering::SeqCst) == 0 && busy {
            feed.fate(Fate::Used);
            let mut state = lock(tell);
            state.unlooked += 1;
            (state.account, state.rate_hz) = (feed.account(), feed.rate_hz());
            continue;
        }
        number += 1;
        let (image, came_ns) = (picture.image, picture.host_ns);
        let mut measure = || live.as_mut().ok().map(|l| l.measure(number as u32, image.clone())).transpose();
        let measured = match &beside {
            Ok(pool) if busy => pool.install(measure),
            _ => measure(),
        }?
        .flatten();
        feed.fate(Fate::Used);
        let peaks: Vec<_> = measured.iter().flat_map(|m| &m.peaks).map(|p| (p.u, p.v, p.flags & 0xff)).collect();
        let delay_ms = now_ns().saturating_sub(came_ns) as f64 * 1e-6;
        let mut state = lock(tell);
        if peaks.is_empty() {
            state.without_stripe += 1;
        } else {
            state.measured += 1;
        }
        state.taken(number, came_ns);
        state.newest = Some(Arc::new(Looked::new(number, image, peaks, delay_ms as f32, came_ns)));
        uses.came.notify_waiters();
        state.delays.push_back(delay_ms);
        if state.delays.len() > DELAYS {
            state.delays.pop_front();
        }
        (state.account, state.rate_hz) = (feed.account(), feed.rate_hz());
        if live.is_ok() {
            state.wrong = feed.news().pop();
        }
    }
    Ok(())
}

/// The measuring chain for pictures of this format.
fn begin(station: &Path, pictures: Pictures) -> Result<Live> {
    let (settings, rig) = (Settings::load(station)?, Rig::load(station)?);
    Live::new(&rig, pictures, &settings.extraction, volume::believed(&settings, &rig).as_ref(), Where::default())
}
