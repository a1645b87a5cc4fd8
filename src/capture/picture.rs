//! In: a camera, or a substitute for one. Out: its pictures with id and times, and reports of those that did not
//! arrive.
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

/// A picture as received.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Grey levels of the sensor's depth.
    pub image: Image,
    /// The device's number of the picture. It increases by one for every picture that the device took, so that gaps
    /// are lost pictures. If the device does not count, received pictures are counted.
    pub id: u64,
    /// Start of the exposure, by the device's own clock; none if the device does not state it.
    pub device_ns: Option<u64>,
    /// Arrival of the last byte, by the host's clock.
    pub host_ns: u64,
    /// Exposure time; none if unknown.
    pub exposure_ns: Option<u64>,
    /// The encoder's or trigger's count that the camera sent with the picture (chunk data).
    pub count: Option<i64>,
    /// Position of what moves in the middle of the exposure. Only sources that know it state it: a played recording,
    /// a simulated station.
    pub stand: Option<Stand>,
    /// Of a 3-D camera: for each row the places of its profile, x and z in mm of the camera, NaN where nothing was
    /// measured. The image then shows where something was.
    pub profiles: Option<Vec<Vec<[f64; 2]>>>,
}

impl Picture {
    /// A picture of which the source states nothing but its number and its arrival.
    pub fn arrived(image: Image, id: u64, host_ns: u64) -> Picture {
        Picture { image, id, device_ns: None, host_ns, exposure_ns: None, count: None, stand: None, profiles: None }
    }
}

/// How far the numbers of pictures are comparable: what happened to the source before a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Numbering {
    /// The first number seen since the source was opened; that of an incomplete picture counts too.
    pub first: u64,
    /// Number of times that the source was lost and came back. Numbers from before and after are not comparable.
    pub outages: u64,
    /// Outages after which the device's clock does not prove that it kept its power: its counters may have
    /// restarted.
    pub resets: u64,
}

/// Result of waiting for the next picture.
#[derive(Debug)]
pub enum Event {
    /// A picture arrived.
    Picture(Box<Picture>),
    /// The device sent a picture that did not arrive completely; it is not used.
    Incomplete {
        /// The device's number of the picture.
        id: u64,
        /// What is missing, in words.
        why: String,
    },
    /// A picture arrived complete and is not used: it was exposed before a setting took effect.
    Spare {
        /// The device's number of the picture.
        id: u64,
        /// Arrival of the last byte, by the host's clock.
        host_ns: u64,
    },
    /// The time has passed and nothing arrived.
    Quiet,
    /// The device is lost: cable, power, process. [`PictureSource::reopen`] may bring it back.
    Lost(Fault),
    /// No more pictures will come: the file was played to its end, or the pipe was closed.
    Ended,
}

/// A source of pictures. It starts when it is opened, and is polled on one thread. Pictures come at the source's own
/// pace and in its order. They are lost if nobody polls in time, which their ids show.
pub trait PictureSource: Send {
    /// Size and depth of all its pictures.
    fn format(&self) -> Format;

    /// How its pictures are read from the sensor; none if unknown.
    fn readout(&self) -> Option<Readout> {
        None
    }

    /// What a 3-D camera states about its coordinates, as JSON; none if it sends light.
    ///
    /// # Errors
    /// A camera that sends coordinates which cannot be used: the reason.
    fn coordinates(&self) -> Result<Option<String>> {
        Ok(None)
    }

    /// The next picture, waiting for at most `within`.
    fn next(&mut self, within: Duration) -> Event;

    /// Triggers one picture now; it is delivered like the others. False if the source runs by itself and cannot be
    /// triggered.
    ///
    /// # Errors
    /// The device does not answer.
    fn trigger(&mut self) -> Result<bool> {
        Ok(false)
    }

    /// Number of pictures that the device reports to have sent since it was opened; none if it does not report it:
    /// then the ids are used.
    fn sent(&self) -> Option<u64> {
        None
    }

    /// Number of packets that were requested again and received.
    fn resent(&self) -> u64 {
        0
    }

    /// Reads the device's clock. `None`: it has no clock that can be read; only its pictures' own times are
    /// available.
    ///
    /// # Errors
    /// The device does not answer.
    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        Ok(None)
    }

    /// Whether its pictures wait until they are requested (a pipe, a file), so that none has to be dropped.
    fn waits(&self) -> bool {
        false
    }

    /// Whether [`PictureSource::reopen`] can work at all.
    fn reopens(&self) -> bool {
        false
    }

    /// Opens it again after [`Event::Lost`]; its numbers and its clock may restart.
    ///
    /// # Errors
    /// The device is not there (yet).
    fn reopen(&mut self) -> Result<()> {
        Err(Fault::input("this source cannot be opened again").next("start it again, then this command"))
    }

    /// Features that can be set, by the standard names; empty if there are none.
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

    /// Kind and place of the source, for messages.
    fn name(&self) -> String;

    /// Identity of the device, however it was named: for a network camera its serial number.
    fn device(&self) -> String {
        self.name()
    }
}
