//! Who says how pictures were read from the sensor: their source, meta.json, or a person where those do not.

use super::Recording;
use crate::camera::Readout;
use crate::fault::{Fault, Result};

/// How pictures were read from the sensor: by their source, or by a person where that does not say.
///
/// # Errors
/// Both say it.
pub fn stated_once(source: Option<Readout>, word: Option<Readout>) -> Result<Option<Readout>> {
    if let (Some(known), Some(word)) = (source, word) {
        return Err(Fault::usage(format!("the recording states the readout {known}, but the option states {word}"))
            .cause("--region and --binned are for pictures that say nothing")
            .next("omit --region and --binned"));
    }
    Ok(source.or(word))
}

/// How the pictures of recordings of one camera were read from its sensor; none where one of them does not say.
///
/// # Errors
/// Recordings say different things: their pixels are of different places.
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

impl Recording {
    /// Takes a person's word for how its pictures were read from the sensor.
    ///
    /// # Errors
    /// meta.json says it too.
    pub fn read_out_as(&mut self, word: Option<Readout>) -> Result<()> {
        self.meta.image.readout = stated_once(self.meta.image.readout, word)?;
        Ok(())
    }
}
