//! In: the layout of raw frames in words, a reader of their bytes. Out: their size and depth; one picture after
//! another.
//! Frame and unit: pixels; grey levels of the sensor's depth; more than 8 bits are stored as two bytes, little
//! endian.

use crate::camera::Readout;
use crate::fault::{Fault, Result};
use crate::raster::{Image, Pixels};
use std::io::Read;

/// Size and depth of every shot of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Format {
    /// Columns, px.
    pub width: u32,
    /// Rows, px.
    pub height: u32,
    /// Bits of a grey level, 8 to 16.
    pub bits: u8,
}

/// Format of pictures, and how they were read from the sensor, if known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pictures {
    /// Size and depth.
    pub format: Format,
    /// Region, binning and decimation; none if unknown.
    pub readout: Option<Readout>,
}

impl Pictures {
    /// Columns and rows, px.
    pub fn size(&self) -> [u32; 2] {
        [self.format.width, self.format.height]
    }
}

impl From<Format> for Pictures {
    fn from(format: Format) -> Pictures {
        Pictures { format, readout: None }
    }
}

impl Format {
    /// Format of a picture.
    pub fn of(image: &Image) -> Format {
        Format { width: image.width, height: image.height, bits: image.bits }
    }

    /// Bytes of one raw frame.
    pub fn bytes(&self) -> usize {
        self.width as usize * self.height as usize * if self.bits > 8 { 2 } else { 1 }
    }

    /// Converts a raw frame's bytes to a picture. Refuses another number of bytes, and a level above the depth.
    pub fn image(&self, bytes: Vec<u8>) -> Result<Image> {
        let Format { width, height, bits } = *self;
        if bytes.len() != self.bytes() {
            return Err(Fault::input(format!(
                "a frame of {} bytes, {width}x{height} with {bits} bits has {}",
                bytes.len(),
                self.bytes()
            ))
            .cause("another frame size or pixel layout than the one stated")
            .next("compare both ends' size and pixel format"));
        }
        if bits == 8 {
            return Ok(Image::from_u8(width, height, bytes));
        }
        let levels: Vec<u16> = bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        let (largest, limit) = (levels.iter().copied().max().unwrap_or(0), ((1u32 << bits) - 1) as u16);
        if largest > limit {
            return Err(Fault::input(format!("a frame holds the level {largest}, above {limit} of {bits} bits"))
                .cause("big-endian data, or another depth")
                .next("compare --raw with the sender's pixel format"));
        }
        Ok(Image::from_u16(width, height, bits, levels))
    }
}

/// The bytes of a picture, laid out as a raw frame.
pub fn raw_bytes(image: &Image) -> std::borrow::Cow<'_, [u8]> {
    match &image.pixels {
        Pixels::U8(levels) => levels.into(),
        Pixels::U16(levels) => levels.iter().flat_map(|l| l.to_le_bytes()).collect::<Vec<u8>>().into(),
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{} with {} bits", self.width, self.height, self.bits)
    }
}

/// Pixel layouts of `ffmpeg -f rawvideo` that carry one grey channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawFormat {
    /// Size and depth of a frame; more than 8 bits are stored as two bytes, little endian.
    pub format: Format,
}

impl std::str::FromStr for RawFormat {
    type Err = String;
    /// Parses `4096x3072:gray8`, or `gray10le`, `gray12le`, `gray16le`.
    fn from_str(s: &str) -> std::result::Result<RawFormat, String> {
        let help = || format!("'{s}' is not like 4096x3072:gray8 (or gray10le, gray12le, gray16le)");
        let (size, layout) = s.split_once(':').ok_or_else(help)?;
        let (w, h) = size.split_once('x').ok_or_else(help)?;
        let (width, height) = (w.parse::<u32>().map_err(|_| help())?, h.parse::<u32>().map_err(|_| help())?);
        let bits = match layout {
            "gray8" | "gray" => 8,
            "gray10le" => 10,
            "gray12le" => 12,
            "gray16le" => 16,
            _ => return Err(help()),
        };
        if !(1..=65535).contains(&width) || !(1..=65535).contains(&height) {
            return Err(format!("{width}x{height} is outside 1x1..65535x65535"));
        }
        Ok(RawFormat { format: Format { width, height, bits } })
    }
}

/// Raw frames from a reader, in order.
pub struct RawFrames<R: Read> {
    format: Format,
    reader: R,
}

impl<R: Read> RawFrames<R> {
    /// Reads frames of this size and depth from `reader`.
    pub fn new(raw: RawFormat, reader: R) -> RawFrames<R> {
        RawFrames { format: raw.format, reader }
    }

    /// Size and depth of every frame.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Reads one frame: `Ok(None)` at a clean end, an error if the pipe ends inside a frame.
    pub fn read(&mut self) -> Result<Option<Image>> {
        let mut bytes = vec![0u8; self.format.bytes()];
        let mut have = 0;
        while have < bytes.len() {
            match self.reader.read(&mut bytes[have..]) {
                Ok(0) if have == 0 => return Ok(None),
                Ok(0) => {
                    return Err(Fault::input(format!(
                        "the pipe ended after {have} of {} bytes of a frame",
                        bytes.len()
                    ))
                    .cause("another frame size or pixel layout than the one given, or the sender stopped")
                    .next("compare --raw with the sender's size and pixel format"));
                }
                Ok(n) => have += n,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(Fault::input(format!("the pipe failed: {e}")).next("start the sender again")),
            }
        }
        self.format.image(bytes).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_formats_are_read_and_refused() {
        assert_eq!(
            "641x479:gray12le".parse::<RawFormat>().unwrap().format,
            Format { width: 641, height: 479, bits: 12 }
        );
        for wrong in ["641x479", "641:gray8", "0x4:gray8", "4x4:rgb24", "4x70000:gray8"] {
            assert!(wrong.parse::<RawFormat>().is_err(), "{wrong}");
        }
    }
}
