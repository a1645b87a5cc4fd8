//! Reads a picture whose pixels are heights, or the intensities that belong to them: its numbers as written.

use super::raw::{MOST_POINTS, Raw};
use crate::fault::{Fault, Result};
use crate::raster::{Wanted, read_samples};

pub(super) fn read(bytes: &[u8], page: Option<usize>) -> Result<Raw> {
    let wanted = Wanted { size: None, most: MOST_POINTS as u64, page };
    let samples = read_samples(bytes, &wanted)?;
    if samples.says.lossy {
        return Err(Fault::input("is compressed as JPEG: its levels differ from the measured ones")
            .cause("a picture of the heights for people")
            .next("export the heights as TIFF or PNG of 16 bits, or as float TIFF"));
    }
    if samples.says.two_levels {
        return Err(Fault::input("is a picture of two shades, not of numbers")
            .cause("a mask, or a bitmap for printing")
            .next("give the picture whose levels are measured"));
    }
    if !samples.grey() {
        return Err(Fault::input("is a colour picture; one number per pixel is needed")
            .cause("false colours of a viewer, a palette, or numbers packed into red, green and blue")
            .next("export the numbers themselves as one grey channel: TIFF or PNG of 16 bits, or float TIFF"));
    }
    if samples.veiled > 0 {
        return Err(Fault::input(format!("{} pixels are transparent in part (alpha)", samples.veiled))
            .cause("an editor's soft rim; whether such a pixel was measured is not known")
            .next("make every pixel wholly transparent, which is not measured, or opaque"));
    }
    let (width, height) = (samples.width as usize, samples.height as usize);
    let there = |i: usize| {
        let hidden = samples.hidden.as_ref().is_some_and(|h| h.get((i % width) as u32, (i / width) as u32));
        let level = samples.get(i, 0);
        if hidden || !level.is_finite() { f64::NAN } else { level }
    };
    let levels = (0..width * height).map(there).collect();
    let mut says = samples.says;
    if let Some(hidden) = &samples.hidden {
        says.notes.push(format!("{} transparent or masked pixels count as not measured", hidden.count()));
    }
    Ok(Raw::Picture { width, height, levels, kind: samples.kind, says })
}
