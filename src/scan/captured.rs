//! In: a running camera's pictures, paired with what moves; taken directly from the stream, or from a recorder that
//! hands them on. Out: a source of shots.
//! Frame and unit: as [`super::Shot`].

use super::source::{BadShot, Shot, Source};
use crate::capture::record::{Backlog, RecordReport, Recorded, Waits};
use crate::capture::{Account, Fate, Format, Pictures, Stream, Streamed};
use crate::fault::{Fault, Result};
use crate::recording::{FollowedFrames, FrameRef, Recording, Stand};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Called while a source is read: with the stream's state, and with a message for the user if there is one.
pub type Say = Box<dyn FnMut(&Stream, Option<String>)>;

const GLANCE: Duration = Duration::from_millis(200);

/// A stream as a source. Its pictures are not stored.
pub struct StreamSource {
    stream: Stream,
    say: Say,
    next: u32,
    ended: bool,
}

impl StreamSource {
    /// Scans the pictures that a stream delivers.
    pub fn new(stream: Stream, say: Say) -> StreamSource {
        StreamSource { stream, say, next: 0, ended: false }
    }
}

fn without_stand(index: u32, name: &str) -> BadShot {
    let fault = Fault::usage("a picture has no pose")
        .cause("no motion is stated")
        .next("say how pictures are paired with what moves: --pair count, step or clock, or given");
    BadShot { index, name: name.into(), fault, last: true }
}

impl Source for StreamSource {
    fn format(&self) -> Format {
        self.stream.format()
    }

    fn pictures(&self) -> Pictures {
        self.stream.pictures()
    }

    fn remaining(&self) -> Option<usize> {
        None
    }

    fn resumable(&self) -> bool {
        false
    }

    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        while !self.ended {
            let news = self.stream.news();
            news.into_iter().for_each(|s| (self.say)(&self.stream, Some(s)));
            (self.say)(&self.stream, None);
            match self.stream.next(GLANCE) {
                Streamed::Quiet => {}
                Streamed::Ended(fault) => {
                    self.ended = true;
                    let (index, name) = (self.next, self.stream.feed().name().to_owned());
                    return fault.map(|fault| Err(BadShot { index, name, fault, last: true }));
                }
                Streamed::Shot(shot) => {
                    let (index, name) = (self.next, format!("picture {}", shot.picture.id));
                    let Some(stand) = shot.stand else { return Some(Err(without_stand(index, &name))) };
                    self.next += 1;
                    self.stream.fate(Fate::Used);
                    let (slip, here_ns) = (shot.taken.slip(), Some(shot.picture.host_ns));
                    return Some(Ok(Shot { index, name, image: shot.picture.image, stand, slip, here_ns }));
                }
            }
        }
        None
    }

    fn account(&self) -> Option<Account> {
        Some(self.stream.account())
    }

    fn remarks(&self) -> Vec<String> {
        let left = self.stream.left_out();
        let Some(first) = left.first() else { return Vec::new() };
        vec![format!("{} pictures excluded, the first ({}): {}", self.stream.account().unpaired, first.id, first.why)]
    }
}

/// Scans what a recorder on another thread hands on, while it goes on recording. Shots that have to wait are read
/// back from the recorder's disk.
pub struct RecordedSource {
    format: Format,
    recording: Recording,
    backlog: Backlog,
    frames: Option<FollowedFrames>,
    next: usize,
    /// Result of the recording, set once the recording has ended.
    report: Arc<Mutex<Option<Result<RecordReport>>>>,
}

impl RecordedSource {
    /// `meta` is what the recorder writes into `folder`; `report` is set before the backlog's sending end is
    /// dropped.
    pub fn new(
        folder: PathBuf,
        meta: crate::recording::Meta,
        backlog: Backlog,
        report: Arc<Mutex<Option<Result<RecordReport>>>>,
    ) -> RecordedSource {
        let format = Format { width: meta.image.width, height: meta.image.height, bits: meta.image.bits };
        let recording = Recording { folder, meta, channel: Default::default(), exposure: None, outside: false };
        RecordedSource { format, recording, backlog, frames: None, next: 0, report }
    }

    /// Reads a shot as the recorder wrote it.
    fn read(&mut self, index: usize) -> Result<Recorded> {
        let frames = match &mut self.frames {
            Some(frames) => frames,
            none => {
                let name = self.recording.meta.frames_file.as_deref().unwrap_or_default();
                none.insert(FollowedFrames::open(&self.recording.folder.join(name))?)
            }
        };
        let FrameRef { laser, count, taken, .. } = frames.frame(index)?;
        let name = laser.unwrap_or_default();
        let image = self.recording.picture(&name)?;
        let flange = taken.as_ref().and_then(|t| t.base_from_flange);
        let stand = flange.map(Stand::Robot).or(count.map(Stand::Count));
        let (slip, here_ns) = taken.map_or((None, 0), |t| (t.slip(), t.host_ns));
        Ok(Recorded { name, index, image, stand, slip, here_ns })
    }
}

impl Source for RecordedSource {
    fn format(&self) -> Format {
        self.format
    }

    fn pictures(&self) -> Pictures {
        Pictures { format: self.format, readout: self.recording.meta.image.readout }
    }

    fn remaining(&self) -> Option<usize> {
        None
    }

    fn resumable(&self) -> bool {
        false
    }

    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        let at = self.next;
        let found = loop {
            match self.backlog.shot(at, GLANCE) {
                Waits::InMemory(shot) => break Ok(*shot),
                Waits::OnDisk => break self.read(at),
                Waits::Nowhere => {}
                Waits::Never => return None,
            }
        };
        self.next += 1;
        let index = at as u32;
        Some(match found {
            Ok(Recorded { name, stand: None, .. }) => Err(without_stand(index, &name)),
            Ok(Recorded { name, image, stand: Some(stand), slip, here_ns, .. }) => {
                Ok(Shot { index, name, image, stand, slip, here_ns: Some(here_ns) })
            }
            Err(fault) => Err(BadShot { index, name: format!("shot {at}"), fault, last: false }),
        })
    }

    fn account(&self) -> Option<Account> {
        let report = self.report.lock().unwrap_or_else(PoisonError::into_inner);
        report.as_ref().and_then(|r| r.as_ref().ok()).map(|r| r.account.clone())
    }

    fn remarks(&self) -> Vec<String> {
        let report = self.report.lock().unwrap_or_else(PoisonError::into_inner);
        match report.as_ref() {
            Some(Err(fault)) => vec![fault.what.clone()],
            Some(Ok(r)) if !r.left_out.is_empty() => {
                vec![format!(
                    "{} pictures excluded, the first ({}): {}",
                    r.left_out.len(),
                    r.left_out[0].id,
                    r.left_out[0].why
                )]
            }
            _ => Vec::new(),
        }
    }
}
