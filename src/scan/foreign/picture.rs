//! In: a picture whose pixels are heights: 32-bit float TIFF, 8- or 16-bit TIFF, PNG, PGM, BMP. Out: its levels.
//! Frame and unit: columns and rows from the top left; whatever the levels mean.

use super::raw::{MOST_POINTS, Raw};
use crate::fault::{Fault, Result};
use crate::raster::{Channel, decode, read_float_tiff};

pub(super) fn read(bytes: &[u8]) -> Result<Raw> {
    let tiff = bytes.starts_with(b"II*\0") || bytes.starts_with(b"MM\0*");
    if tiff && let Ok((width, height, levels)) = read_float_tiff(bytes) {
        let levels = levels.into_iter().map(|v| if v.is_finite() { v } else { f32::NAN }).collect();
        return Ok(Raw::Picture { width: width as usize, height: height as usize, levels, whole: false });
    }
    if bytes.starts_with(&[0xff, 0xd8]) {
        return Err(Fault::input("is a JPEG: its levels are no longer those that were measured")
            .cause("a picture of the heights for people")
            .next("export the heights as TIFF or PNG of 16 bits, or as float TIFF"));
    }
    // A depth of 16 takes every level as it stands; pictures of 8 bits say so by themselves.
    let image = decode(bytes, Channel::Luma, 16).or_else(|_| decode(bytes, Channel::Luma, 8)).map_err(|e| {
        Fault::input(format!("is neither a height picture nor a PLY or PCD: {}", e.what))
            .cause("another format, or a damaged file")
            .next("give a TIFF, PNG, PGM, PLY or PCD")
    })?;
    if image.pixel_count() > MOST_POINTS {
        return Err(Fault::input(format!("has {} pixels, limit {MOST_POINTS}", image.pixel_count()))
            .cause("several maps in one picture")
            .next("cut out the part that is to be searched"));
    }
    Ok(Raw::Picture { width: image.width as usize, height: image.height as usize, levels: image.to_f32(), whole: true })
}
