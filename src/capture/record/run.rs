//! In: a stream, a recorder. Out: a recording, written by a separate thread while others read what is stored; its
//! account.
//! Frame and unit: docs/file-formats.md.

use super::super::account::Account;
use super::super::feed::Fate;
use super::super::pair::LeftOut;
use super::super::stream::{Stream, Streamed};
use super::backlog::{Handing, Recorded};
use super::recorder::{Kept, Recorder};
use super::space::Space;
use crate::capture::pair::Paired;
use crate::fault::{Fault, Result};
use std::time::Duration;

/// Result of a recording.
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
    /// The exposures of each pose, if there were several.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposures: Option<Exposed>,
}

/// Poses that were recorded with several exposures.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Exposed {
    /// Exposures as the camera reported them, us.
    pub exposures_us: Vec<f64>,
    /// Longest time from the first to the last picture of a pose, s.
    pub longest_s: f64,
    /// Poses that were left before all their exposures were taken.
    pub left: u64,
}

pub(super) const GLANCE: Duration = Duration::from_millis(200);

pub(super) const ROOM: &str = "make room, then record into another folder; what was recorded can be scanned";

/// Records until the stream ends. `say` receives messages for the user, and the account at intervals. With `on`,
/// each shot is also handed to the backlog.
///
/// # Errors
/// The disk is full: what was recorded stays, and later pictures are dropped. The fault that ended the stream,
/// unless the end was requested.
pub fn record(
    stream: &mut Stream,
    mut recorder: Recorder,
    on: Option<&Handing>,
    mut say: impl FnMut(&Stream, Option<String>),
) -> Result<Recording> {
    let mut space = Space::of(recorder.folder());
    let mut full: Option<Fault> = None;
    let ended = loop {
        let shot = match next_shot(stream, &mut say) {
            Ok(shot) => shot,
            Err(ended) => break ended,
        };
        if full.is_some() {
            stream.fate(Fate::Disk);
            continue;
        }
        let slip = shot.taken.slip();
        match recorder.add(&shot.picture.image, shot.stand.as_ref(), shot.taken, stream.feed().waiting()) {
            Ok(kept) => {
                stream.fate(Fate::Used);
                if let Some(handing) = on {
                    let (image, here_ns) = (shot.picture.image, shot.picture.host_ns);
                    let Kept { name, index } = kept;
                    handing.hand(Recorded { name, index, image, stand: shot.stand, slip, here_ns });
                }
            }
            Err(fault) => {
                stream.fate(Fate::Disk);
                stream.feed().stop();
                full = Some(fault.next(ROOM));
            }
        }
        if let Some(said) = space.warn(recorder.folder(), recorder.bytes()) {
            say(stream, Some(said));
        }
    };
    stream.news().into_iter().for_each(|s| say(stream, Some(s)));
    ended_so(stream, recorder, Vec::new(), full.or(ended))
}

/// The next shot; until it comes `say` receives news, and the account at intervals. The error is the fault that ended
/// the stream, none if its end was requested.
pub(super) fn next_shot(
    stream: &mut Stream,
    say: &mut impl FnMut(&Stream, Option<String>),
) -> std::result::Result<Box<Paired>, Option<Fault>> {
    loop {
        stream.news().into_iter().for_each(|s| say(stream, Some(s)));
        let next = stream.next(GLANCE);
        match next {
            Streamed::Shot(shot) => {
                say(stream, None);
                return Ok(shot);
            }
            Streamed::Quiet => say(stream, None),
            Streamed::Ended(fault) => return Err(fault),
        }
    }
}

/// Completes a recording; `more` are excluded pictures that the stream does not know, `fault` ended it.
pub(super) fn ended_so(
    stream: &Stream,
    recorder: Recorder,
    more: Vec<LeftOut>,
    fault: Option<Fault>,
) -> Result<Recording> {
    let bytes = recorder.bytes();
    let left_out = [stream.left_out().to_vec(), more].concat();
    let (folder, count) = (recorder.folder().display().to_string(), recorder.count());
    let finished = recorder.finish(&left_out);
    if let Some(fault) = fault {
        return Err(Fault { what: format!("{}; {folder} holds {count} shots, whole", fault.what), ..fault });
    }
    let shots = finished?;
    Ok(Recording { shots, bytes, account: stream.account(), left_out, exposures: None })
}
