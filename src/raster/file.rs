//! In: PNG, JPEG, TIFF, BMP and PGM files, grey or colour. Out: grey images with the depth the sensor had.
//! Frame and unit: pixels, grey levels. The only place that names the `image` crate with `image8`.

use super::budget::Budget;
use super::size::{MOST_PIXELS, fits};
use super::{Image, Pixels};
use crate::fault::{Fault, Result};
use image::{DynamicImage, ImageDecoder, ImageReader};
use std::io::Cursor;
use std::path::Path;

/// Which part of a colour picture is taken as grey. A grey picture ignores it.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Channel {
    /// The red samples alone.
    Red,
    /// The green samples alone.
    Green,
    /// The blue samples alone.
    Blue,
    /// (299 R + 587 G + 114 B + 500) / 1000, the luma of ITU-R BT.601.
    #[default]
    Luma,
}

fn unknown(word: &str) -> String {
    crate::fault::unknown::<Channel>("channel", word)
}

/// Memory for pictures while they are decoded, by all threads together, bytes.
static DECODING: Budget = Budget::new(1 << 30);

/// Reads a picture of any size. `bits` is the depth the recording declares: 8, or 9..=16 for 16-bit files.
pub fn load(path: &Path, channel: Channel, bits: u8) -> Result<Image> {
    read(path, channel, bits, None)
}

/// Reads a picture whose width and height are known; of another size none is decoded.
pub fn load_sized(path: &Path, channel: Channel, bits: u8, size: [u32; 2]) -> Result<Image> {
    read(path, channel, bits, Some(size))
}

fn read(path: &Path, channel: Channel, bits: u8, size: Option<[u32; 2]>) -> Result<Image> {
    // Four channels of 16 bits, uncompressed, and what cameras write before them.
    let pixels = size.map_or(MOST_PIXELS, |[w, h]| u64::from(w) * u64::from(h));
    let bytes = crate::files::read(path, 8 * pixels + (16 << 20))?;
    decode_sized(&bytes, channel, bits, size).map_err(|e| e.at(path.display()))
}

/// Decodes a picture held in memory.
pub fn decode(bytes: &[u8], channel: Channel, bits: u8) -> Result<Image> {
    decode_sized(bytes, channel, bits, None)
}

fn decode_sized(bytes: &[u8], channel: Channel, bits: u8, size: Option<[u32; 2]>) -> Result<Image> {
    if bytes.starts_with(b"P5") {
        return within_depth(super::pgm::decode(bytes, bits, size)?);
    }
    let unreadable = |e: &dyn std::fmt::Display| {
        Fault::input(format!("is not a readable picture ({} bytes): {e}", bytes.len()))
            .cause("the file is truncated, empty, or of a format other than PNG, JPEG, TIFF, BMP and PGM")
            .next("record the shot again, or pass --skip-bad to leave it out")
    };
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| unreadable(&e))?;
    // The size is judged here, by its own numbers.
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(|e| unreadable(&e))?;
    let (width, height) = decoder.dimensions();
    fits(width, height, size)?;
    // The picture, a copy of it in grey or RGB of the same depth, and the result.
    let _memory = DECODING.hold(3 * decoder.total_bytes());
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| unreadable(&e))?;
    let deep = matches!(picture.color().bytes_per_pixel() / picture.color().channel_count(), 2..);
    if deep != (bits > 8) {
        return Err(Fault::input(format!(
            "holds {} bits a pixel, the recording declares {bits}",
            if deep { 16 } else { 8 }
        ))
        .cause("meta.json and the pictures are from different cameras or exports")
        .next("correct image.bits in meta.json"));
    }
    if picture.color().has_color() {
        return Ok(from_colour(&picture, channel, bits, width, height));
    }
    if !deep {
        return Ok(Image::from_u8(width, height, picture.into_luma8().into_raw()));
    }
    within_depth(Image::from_u16(width, height, bits, picture.into_luma16().into_raw()))
}

fn within_depth(image: Image) -> Result<Image> {
    let Pixels::U16(p) = &image.pixels else { return Ok(image) };
    let largest = p.iter().copied().max().unwrap_or(0);
    if largest > image.full_scale() {
        return Err(Fault::input(format!(
            "holds the grey level {largest}, above the {} of a {}-bit sensor",
            image.full_scale(),
            image.bits
        ))
        .cause("image.bits in meta.json is too small, or the file was stretched to 16 bits")
        .next("set image.bits to the depth that the files really have"));
    }
    Ok(image)
}

fn from_colour(picture: &image::DynamicImage, channel: Channel, bits: u8, width: u32, height: u32) -> Image {
    let grey = |c: &[u16]| -> u16 {
        match channel {
            Channel::Red => c[0],
            Channel::Green => c[1],
            Channel::Blue => c[2],
            Channel::Luma => {
                ((299 * u32::from(c[0]) + 587 * u32::from(c[1]) + 114 * u32::from(c[2]) + 500) / 1000) as u16
            }
        }
    };
    if bits > 8 {
        let rgb = picture.to_rgb16();
        return Image::from_u16(width, height, bits, rgb.pixels().map(|p| grey(&p.0)).collect());
    }
    let rgb = picture.to_rgb8();
    Image::from_u8(width, height, rgb.pixels().map(|p| grey(&p.0.map(u16::from)) as u8).collect())
}

/// Writes a grey image as PNG, 8 or 16 bits. Not waited for: recordings are simulated by hundreds of pictures.
pub fn save_png(image: &Image, path: &Path) -> Result<()> {
    crate::files::write_unsynced(path, &png(image))
}

/// The bytes of a grey image as PNG, 8 or 16 bits.
pub fn png(image: &Image) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let (bytes, colour): (&[u8], _) = match &image.pixels {
        Pixels::U8(p) => (p, image::ExtendedColorType::L8),
        Pixels::U16(p) => (bytemuck::cast_slice(p), image::ExtendedColorType::L16),
    };
    image::write_buffer_with_format(&mut out, bytes, image.width, image.height, colour, image::ImageFormat::Png)
        .expect("memory takes every picture");
    out.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn depth_round_trips_and_lies_are_caught() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let deep = Image::from_u16(3, 2, 12, vec![0, 1, 4095, 7, 300, 2048]);
        save_png(&deep, &path).unwrap();
        let load = |bits| load_sized(&path, Channel::Luma, bits, [3, 2]);
        assert_eq!(load(12).unwrap(), deep);
        assert!(load(10).unwrap_err().what.contains("4095"));
        assert!(load(8).unwrap_err().what.contains("16 bits"));
        assert!(load_sized(&path, Channel::Luma, 12, [2, 3]).unwrap_err().what.contains("is 3x2"));
        std::fs::write(&path, &std::fs::read(&path).unwrap()[..40]).unwrap();
        assert!(load(12).is_err());
    }
}
