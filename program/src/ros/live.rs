//! In: the profiles of a running camera with their times. Out: an MCAP file or stream with a message for each, the
//! laser's frame at the start and figures at the end.
//! Frame and unit: camera frame, mm; metres in the messages.

use super::bag::{Bag, Topic};
use super::clock::Running;
use super::frames::{Frames, camera_from_laser};
use super::messages::{Link, Points, Stamp, Status, diagnostics, transforms};
use sheetlight::capture::Picture;
use sheetlight::fault::Result;
use sheetlight::geometry::{Camera, Plane};
use sheetlight::scan::{Along, CloudPoint};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Messages of a running camera.
pub struct LiveBag<'a> {
    bag: Bag<'a>,
    frames: Frames,
    sheet: Plane<Camera>,
    along: Along,
    clock: Running,
    /// Time of the last picture.
    last: Option<Stamp>,
}

impl<'a> LiveBag<'a> {
    /// Begins a file; `path` is its name in errors. `sheet` is the laser's, and the stripe runs `along` this axis.
    pub fn file(file: &'a File, path: &Path, sheet: Plane<Camera>, along: Along) -> Result<LiveBag<'a>> {
        Ok(LiveBag::of(Bag::new(file, path)?, sheet, along))
    }

    /// Begins a stream. Each profile is readable as soon as it was added.
    pub fn stream(pipe: impl Write + 'a, sheet: Plane<Camera>, along: Along) -> Result<LiveBag<'a>> {
        Ok(LiveBag::of(Bag::stream(pipe, Path::new("standard output"))?, sheet, along))
    }

    fn of(bag: Bag<'a>, sheet: Plane<Camera>, along: Along) -> LiveBag<'a> {
        LiveBag { bag, frames: Frames::default(), sheet, along, clock: Running::default(), last: None }
    }

    /// The time of a picture: the start of its exposure by the camera's clock, else its arrival less the exposure.
    pub fn time(&mut self, picture: &Picture) -> Stamp {
        self.clock.at(picture.device_ns, picture.host_ns, picture.exposure_ns)
    }

    /// Adds the points of a picture. False if nobody reads the stream any more.
    pub fn profile(&mut self, at: Stamp, points: &[CloudPoint]) -> Result<bool> {
        let camera = self.frames.name("camera");
        if self.last.replace(at).is_none() {
            let place = camera_from_laser(&self.sheet, self.along);
            let link = Link::new(camera, self.frames.name("laser"), &place);
            self.bag.write(Topic::Static, at, &transforms(at, &[link]))?;
        }
        let mut message = Points::new(at, camera, points.len() as u64)?;
        message.add(points);
        self.bag.write(Topic::Profile, at, &message.finish())?;
        self.bag.flush()
    }

    /// Adds figures, whose unit is in their names, and ends the file or stream.
    pub fn finish(mut self, summary: &str, warn: bool, values: Vec<(String, String)>) -> Result<()> {
        if let Some(at) = self.last {
            let name = "sheetlight: live".to_owned();
            let status = Status { warn, name, message: summary.to_owned(), hardware: String::new(), values };
            self.bag.write(Topic::Diagnostics, at, &diagnostics(at, &status))?;
        }
        self.bag.finish().map(|_| ())
    }
}
