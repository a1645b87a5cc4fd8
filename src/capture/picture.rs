//! In: a camera, or whatever stands for one. Out: its pictures with id and times, and what became of those that did
//! not come.
//! Frame and unit: times in ns, the device's by its own clock, the host's by [`super::now_ns`]; grey levels of the
//! sensor's depth.

use super::clock::RoundTrip;
use super::feature::Feature;
use super::format::Format;
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::Stand;
use std::time::Duration;

/// A picture as it came.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Grey levels of the sensor's depth.
    pub image: Image,
    /// The device's number of it: one more for every picture that the device took, so that gaps are pictures that
    /// were lost. Where the device counts nothing, those that came are counted.
    pub id: u64,
    /// When its exposure began, by the device's own clock; none where the device says nothing.
    pub device_ns: Option<u64>,
    /// When its last byte was here, by the host's clock.
    pub host_ns: u64,
    /// How long it was exposed; none where nobody says.
    pub exposure_ns: Option<u64>,
    /// The encoder's or trigger's count that the camera sent along with it (chunk data).
    pub count: Option<i64>,
    /// Where what moves stood in the middle of the exposure, of a source that knows: a recording that is played, a
    /// simulated station.
    pub stand: Option<Stand>,
}

/// How far the numbers of pictures can be compared: what happened to the source before a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Numbering {
    /// The first number that was seen since the source was opened, also of a picture that came only in part.
    pub first: u64,
    /// How often the source was gone and came back. Numbers of before and after do not belong together.
    pub outages: u64,
    /// Outages after which the device's clock does not show that it had power all the time: its counters may have begun
    /// anew.
    pub resets: u64,
}

/// What comes of waiting for the next picture.
#[derive(Debug)]
pub enum Event {
    /// It is here.
    Picture(Box<Picture>),
    /// The device sent it, and not all of it came: it is no picture.
    Incomplete {
        /// The device's number of it.
        id: u64,
        /// What is missing, in words.
        why: String,
    },
    /// The time is over, nothing came.
    Quiet,
    /// The device is gone: cable, power, process. [`PictureSource::reopen`] may bring it back.
    Lost(Fault),
    /// No picture will come any more: the file is played, the pipe was closed.
    Ended,
}

/// A source of pictures. It starts when it is opened, and is asked on one thread; pictures come at its own pace and
/// in its own order, and are lost where nobody asks in time (which their ids show).
pub trait PictureSource: Send {
    /// Size and depth of all its pictures.
    fn format(&self) -> Format;

    /// How its pictures are read from the sensor; none where it does not know.
    fn readout(&self) -> Option<Readout> {
        None
    }

    /// The next picture, waited for at most this long.
    fn next(&mut self, within: Duration) -> Event;

    /// Takes one picture now; it comes as the others do. False where the source runs by itself and cannot be asked.
    ///
    /// # Errors
    /// The device does not answer.
    fn trigger(&mut self) -> Result<bool> {
        Ok(false)
    }

    /// How many pictures the device says it has sent since it was opened; none where it does not say: then the ids
    /// tell.
    fn sent(&self) -> Option<u64> {
        None
    }

    /// Packets that were asked for again and came.
    fn resent(&self) -> u64 {
        0
    }

    /// Reads the device's clock. `None`: it has none that can be asked; its pictures' own times are all there is.
    ///
    /// # Errors
    /// The device does not answer.
    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        Ok(None)
    }

    /// Whether its pictures wait where nobody asks for them (a pipe, a file): then nobody has to drop any.
    fn waits(&self) -> bool {
        false
    }

    /// Whether [`PictureSource::reopen`] can bring it back at all.
    fn reopens(&self) -> bool {
        false
    }

    /// Opens it again after [`Event::Lost`]; its numbers and its clock may begin anew.
    ///
    /// # Errors
    /// It is not there (yet).
    fn reopen(&mut self) -> Result<()> {
        Err(Fault::input("this source cannot be opened again").next("start it again, then this command"))
    }

    /// What can be set, by the standard names; empty where nothing can.
    ///
    /// # Errors
    /// The device does not answer.
    fn features(&mut self) -> Result<Vec<Feature>> {
        Ok(Vec::new())
    }

    /// Sets a feature.
    ///
    /// # Errors
    /// An unknown name, a value out of range, a feature that cannot be set now.
    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        let _ = value;
        Err(Fault::usage(format!("{name}: this source has no features to set"))
            .cause("a pipe, a folder or a file is not a camera")
            .next("set it in the program that fills it"))
    }

    /// In messages: what it is and where.
    fn name(&self) -> String;

    /// Which device it is, however it was named: of a camera on a network its serial number.
    fn device(&self) -> String {
        self.name()
    }
}
