//! The statement of how pictures were read from the sensor: from their source, from meta.json, or from the user if
//! those have none. The sensor's hot pixels serve to check it.

use super::Recording;
use super::odd::{Odd, odd};
use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::raster::HotPixels;
use rayon::prelude::*;

/// Number of pictures examined, evenly spaced: more would find the same pixels.
const MOST: usize = 24;

/// How pictures were read from the sensor: as their source states, or as the user states if the source does not.
///
/// # Errors
/// Both state it.
pub fn stated_once(source: Option<Readout>, word: Option<Readout>) -> Result<Option<Readout>> {
    if let (Some(known), Some(word)) = (source, word) {
        return Err(Fault::usage(format!("the recording states the readout {known}, but the option states {word}"))
            .cause("--region and --binned are for pictures that say nothing")
            .next("omit --region and --binned"));
    }
    Ok(source.or(word))
}

/// How the pictures of recordings of one camera were read from its sensor; none if any of the recordings does not
/// state it.
///
/// # Errors
/// Recordings state different readouts: their pixels are of different places on the sensor.
pub fn one_readout(recordings: &[Recording]) -> Result<Option<Readout>> {
    let mut stated = recordings.iter().filter_map(|r| Some((r, r.meta.image.readout?)));
    let Some((first, readout)) = stated.next() else { return Ok(None) };
    if let Some((other, another)) = stated.find(|(_, r)| *r != readout) {
        return Err(Fault::input(format!(
            "{} was recorded with {readout}, {} with {another}",
            first.folder.display(),
            other.folder.display()
        ))
        .cause("the camera's region, binning or decimation was changed in between")
        .next("calibrate from recordings of one setting"));
    }
    Ok(recordings.iter().all(|r| r.meta.image.readout.is_some()).then_some(readout))
}

/// The hot pixels of the camera that took these recordings. They are taken from the pictures with the laser on,
/// where room light hides fewer of them, and from all pictures if those are few. Unreadable pictures are skipped.
pub fn hot_pixels(recordings: &[Recording]) -> HotPixels {
    let frames = || recordings.iter().flat_map(|r| r.meta.frames.iter().map(move |f| (r, f)));
    let mut pictures: Vec<(&Recording, &String)> = frames().filter_map(|(r, f)| Some((r, f.laser.as_ref()?))).collect();
    if pictures.len() < MOST {
        pictures.extend(frames().filter_map(|(r, f)| Some((r, f.ambient.as_ref()?))));
    }
    let step = pictures.len().div_ceil(MOST).max(1);
    let chosen: Vec<_> = pictures.into_iter().step_by(step).collect();
    let looked_at = chosen.par_iter().filter_map(|(recording, name)| {
        let image = recording.picture(name).ok()?;
        Some((HotPixels::may_be(&image), image.pixel_count()))
    });
    let (each, counts): (Vec<_>, Vec<_>) = looked_at.unzip();
    HotPixels::of_all(&each, counts.first().copied().unwrap_or(0))
}

impl Recording {
    /// A remark if its first picture seems to be a colour sensor's mosaic.
    ///
    /// # Errors
    /// The first picture seems to have its bytes exchanged. A picture that cannot be read is reported where it is used.
    pub fn grey_levels(&self) -> Result<Option<String>> {
        let first = self.meta.frames.iter().find_map(|f| f.ambient.as_ref().or(f.laser.as_ref()));
        match first.and_then(|name| Some((name, odd(&self.picture(name).ok()?)?))) {
            None => Ok(None),
            Some((name, seems @ Odd::Mosaic(_))) => Ok(Some(format!("{name}: {}", seems.words()))),
            Some((name, seems @ Odd::BytesExchanged)) => Err(Fault::input(format!("{name}: {}", seems.words()))
                .cause("a program that writes numbers in its computer's order")
                .next("exchange the two bytes of each level, or save the pictures as PNG or TIFF")),
        }
    }

    /// Sets the readout that the user states for its pictures.
    ///
    /// # Errors
    /// meta.json states a readout too.
    pub fn read_out_as(&mut self, word: Option<Readout>) -> Result<()> {
        self.meta.image.readout = stated_once(self.meta.image.readout, word)?;
        Ok(())
    }

    /// Compares its hot pixels with those of calibrations.
    ///
    /// # Errors
    /// Pictures that are turned, mirrored or shifted relative to those of the calibration. Nothing is reported if
    /// either side has too few hot pixels.
    pub fn read_alike(&self, known: &[[u32; 2]]) -> Result<()> {
        if known.is_empty() {
            return Ok(());
        }
        let here = hot_pixels(std::slice::from_ref(self));
        match here.otherwise(&HotPixels::stored(known), self.meta.image.size()) {
            Some(otherwise) => otherwise.remark().map(drop).map_err(|e| e.at(self.folder.display())),
            None => Ok(()),
        }
    }
}
