//! In: a recording, the hot pixels that a station's calibrations know. Out: a fault where the recording's pictures are turned,
//! mirrored or moved against those of the calibration: the hot pixels of the sensor tell.
//! Frame and unit: px.

use crate::fault::Result;
use crate::raster::HotPixels;
use crate::recording::{Recording, hot_pixels};

/// # Errors
/// Pictures that are read from the sensor otherwise than those of the calibration. Nothing is said where either set
/// shows too few hot pixels.
pub fn read_alike(recording: &Recording, known: &[[u32; 2]]) -> Result<()> {
    if known.is_empty() {
        return Ok(());
    }
    let (known, here) = (HotPixels::stored(known), hot_pixels(std::slice::from_ref(recording)));
    match here.otherwise(&known, recording.meta.image.size()) {
        Some(otherwise) => otherwise.remark().map(drop).map_err(|e| e.at(recording.folder.display())),
        None => Ok(()),
    }
}
