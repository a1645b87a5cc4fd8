//! In: a running camera's pictures, paired with what moves; straight, or as a recorder hands them on. Out: a source of shots.
//! Frame and unit: as [`super::Shot`].

use super::source::{BadShot, Shot, Source};
use crate::capture::record::{Handing, RecordReport, Written};
use crate::capture::{Account, Fate, Format, Stream, Streamed};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::{FrameLines, Meta, Recording, Stand, Taken};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Who is told what happens while a source is read: the stream, and what a person should hear.
pub type Say = Box<dyn FnMut(&Stream, Option<String>)>;

const GLANCE: Duration = Duration::from_millis(200);

/// A stream as a source. Nothing of it is kept.
pub struct StreamSource {
    stream: Stream,
    say: Say,
    next: u32,
    ended: bool,
}

impl StreamSource {
    /// Scans what a stream gives.
    pub fn new(stream: Stream, say: Say) -> StreamSource {
        StreamSource { stream, say, next: 0, ended: false }
    }
}

fn without_stand(index: u32, name: &str) -> BadShot {
    let fault = Fault::usage("a picture comes without where things stood")
        .cause("nothing is said to move")
        .next("say how pictures are paired with what moves: --pair count, step or clock, or given");
    BadShot { index, name: name.into(), fault, last: true }
}

impl Source for StreamSource {
    fn format(&self) -> Format {
        self.stream.format()
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
        vec![format!("{} pictures left out, the first ({}): {}", self.stream.account().unpaired, first.id, first.why)]
    }
}

/// What a recorder on another thread writes, scanned while it goes on recording. Pictures that have to wait are read from its disk again,
/// so that nothing grows however far behind this is.
pub struct RecordedSource {
    format: Format,
    recording: Recording,
    frames: FrameLines,
    handing: Handing,
    next: usize,
    /// What the recording came to, once it has ended.
    report: Arc<Mutex<Option<Result<RecordReport>>>>,
}

impl RecordedSource {
    /// `meta` and `frames` are what the recorder writes into `folder`; `report` is filled before `handing` ends.
    ///
    /// # Errors
    /// There is no recording.
    pub fn new(
        folder: PathBuf,
        meta: Meta,
        handing: Handing,
        report: Arc<Mutex<Option<Result<RecordReport>>>>,
    ) -> Result<RecordedSource> {
        let format = Format { width: meta.image.width, height: meta.image.height, bits: meta.image.bits };
        let frames = FrameLines::open(&folder.join(meta.frames_file.as_deref().unwrap_or_default()))?;
        let recording = Recording { folder, meta, channel: Default::default(), outside: false };
        Ok(RecordedSource { format, recording, frames, handing, next: 0, report })
    }

    /// The shot that is written next, with its picture where that is still here.
    fn shot(&mut self, image: Option<Image>) -> std::result::Result<Shot, BadShot> {
        let index = self.next as u32;
        self.next += 1;
        let bad = |name: &str, fault, last| Err(BadShot { index, name: name.into(), fault, last });
        let frame = match self.frames.next() {
            Ok(Some(frame)) => frame,
            Ok(None) => {
                let cut = Fault::input("the recording's list of frames ends before its last picture")
                    .cause("somebody else writes into the folder")
                    .next("leave it alone while it is recorded");
                return bad("", cut, true);
            }
            Err(fault) => return bad("", fault, true),
        };
        let name = frame.laser.clone().unwrap_or_default();
        let taken = frame.taken.as_ref();
        let pose = || taken.and_then(|t| t.base_from_flange).map(Stand::Robot);
        let Some(stand) = frame.count.map(Stand::Count).or_else(pose) else {
            return Err(without_stand(index, &name));
        };
        let (slip, here_ns) = (taken.and_then(Taken::slip), taken.map(|t| t.host_ns));
        match image.map_or_else(|| self.recording.picture(&name), Ok) {
            Ok(image) => Ok(Shot { index, name, image, stand, slip, here_ns }),
            Err(fault) => bad(&name, fault, false),
        }
    }
}

impl Source for RecordedSource {
    fn format(&self) -> Format {
        self.format
    }

    fn remaining(&self) -> Option<usize> {
        None
    }

    fn resumable(&self) -> bool {
        false
    }

    fn next(&mut self) -> Option<std::result::Result<Shot, BadShot>> {
        loop {
            match self.handing.shot(self.next, GLANCE) {
                Written::Here(image) => return Some(self.shot(Some(image))),
                Written::OnDisk => return Some(self.shot(None)),
                Written::Quiet => {}
                Written::Ended => return None,
            }
        }
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
                    "{} pictures left out, the first ({}): {}",
                    r.left_out.len(),
                    r.left_out[0].id,
                    r.left_out[0].why
                )]
            }
            _ => Vec::new(),
        }
    }
}
