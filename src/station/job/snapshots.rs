//! Pictures of a running camera whose exposure began after they were requested.

use crate::capture::{Event, PictureSource, Pictures};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::time::{Duration, Instant};

/// Longest wait for a picture.
const PATIENCE: Duration = Duration::from_secs(20);
/// Number of pictures that are skipped if the camera's clock cannot be read: they may have been taken before the
/// request.
const ON_THEIR_WAY: u32 = 3;

/// A camera that takes single pictures on request.
pub struct Snapshots {
    camera: Box<dyn PictureSource>,
}

impl Snapshots {
    /// Takes pictures with this camera.
    pub fn new(camera: Box<dyn PictureSource>) -> Snapshots {
        Snapshots { camera }
    }

    /// Format of its pictures, and their readout from the sensor.
    pub fn pictures(&self) -> Pictures {
        Pictures { format: self.camera.format(), readout: self.camera.readout() }
    }

    /// A picture whose exposure began after this call, in the present light.
    pub fn fresh(&mut self) -> Result<Image> {
        let triggered = self.camera.trigger()?;
        let since = if triggered { None } else { self.camera.clock()?.map(|c| c.there_ns) };
        let mut pass_over = if triggered || since.is_some() { 0 } else { ON_THEIR_WAY };
        let give_up = Instant::now() + PATIENCE;
        while Instant::now() < give_up {
            match self.camera.next(Duration::from_millis(200)) {
                Event::Picture(p) => {
                    let late = since.is_some_and(|t| p.device_ns.is_none_or(|d| d < t));
                    if late || pass_over > 0 {
                        pass_over = pass_over.saturating_sub(1);
                        continue;
                    }
                    return Ok(p.image);
                }
                Event::Lost(fault) => return Err(fault),
                Event::Ended => {
                    return Err(Fault::input(format!("{}: no more pictures arrive", self.camera.name()))
                        .next("use a camera that runs, not a file"));
                }
                Event::Incomplete { .. } | Event::Spare { .. } | Event::Quiet => {}
            }
        }
        Err(Fault::device(format!("{}: no picture within {} s", self.camera.name(), PATIENCE.as_secs()))
            .cause("the cable is out, or the camera waits for a trigger")
            .next("look at the camera's picture with another program, then begin again"))
    }
}
