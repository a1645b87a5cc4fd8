//! In: a stream, a recorder. Out: a recording, written by a thread of its own while others read what is there; its account.
//! Frame and unit: docs/file-formats.md.

use super::super::account::Account;
use super::super::feed::Fate;
use super::super::pair::LeftOut;
use super::super::stream::{Stream, Streamed};
use super::recorder::Recorder;
use super::space::Space;
use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What a recording came to.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Recording {
    /// Shots recorded.
    pub shots: usize,
    /// Bytes written.
    pub bytes: u64,
    /// What became of every picture that the camera sent.
    pub account: Account,
    /// Pictures without a pose, with the reason.
    pub left_out: Vec<LeftOut>,
}

/// Pictures that are handed on beside being written; more wait on the disk.
const HANDED: usize = 16;
const GLANCE: Duration = Duration::from_millis(200);

#[derive(Default)]
struct Handed {
    pictures: VecDeque<(usize, Image)>,
    written: usize,
    ended: bool,
}

/// Between a recorder and whoever reads beside it: how far it is, and its last pictures while few wait.
#[derive(Clone, Default)]
pub struct Handing(Arc<(Mutex<Handed>, Condvar)>);

struct Over(Handing);

impl Drop for Over {
    fn drop(&mut self) {
        self.0.lock().ended = true;
        self.0.0.1.notify_all();
    }
}

/// What comes of waiting for a shot of a recording under way.
pub enum Written {
    /// It is on the disk, and its picture here.
    Here(Image),
    /// It is on the disk.
    OnDisk,
    /// The time is over, it is not written yet.
    Quiet,
    /// The recording ends before it.
    Ended,
}

impl Handing {
    fn lock(&self) -> MutexGuard<'_, Handed> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a picture that is written next is wanted in memory.
    fn has_room(&self) -> bool {
        self.lock().pictures.len() < HANDED
    }

    fn wrote(&self, index: usize, image: Option<Image>) {
        let mut handed = self.lock();
        handed.written = index + 1;
        handed.pictures.extend(image.map(|i| (index, i)));
        self.0.1.notify_all();
    }

    /// When this is let go, the recording is over.
    pub fn ends(&self) -> impl Drop + use<> {
        Over(self.clone())
    }

    /// Waits for a shot by its place in the recording; they are asked for in order.
    pub fn shot(&self, index: usize, within: Duration) -> Written {
        let until = Instant::now() + within;
        let mut handed = self.lock();
        loop {
            if handed.written > index {
                return match handed.pictures.front() {
                    Some((at, _)) if *at == index => {
                        handed.pictures.pop_front().map_or(Written::OnDisk, |(_, image)| Written::Here(image))
                    }
                    _ => Written::OnDisk,
                };
            }
            let left = until.saturating_duration_since(Instant::now());
            if handed.ended || left.is_zero() {
                return if handed.ended { Written::Ended } else { Written::Quiet };
            }
            handed = self.0.1.wait_timeout(handed, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// Records until the stream ends. `say` is told what a person should hear, and the account now and then. With `on` somebody reads beside it.
///
/// # Errors
/// The disk is full: what was recorded stays, and the pictures from then on are dropped. What ended the stream, where nobody wished it.
pub fn record(
    stream: &mut Stream,
    mut recorder: Recorder,
    on: Option<&Handing>,
    mut say: impl FnMut(&Stream, Option<String>),
) -> Result<Recording> {
    let mut space = Space::of(recorder.folder());
    let mut full: Option<Fault> = None;
    let ended = loop {
        stream.news().into_iter().for_each(|s| say(stream, Some(s)));
        let shot = match stream.next(GLANCE) {
            Streamed::Shot(shot) => shot,
            Streamed::Quiet => {
                say(stream, None);
                continue;
            }
            Streamed::Ended(fault) => break fault,
        };
        say(stream, None);
        if full.is_some() {
            stream.fate(Fate::Disk);
            continue;
        }
        match recorder.add(&shot.picture.image, shot.stand.as_ref(), shot.taken, stream.feed().fill()) {
            Ok(kept) => {
                stream.fate(Fate::Used);
                if let Some(handing) = on {
                    let image = handing.has_room().then_some(shot.picture.image);
                    handing.wrote(kept.index, image);
                }
            }
            Err(fault) => {
                stream.fate(Fate::Disk);
                stream.feed().stop();
                full = Some(fault.next("make room, then record into another folder; what was recorded can be scanned"));
            }
        }
        if let Some(said) = space.warn(recorder.folder(), recorder.bytes()) {
            say(stream, Some(said));
        }
    };
    stream.news().into_iter().for_each(|s| say(stream, Some(s)));
    let (bytes, left_out) = (recorder.bytes(), stream.left_out().to_vec());
    let (folder, count) = (recorder.folder().display().to_string(), recorder.count());
    let finished = recorder.finish(&left_out);
    if let Some(fault) = full.or(ended) {
        return Err(Fault { what: format!("{}; {folder} holds {count} shots, whole", fault.what), ..fault });
    }
    let shots = finished?;
    Ok(Recording { shots, bytes, account: stream.account(), left_out })
}
