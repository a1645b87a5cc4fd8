//! In: a camera that delivers pictures. Out: those that were exposed after a given moment, however many older ones are
//! in flight.
//! Frame and unit: the device's time in ns.

use crate::capture::picture::{Event, PictureSource};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::time::{Duration, Instant};

/// A sensor that is read while it exposes applies a setting one picture later.
const PIPELINE: usize = 1;
/// The same number for pictures without exposure times, counted after those already waiting.
const UNDATED: usize = 2;
/// More pictures than any camera's driver buffers.
const WAITING: usize = 256;
/// A picture's time and the camera's clock that are farther apart than this, ns, are not of the same clock.
const ONE_CLOCK: u64 = 60_000_000_000;

/// Tells pictures that were exposed after a moment from older ones.
pub(super) struct Settling {
    /// That moment by the device's own clock, if it has one.
    since: Option<u64>,
    skip: usize,
    more: usize,
    /// Number of pictures that may wait in the driver, for a device without a clock.
    waiting: usize,
}

impl Settling {
    /// The moment is now. `more` pictures after it are not used, beyond those that any camera may need.
    pub fn begin(source: &mut dyn PictureSource, more: usize) -> Settling {
        let since = source.clock().ok().flatten().map(|trip| trip.there_ns);
        let (skip, waiting) = if since.is_some() { (PIPELINE, 0) } else { (UNDATED, WAITING) };
        Settling { since, skip: skip + more, more, waiting }
    }

    /// Whether pictures that were taken before and wait are to be requested, without waiting for a new one.
    pub fn drains(&self) -> bool {
        self.waiting > 0
    }

    /// No more pictures wait.
    pub fn drained(&mut self) {
        self.waiting = 0;
    }

    /// The first picture was triggered after the moment: a triggered camera takes only those that are triggered.
    pub fn triggered(&mut self) {
        (self.since, self.skip, self.waiting) = (None, self.more, 0);
    }

    /// Whether the next picture, whose exposure began at this time of the device, was exposed after the moment.
    pub fn accepts(&mut self, begun: Option<u64>) -> bool {
        let before = |(since, begun): (u64, u64)| begun < since && since - begun < ONE_CLOCK;
        if self.since.zip(begun).is_some_and(before) {
            return false;
        }
        if self.waiting > 0 {
            self.waiting -= 1;
            return false;
        }
        if self.skip > 0 {
            self.skip -= 1;
            return false;
        }
        true
    }
}

/// Pictures that were exposed after a given moment.
pub(super) struct Fresh<'a> {
    source: &'a mut dyn PictureSource,
    settling: Settling,
    patience: Duration,
    /// The last picture that was not used. A file's pictures wait for their reader, so at its end the last one is as
    /// good as any.
    last: Option<Image>,
}

impl<'a> Fresh<'a> {
    /// The moment is now.
    pub fn now(source: &'a mut dyn PictureSource, patience: Duration) -> Fresh<'a> {
        let mut settling = Settling::begin(source, 0);
        let mut last = None;
        while settling.drains() {
            match source.next(Duration::ZERO) {
                Event::Picture(picture) => {
                    settling.accepts(picture.device_ns);
                    last = Some(picture.image);
                }
                _ => settling.drained(),
            }
        }
        Fresh { source, settling, patience, last }
    }

    /// The next of them.
    pub fn next(&mut self) -> Result<Image> {
        let until = Instant::now() + self.patience;
        if self.source.trigger()? {
            self.settling.triggered();
        }
        while Instant::now() < until {
            match self.source.next(Duration::from_millis(100)) {
                Event::Picture(picture) if self.settling.accepts(picture.device_ns) => return Ok(picture.image),
                Event::Lost(fault) => return Err(fault),
                Event::Ended => return self.ended(),
                Event::Picture(picture) => self.last = Some(picture.image),
                Event::Quiet | Event::Incomplete { .. } | Event::Spare { .. } => {}
            }
        }
        let name = self.source.name();
        let (cause, next) = if name.starts_with("gige:") {
            (
                "it waits for a trigger, or its packets are lost (packet size, firewall)",
                "see TriggerMode: sheetlight camera show; or try gige://...?packet=1500",
            )
        } else {
            (
                "it sends nothing at present, or waits for a trigger",
                "check with another program that pictures come, then run the command again",
            )
        };
        Err(Fault::input(format!("{name}: no picture within {:.0} s", self.patience.as_secs_f64()))
            .cause(cause)
            .next(next))
    }

    /// The source has ended: its last picture, if its pictures wait for their reader.
    fn ended(&mut self) -> Result<Image> {
        let name = self.source.name();
        self.last.take().filter(|_| self.source.waits()).ok_or_else(|| {
            Fault::input(format!("{name}: ended before a picture came that was taken after the command began"))
                .cause("a file without pictures, or a sender that stopped")
                .next("give a source that goes on sending")
        })
    }
}

/// The next picture that is exposed after this call.
///
/// # Errors
/// None arrives within `patience`; the camera is lost.
pub fn fresh(source: &mut dyn PictureSource, patience: Duration) -> Result<Image> {
    Fresh::now(source, patience).next()
}
