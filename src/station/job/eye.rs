//! A camera with the lights for its pictures.

use super::snapshots::Snapshots;
use crate::arm::Switchboard;
use crate::capture::{PictureSource, Pictures};
use crate::fault::{Fault, Kind, Result};
use crate::raster::Image;
use crate::recording::Beam;

/// A camera with its lights.
pub struct Eye {
    snapshots: Snapshots,
    /// The lights of its pictures.
    pub lights: Switchboard,
}

impl Eye {
    /// A camera with its lights.
    pub fn new(camera: Box<dyn PictureSource>, lights: Switchboard) -> Eye {
        Eye { snapshots: Snapshots::new(camera), lights }
    }

    /// Format of its pictures, and their readout from the sensor.
    pub fn pictures(&self) -> Pictures {
        self.snapshots.pictures()
    }

    /// A picture whose exposure began after this call, lit by one laser or by the room's lamp alone (`None`). A
    /// laser stays on afterwards: the caller takes the next picture, or ends with [`Switchboard::after`].
    pub fn picture(&mut self, beam: Option<Beam>) -> Result<Image> {
        self.lights.light(beam)?;
        // Whatever a camera does wrong while a job runs, no file is at fault.
        self.snapshots.fresh().map_err(|fault| Fault { kind: Kind::Device, ..fault })
    }
}
