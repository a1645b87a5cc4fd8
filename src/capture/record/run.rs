//! In: a stream, a recorder. Out: a recording, written by a thread of its own while others read what is there; its account.
//! Frame and unit: docs/file-formats.md.

use super::super::account::Account;
use super::super::feed::Fate;
use super::super::pair::LeftOut;
use super::super::stream::{Stream, Streamed};
use super::recorder::{Kept, Recorder};
use super::space::Space;
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::{Slip, Stand};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// A shot that has been recorded.
pub struct Recorded {
    /// Where it lies.
    pub kept: Kept,
    /// The picture, where few wait to be read: the others are read from the disk again.
    pub image: Option<Image>,
    /// Where what moves stood.
    pub stand: Option<Stand>,
    /// How far that may be off.
    pub slip: Option<Slip>,
    /// When its last byte was here, ns of the host's clock.
    pub here_ns: u64,
}

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

/// Pictures handed on and not yet taken.
#[derive(Clone, Default)]
pub struct Backlog(Arc<Mutex<usize>>);

impl Backlog {
    fn add(&self) -> bool {
        let mut n = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let room = *n < HANDED;
        *n += usize::from(room);
        room
    }
    /// A picture that was handed on was taken.
    pub fn taken(&self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
    }
}

/// Records until the stream ends. `say` is told what a person should hear, and the account now and then. With `on` each shot is handed on.
///
/// # Errors
/// The disk is full: what was recorded stays, and the pictures from then on are dropped. What ended the stream, where nobody wished it.
pub fn record(
    stream: &mut Stream,
    mut recorder: Recorder,
    on: Option<(Sender<Recorded>, Backlog)>,
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
        let slip = shot.taken.slip();
        match recorder.add(&shot.picture.image, shot.stand.as_ref(), shot.taken, stream.feed().fill()) {
            Ok(kept) => {
                stream.fate(Fate::Used);
                if let Some((send, backlog)) = &on {
                    let here_ns = shot.picture.host_ns;
                    let image = backlog.add().then_some(shot.picture.image);
                    // Nobody reads any more: recording goes on.
                    let _ = send.send(Recorded { kept, image, stand: shot.stand, slip, here_ns });
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

/// [`record`] on a thread of its own; the shots come through the channel.
pub fn handing_on() -> (Sender<Recorded>, Receiver<Recorded>, Backlog) {
    let (send, receive) = channel();
    (send, receive, Backlog::default())
}
