//! In: a camera's URI, the station's rig. Out: the newest picture with its peaks by fate, and how long that took; pictures that came
//! meanwhile are passed over and counted.
//! Frame and unit: px of the picture, grey levels of 8 bits, ms.

use super::message::Frames;
use crate::capture::{CameraUri, Event, Format, Picture, PictureSource, RawFormat, now_ns};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::rig::Rig;
use crate::scan::{Live, Newest, Where};
use crate::station::{Settings, volume};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

/// Waited for a picture at most so long before is looked whether to end.
const WITHIN: Duration = Duration::from_millis(200);
/// A camera that was lost is opened again after so long.
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
    frames: Frames,
    delays: VecDeque<f64>,
    wrong: Option<String>,
}

/// A camera that is looked at.
pub struct Camera {
    state: Arc<Shared>,
    ended: Arc<AtomicBool>,
}

#[derive(Default)]
struct Shared(Mutex<State>);

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(|e| e.into_inner())
    }
    fn drop_one(&self, why: &str) {
        *self.lock().frames.dropped.entry(why.into()).or_default() += 1;
    }
}

impl Camera {
    /// Begins to look. `raw` states what frames on standard input are like. Errors: a URI that names no camera, no threads.
    pub fn watch(uri: &str, raw: Option<RawFormat>, station: &Path) -> Result<Camera> {
        let parsed: CameraUri =
            uri.parse().map_err(|e: String| Fault::usage(e).next("name a camera as docs/live.md shows"))?;
        let (state, ended) = (Arc::new(Shared::default()), Arc::new(AtomicBool::new(false)));
        let newest: Arc<Newest<Picture>> = Arc::default();
        let (tell, fill, end) = (state.clone(), newest.clone(), ended.clone());
        let reader = move || {
            read(&parsed, raw, &tell, &fill, &end);
            fill.close();
        };
        let (tell, station) = (state.clone(), station.to_owned());
        let measurer = move || measure(&station, &tell, &newest);
        let spawn = |name: &str, body: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.into()).spawn(body).map_err(|e| Fault::threads(&e))
        };
        spawn("camera", Box::new(reader))?;
        spawn("look", Box::new(measurer))?;
        Ok(Camera { state, ended })
    }

    /// The newest picture, if it is not the one of this number.
    pub fn other_than(&self, number: u64) -> Option<Arc<Looked>> {
        self.state.lock().newest.as_ref().filter(|l| l.number != number).cloned()
    }

    /// Frames by what became of them, delays p50 and p99 in ms, what is wrong.
    pub fn seen(&self) -> (Frames, Option<[f64; 2]>, Option<String>) {
        let state = self.state.lock();
        let mut delays: Vec<f64> = state.delays.iter().copied().collect();
        delays.sort_by(f64::total_cmp);
        let at = |q: f64| delays[((delays.len() - 1) as f64 * q).round() as usize];
        let both = (!delays.is_empty()).then(|| [at(0.5), at(0.99)]);
        (state.frames.clone(), both, state.wrong.clone())
    }
}

impl Drop for Camera {
    fn drop(&mut self) {
        self.ended.store(true, Ordering::Relaxed);
    }
}

/// Takes pictures as they come; a camera that is lost is opened again.
fn read(uri: &CameraUri, raw: Option<RawFormat>, tell: &Shared, fill: &Newest<Picture>, end: &AtomicBool) {
    let wrong = |what: String| tell.lock().wrong = Some(what);
    let mut source: Option<Box<dyn PictureSource>> = None;
    let mut passed_over = 0;
    while !end.load(Ordering::Relaxed) {
        let Some(open) = &mut source else {
            match uri.open(raw) {
                Ok(opened) => source = Some(opened),
                Err(fault) => {
                    wrong(fault.what);
                    std::thread::sleep(AGAIN);
                }
            }
            continue;
        };
        match open.next(WITHIN) {
            Event::Picture(picture) => {
                let mut state = tell.lock();
                state.wrong = None;
                state.frames.seen += 1;
                drop(state);
                fill.put(*picture);
                let over = fill.passed_over();
                (passed_over..over).for_each(|_| tell.drop_one("passed over: a newer one came"));
                passed_over = over;
            }
            Event::Incomplete { .. } => tell.drop_one("incomplete"),
            Event::Quiet => {}
            Event::Lost(fault) => {
                wrong(fault.what);
                if open.reopen().is_err() {
                    std::thread::sleep(AGAIN);
                    source = None;
                }
            }
            Event::Ended => return wrong("the camera's pictures have ended".into()),
        }
    }
}

/// Measures the newest picture, and the next newest.
fn measure(station: &Path, tell: &Shared, newest: &Newest<Picture>) {
    let mut live: Option<Live> = None;
    let mut number = 0;
    while let Some(picture) = newest.take() {
        number += 1;
        if live.is_none() {
            live = match begin(station, &picture.image) {
                Ok(live) => Some(live),
                Err(fault) => {
                    tell.lock().wrong = Some(fault.what);
                    None
                }
            };
        }
        let image = picture.image;
        let (width, height, grey) = (image.width, image.height, image.to_u8());
        let peaks = live.as_mut().and_then(|l| l.measure(number as u32, image).ok().flatten());
        let peaks = peaks.map(|m| m.peaks.iter().map(|p| (p.u, p.v, p.flags & 0xff)).collect::<Vec<_>>());
        let delay_ms = (now_ns().saturating_sub(picture.host_ns)) as f64 * 1e-6;
        let lit = peaks.as_ref().is_some_and(|p| !p.is_empty());
        let looked =
            Looked { number, width, height, grey, peaks: peaks.unwrap_or_default(), delay_ms: delay_ms as f32 };
        let mut state = tell.lock();
        state.newest = Some(Arc::new(looked));
        state.delays.push_back(delay_ms);
        if state.delays.len() > DELAYS {
            state.delays.pop_front();
        }
        if lit {
            state.frames.measured += 1;
        }
        drop(state);
        if !lit {
            tell.drop_one("no stripe");
        }
    }
}

/// The chain for pictures like this one.
fn begin(station: &Path, image: &Image) -> Result<Live> {
    let (settings, rig) = (Settings::load(station)?, Rig::load(station)?);
    let format = Format { width: image.width, height: image.height, bits: image.bits };
    Live::new(&rig, format, &settings.extraction, volume::believed(&settings, &rig).as_ref(), Where::default())
}
