//! In: pictures as a camera delivers them, one at a time. Out: the points of each, with the least delay.
//! Frame and unit: camera frame, mm.

use super::engine::{Engine, Measured, Optical};
use super::scanner::accepted;
use super::{Along, CloudPoint, Extraction, Pictures, Place, Processor, Where};
use crate::fault::Result;
use crate::raster::Image;
use crate::rig::{Rig, Volume};
use crate::stages::stripe::point::Optics;

/// The stripe chain for one picture at a time.
pub struct Live {
    engine: Engine,
    /// Whether the stripe's width and speckle are known, from the first picture that showed it.
    ready: bool,
    /// The image axis that the stripe runs along.
    along: Along,
    /// Largest standard deviation of an accepted peak, in widths of the stripe; that width, px.
    uncertain: f32,
    width_px: f32,
}

impl Live {
    /// Refuses a rig without camera or laser plane, pictures that the camera's calibration does not cover, and a
    /// missing GPU if one is requested.
    pub fn new(
        rig: &Rig,
        pictures: impl Into<Pictures>,
        extraction: &Extraction,
        volume: Option<&Volume>,
        place: Where,
    ) -> Result<Live> {
        extraction.check()?;
        let pictures: Pictures = pictures.into();
        let camera = rig.need_camera()?.for_pictures(pictures.size(), pictures.readout.as_ref())?;
        let laser = rig.need_laser_plane()?.value;
        let optical = Optical { camera, laser, depth_mm: Volume::depths(volume) };
        let along = Along::crossed(Optics::new(&optical.camera, &optical.laser).across());
        let processor: Processor = place.open()?;
        let engine = Engine::new(pictures.format, &optical, extraction, None, processor).one_at_a_time();
        Ok(Live { engine, ready: false, along, uncertain: extraction.choose.uncertain, width_px: 1.0 })
    }

    /// Adapter and driver, or this machine's processor with the reason for it.
    pub fn ran_on(&self) -> String {
        self.engine.ran_on()
    }

    /// The image axis that the stripe runs along.
    pub fn stripe_along(&self) -> Along {
        self.along
    }

    /// The accepted points of a picture as a cloud has them, camera frame.
    pub fn cloud(&self, measured: &Measured) -> Vec<CloudPoint> {
        let limit_px = self.uncertain * self.width_px;
        accepted(measured.shot, &measured.peaks, &measured.points, limit_px, |p| p.sigma_mm)
    }

    /// Peaks and points of one picture, camera frame; `None` until a picture has shown the stripe.
    pub fn measure(&mut self, frame: u32, image: Image) -> Result<Option<Measured>> {
        if !self.ready {
            let Some(seen) = self.engine.measure(&[&image]) else { return Ok(None) };
            self.engine.set_stripe(&seen.stripe)?;
            self.width_px = seen.stripe.width_px;
            self.ready = true;
        }
        self.engine.submit(frame, image, Place::camera())?;
        Ok(self.engine.collect(true)?.pop())
    }
}
