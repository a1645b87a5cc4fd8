//! In: a camera's URI, the station's rig. Out: the newest picture with its peaks by fate, and how long that took; pictures that came
//! meanwhile are passed over and counted.
//! Frame and unit: px of the picture, grey levels of 8 bits, ms.

use super::message::Frames;
use crate::capture::{Account, CameraUri, Fate, Fed, Feed, FeedOptions, Format, Mode, RawFormat, now_ns};
use crate::fault::{Fault, Result};
use crate::rig::Rig;
use crate::scan::{Live, Where};
use crate::station::{Settings, volume};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Waited for a picture at most so long before is looked whether to end.
const WITHIN: Duration = Duration::from_millis(200);
/// A camera that is not there is looked for again after so long.
const AGAIN: Duration = Duration::from_secs(1);
/// Delays that p50 and p99 are of.
const DELAYS: usize = 512;

/// A picture to look at.
pub struct Looked {
    /// Counts up with every picture that was measured.
    pub number: u64,
    /// Grey levels, 8 bits.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Row by row from the top.
    pub grey: Vec<u8>,
    /// u, v and fate (0: kept) of each peak.
    pub peaks: Vec<(f32, f32, u32)>,
    /// From its last byte to its points, ms.
    pub delay_ms: f32,
}

#[derive(Default)]
struct State {
    newest: Option<Arc<Looked>>,
    account: Account,
    measured: u64,
    without_stripe: u64,
    delays: VecDeque<f64>,
    wrong: Option<String>,
}

/// A camera that is looked at.
pub struct Camera {
    state: Arc<Mutex<State>>,
    ended: Arc<AtomicBool>,
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(|e| e.into_inner())
}

impl Camera {
    /// Begins to look; the camera need not be there yet. `raw` states what frames on standard input are like. Errors: a URI that
    /// names no camera, no threads.
    pub fn watch(uri: &str, raw: Option<RawFormat>, station: &Path) -> Result<Camera> {
        let parsed: CameraUri =
            uri.parse().map_err(|e: String| Fault::usage(e).next("name a camera as docs/live.md shows"))?;
        let (state, ended) = (Arc::new(Mutex::new(State::default())), Arc::new(AtomicBool::new(false)));
        let (tell, end, station) = (state.clone(), ended.clone(), station.to_owned());
        let body = move || {
            while !end.load(Ordering::Relaxed) {
                let why = look(&parsed, raw, &station, &tell, &end);
                lock(&tell).wrong =
                    Some(why.map_or_else(|fault| fault.what, |()| "the camera's pictures have ended".into()));
                if parsed == CameraUri::Input {
                    // What was read from a pipe cannot be had again.
                    return;
                }
                std::thread::sleep(AGAIN);
            }
        };
        std::thread::Builder::new().name("look".into()).spawn(body).map_err(|e| Fault::threads(&e))?;
        Ok(Camera { state, ended })
    }

    /// The newest picture, if it is not the one of this number.
    pub fn other_than(&self, number: u64) -> Option<Arc<Looked>> {
        lock(&self.state).newest.as_ref().filter(|l| l.number != number).cloned()
    }

    /// Frames by what became of them, delays p50 and p99 in ms, what is wrong.
    pub fn seen(&self) -> (Frames, Option<[f64; 2]>, Option<String>) {
        let state = lock(&self.state);
        let a = &state.account;
        let dropped = [
            ("passed over: a newer one came", a.dropped_processing),
            ("no stripe", state.without_stripe),
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

/// Measures the newest picture, and the next newest, until the source ends.
fn look(uri: &CameraUri, raw: Option<RawFormat>, station: &Path, tell: &Mutex<State>, end: &AtomicBool) -> Result<()> {
    let feed = Feed::start(uri.open(raw)?, FeedOptions { mode: Mode::Newest, ..FeedOptions::default() })?;
    let mut live = begin(station, feed.format());
    if let Err(fault) = &live {
        lock(tell).wrong = Some(fault.what.clone());
    }
    let mut number = lock(tell).newest.as_ref().map_or(0, |l| l.number);
    while !end.load(Ordering::Relaxed) {
        let picture = match feed.next(WITHIN) {
            Fed::Picture(picture) => picture,
            Fed::Quiet => continue,
            Fed::Ended(fault) => {
                lock(tell).account = feed.account();
                return fault.map_or(Ok(()), Err);
            }
        };
        number += 1;
        let (image, came_ns) = (picture.image, picture.host_ns);
        let (width, height, grey) = (image.width, image.height, image.to_u8());
        let measured = live.as_mut().ok().map(|l| l.measure(number as u32, image)).transpose()?.flatten();
        feed.fate(Fate::Used);
        let peaks: Vec<_> = measured.iter().flat_map(|m| &m.peaks).map(|p| (p.u, p.v, p.flags & 0xff)).collect();
        let delay_ms = now_ns().saturating_sub(came_ns) as f64 * 1e-6;
        let mut state = lock(tell);
        if peaks.is_empty() {
            state.without_stripe += 1;
        } else {
            state.measured += 1;
        }
        state.newest = Some(Arc::new(Looked { number, width, height, grey, peaks, delay_ms: delay_ms as f32 }));
        state.delays.push_back(delay_ms);
        if state.delays.len() > DELAYS {
            state.delays.pop_front();
        }
        state.account = feed.account();
        if live.is_ok() {
            state.wrong = feed.news().pop();
        }
    }
    Ok(())
}

/// The chain for pictures like these.
fn begin(station: &Path, format: Format) -> Result<Live> {
    let (settings, rig) = (Settings::load(station)?, Rig::load(station)?);
    Live::new(&rig, format, &settings.extraction, volume::believed(&settings, &rig).as_ref(), Where::default())
}
