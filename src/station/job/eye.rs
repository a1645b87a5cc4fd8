//! A camera with the lights that its pictures are taken in.

use super::snapshots::Snapshots;
use crate::arm::Switchboard;
use crate::capture::{PictureSource, Pictures};
use crate::fault::Result;
use crate::raster::Image;
use crate::recording::Beam;

/// A camera with its lights.
pub struct Eye {
    snapshots: Snapshots,
    /// What its pictures are lit by.
    pub lights: Switchboard,
}

impl Eye {
    /// A camera with what lights its pictures.
    pub fn new(camera: Box<dyn PictureSource>, lights: Switchboard) -> Eye {
        Eye { snapshots: Snapshots::new(camera), lights }
    }

    /// What its pictures are, and how they are read from the sensor.
    pub fn pictures(&self) -> Pictures {
        self.snapshots.pictures()
    }

    /// A picture that was begun after now, lit by one laser or by the room's lamp alone (`None`). A laser stays on
    /// after it: the
    /// caller takes the next picture, or ends with [`Switchboard::after`].
    pub fn picture(&mut self, beam: Option<Beam>) -> Result<Image> {
        self.lights.light(beam)?;
        self.snapshots.fresh()
    }
}
