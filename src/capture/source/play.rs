//! In: a recording, a rate. Out: its laser pictures as a camera would send them, each with the position of what
//! moves. Like a camera with a full buffer, it loses pictures.
//! Frame and unit: those of the recording; the device's clock counts ns from its start.

use crate::camera::Readout;
use crate::capture::clock::{RoundTrip, now_ns};
use crate::capture::format::Format;
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::{Recording, Stand};
use std::path::Path;
use std::time::Duration;

/// Decoded pictures are kept up to this many bytes in total; larger recordings are decoded on request.
const KEPT: usize = 512 << 20;
/// Number of pictures that wait in the simulated camera's buffer.
const BUFFER: u64 = 16;

/// A recording that is played back.
pub struct Player {
    recording: Recording,
    format: Format,
    names: Vec<(String, Option<Stand>)>,
    kept: Vec<Option<Image>>,
    /// Time between two pictures, ns; 0: as fast as they are requested.
    period: u64,
    start: u64,
    loops: u64,
    /// Number of the next picture that was not lost.
    next: u64,
}

impl Player {
    /// Plays `loops` times; with `rate_hz` 0 as fast as pictures are requested.
    ///
    /// # Errors
    /// No recording, or one without laser pictures.
    pub fn open(folder: &Path, rate_hz: f64, loops: u64) -> Result<Player> {
        let recording = Recording::open(folder)?;
        if !recording.meta.exposures_us.is_empty() {
            let n = recording.meta.exposures_us.len();
            return Err(Fault::input(format!("{}: each pose has {n} pictures, a camera sends one", folder.display()))
                .cause("a recording of several exposures")
                .next("scan it instead: sheetlight scan merges them"));
        }
        let stands = stands(&recording);
        let frames = recording.meta.frames.iter().zip(stands);
        let names: Vec<_> = frames.filter_map(|(f, s)| Some((f.laser.clone()?, s))).collect();
        if names.is_empty() {
            return Err(Fault::input(format!("{}: has no picture with the laser on", folder.display()))
                .next("play a recording of a scan"));
        }
        let spec = &recording.meta.image;
        let format = Format { width: spec.width, height: spec.height, bits: recording.bits() };
        let keep = if format.bytes() * names.len() <= KEPT { names.len() } else { 0 };
        let kept = names[..keep].iter().map(|(name, _)| recording.picture(name).map(Some)).collect::<Result<_>>()?;
        let period = if rate_hz > 0.0 { (1e9 / rate_hz) as u64 } else { 0 };
        let start = now_ns() + 20_000_000;
        Ok(Player { recording, format, names, kept, period, start, loops, next: 0 })
    }

    fn total(&self) -> u64 {
        self.loops * self.names.len() as u64
    }
}

/// Positions of what moves, as far as the recording states them.
fn stands(recording: &Recording) -> Vec<Option<Stand>> {
    let frames = &recording.meta.frames;
    if recording.meta.motion().axis().is_some() {
        let counts = recording.counts().unwrap_or_default();
        return (0..frames.len()).map(|i| counts.get(i).copied().flatten().map(Stand::Count)).collect();
    }
    let poses = recording.poses(None).unwrap_or_default();
    frames.iter().map(|f| poses.get(f.pose?).copied().map(Stand::Robot)).collect()
}

impl PictureSource for Player {
    fn format(&self) -> Format {
        self.format
    }

    fn readout(&self) -> Option<Readout> {
        self.recording.meta.image.readout
    }

    fn next(&mut self, within: Duration) -> Event {
        if self.next >= self.total() {
            return Event::Ended;
        }
        if self.period > 0 {
            let due = self.start + self.next * self.period;
            let now = now_ns();
            if due > now {
                std::thread::sleep(Duration::from_nanos(due - now).min(within));
                if due > now_ns() {
                    return Event::Quiet;
                }
            }
            let newest = (now_ns() - self.start) / self.period;
            if newest > self.next + BUFFER {
                self.next = (newest - BUFFER).min(self.total());
                return if self.next < self.total() { self.next(within) } else { Event::Ended };
            }
        }
        let (id, k) = (self.next, (self.next % self.names.len() as u64) as usize);
        self.next += 1;
        let (name, stand) = &self.names[k];
        let image = match self.kept.get(k) {
            Some(Some(image)) => image.clone(),
            _ => match self.recording.picture(name) {
                Ok(image) => image,
                Err(fault) => return Event::Incomplete { id, why: fault.what },
            },
        };
        let device_ns = Some(id * self.period);
        let (stand, host_ns) = (*stand, now_ns());
        Event::Picture(Box::new(Picture {
            image,
            id,
            device_ns,
            host_ns,
            exposure_ns: None,
            count: None,
            stand,
            profiles: None,
        }))
    }

    fn sent(&self) -> Option<u64> {
        Some(self.next)
    }

    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        let now = now_ns();
        Ok((self.period > 0 && now > self.start).then(|| RoundTrip {
            before_ns: now,
            there_ns: now - self.start,
            after_ns: now,
        }))
    }

    fn waits(&self) -> bool {
        self.period == 0
    }

    fn name(&self) -> String {
        format!("play:{}", self.recording.folder.display())
    }
}
