//! In: the name of a picture inside a file of raw frames, `FILE.raw#NUMBER`. Out: the picture.
//! Frame and unit: rows without gaps, one after another; levels of more than 8 bits as two bytes, little endian.

use crate::fault::{Fault, Result};
use crate::raster::Image;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// The file and the frame number in a picture's name; none if it names a picture file.
pub(super) fn place(name: &str) -> Option<(&str, u64)> {
    let (file, number) = name.rsplit_once('#')?;
    file.ends_with(".raw").then_some(())?;
    number.parse().ok().map(|n| (file, n))
}

/// Name of a picture inside such a file.
pub fn raw_name(file: &str, number: u64) -> String {
    format!("{file}#{number}")
}

/// Reads frame `number` of a file of frames of this size and depth. Refuses a file that ends before it, and a level
/// above the depth.
pub(super) fn load(path: &Path, number: u64, [width, height]: [u32; 2], bits: u8) -> Result<Image> {
    let bytes = width as usize * height as usize * if bits > 8 { 2 } else { 1 };
    let mut file = std::fs::File::open(path).map_err(|e| Fault::read(path, e))?;
    let mut frame = vec![0; bytes];
    let read = number.checked_mul(bytes as u64).map_or(Err(std::io::ErrorKind::UnexpectedEof.into()), |at| {
        file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut frame))
    });
    read.map_err(|e| {
        Fault::input(format!(
            "{}: frame {number} of {width}x{height} with {bits} bits cannot be read: {e}",
            path.display()
        ))
        .cause("the recording was cut off, or meta.json is of another one")
        .next("exclude the shot with --skip-bad, or record again")
    })?;
    if bits == 8 {
        return Ok(Image::from_u8(width, height, frame));
    }
    let levels: Vec<u16> = frame.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
    let (largest, limit) = (levels.iter().copied().max().unwrap_or(0), ((1u32 << bits) - 1) as u16);
    if largest > limit {
        return Err(Fault::input(format!(
            "{}: frame {number} holds the level {largest}, above {limit}",
            path.display()
        ))
        .cause("the file or image.bits in meta.json is of another recording")
        .next("correct image.bits in meta.json"));
    }
    Ok(Image::from_u16(width, height, bits, levels))
}
