//! Makes grey images with the sensor's depth from picture files, grey or colour.

use super::samples::{Kind, Samples, Says, Values, Wanted, read_samples};
use super::size::MOST_PIXELS;
use super::{Image, Mask, Pixels};
use crate::fault::{Fault, Result};
use std::path::Path;

/// Which part of a colour picture is used as grey. A grey picture ignores it.
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

/// The required depth of pictures, and who requires it.
#[derive(Clone, Copy, Debug)]
pub struct Depth {
    /// 8, or 9..=16 for 16-bit files.
    pub bits: u8,
    /// Who states the depth, with the verb: "the recording declares".
    pub declared: &'static str,
    /// What to do about a picture of another depth.
    pub correct: &'static str,
    /// The largest level of this depth is saturation: a picture that states a smaller sensor is refused.
    pub saturates: bool,
}

impl From<u8> for Depth {
    fn from(bits: u8) -> Depth {
        Depth { bits, declared: "the caller wants", correct: "give pictures of that depth", saturates: false }
    }
}

/// Reads a picture of any size.
pub fn load(path: &Path, channel: Channel, depth: impl Into<Depth>) -> Result<Image> {
    read(path, channel, depth.into(), None)
}

/// Reads a picture whose width and height are known; a picture of another size is refused before it is decoded.
pub fn load_sized(path: &Path, channel: Channel, depth: impl Into<Depth>, size: [u32; 2]) -> Result<Image> {
    read(path, channel, depth.into(), Some(size))
}

fn read(path: &Path, channel: Channel, depth: Depth, size: Option<[u32; 2]>) -> Result<Image> {
    // Four channels of 16 bits, uncompressed, and the headers that cameras write before them.
    let pixels = size.map_or(MOST_PIXELS, |[w, h]| u64::from(w) * u64::from(h));
    let bytes = crate::files::read(path, 8 * pixels + (16 << 20))?;
    let shown = whole(shown(&bytes, channel, depth, size));
    shown.map_err(|e| e.at(path.display()))
}

/// Reads a picture of any size that may be hidden in part; the mask is set where it is hidden.
pub fn load_in_part(path: &Path, channel: Channel, depth: impl Into<Depth>) -> Result<(Image, Option<Mask>)> {
    let bytes = crate::files::read(path, 8 * MOST_PIXELS + (16 << 20))?;
    decode_in_part(&bytes, channel, depth).map_err(|e| e.at(path.display()))
}

/// Decodes a picture held in memory.
pub fn decode(bytes: &[u8], channel: Channel, depth: impl Into<Depth>) -> Result<Image> {
    whole(shown(bytes, channel, depth.into(), None))
}

/// Decodes a picture held in memory that may be hidden in part; the mask is set where it is hidden.
pub fn decode_in_part(bytes: &[u8], channel: Channel, depth: impl Into<Depth>) -> Result<(Image, Option<Mask>)> {
    shown(bytes, channel, depth.into(), None)
}

/// Refuses pictures with hidden pixels: what lies under them is not meant to be seen.
fn whole(shown: Result<(Image, Option<Mask>)>) -> Result<Image> {
    match shown? {
        (image, None) => Ok(image),
        (image, Some(hidden)) => Err(Fault::input(format!(
            "{} of {} pixels are transparent, or named as missing by the file",
            hidden.count(),
            image.pixel_count()
        ))
        .cause("cut out in an editor, or made by a program that marks missing pixels (alpha, tRNS, GDAL_NODATA)")
        .next("save the picture without transparency, or the whole picture as the camera took it")),
    }
}

fn shown(bytes: &[u8], channel: Channel, depth: Depth, size: Option<[u32; 2]>) -> Result<(Image, Option<Mask>)> {
    let samples = read_samples(bytes, &Wanted { size, most: MOST_PIXELS, page: None })?;
    if samples.veiled > 0 {
        return Err(Fault::input(format!("{} pixels are transparent in part", samples.veiled))
            .cause("an editor's soft rim; what such a pixel showed is not known")
            .next("save the picture without transparency"));
    }
    let hidden = hidden(&samples);
    Ok((image(samples, channel, depth)?, hidden))
}

/// Pixels that the file hides, or whose level it declares as missing.
fn hidden(samples: &Samples) -> Option<Mask> {
    let Some(missing) = samples.says.missing else { return samples.hidden.clone() };
    let (width, channels) = (samples.width as usize, samples.channels);
    let there = |x: u32, y: u32| {
        let i = y as usize * width + x as usize;
        let seen = samples.hidden.as_ref().is_none_or(|h| !h.get(x, y));
        seen && !(0..channels).all(|c| samples.kind.same(samples.get(i, c), missing))
    };
    let mask = Mask::from_fn(samples.width, samples.height, |x, y| !there(x, y));
    (mask.count() > 0).then_some(mask)
}

/// The picture of samples that are grey levels. Levels of fewer than 8 bits are stretched to 8, since the largest is
/// saturation; where white is 0 they are inverted.
fn image(samples: Samples, channel: Channel, depth: Depth) -> Result<Image> {
    let Samples { width, height, channels, kind, values, says, .. } = samples;
    let stored = match (kind, &values) {
        (Kind::Unsigned(bits @ 1..=8), Values::U8(_)) | (Kind::Unsigned(bits @ 16), Values::U16(_)) => bits,
        _ => {
            return Err(Fault::input(format!("holds {kind}, which are no levels of light"))
                .cause("a map of heights or a result of computing, not a picture of a camera")
                .next("give the picture as it was taken, with levels of 8 or 16 bits"));
        }
    };
    if (stored == 16) != (depth.bits > 8) {
        let bits = if stored == 16 { 16 } else { 8 };
        return Err(Fault::input(format!("holds {bits} bits a pixel, {} {}", depth.declared, depth.bits))
            .cause("the depth that is stated is another camera's or export's than the picture's")
            .next(depth.correct));
    }
    saturation(&says, depth)?;
    let most = (1u32 << stored) - 1;
    if says.white_is_zero && stored == 16 && depth.bits < 16 {
        return Err(Fault::input(format!(
            "holds levels that are darker the larger they are (PhotometricInterpretation 0, tag 262), {} {} bits",
            depth.declared, depth.bits
        ))
        .cause("which of the 65536 levels is black is not said")
        .next("save the picture with 0 as black"));
    }
    let shade = |v: u16| if says.white_is_zero { most as u16 - v } else { v };
    Ok(match values {
        Values::U8(v) => {
            let plain = stored == 8 && !says.white_is_zero;
            let level = |v: u8| (u32::from(shade(v.into())) * 255 / most) as u8;
            let v = if plain { v } else { v.into_iter().map(level).collect() };
            let grey = |c: &[u8]| mixed([c[0], c[1], c[2]].map(u16::from), channel) as u8;
            Image::from_u8(width, height, if channels == 1 { v } else { v.chunks_exact(channels).map(grey).collect() })
        }
        Values::U16(mut v) => {
            if says.white_is_zero {
                v.iter_mut().for_each(|v| *v = shade(*v));
            }
            let grey = |c: &[u16]| mixed([c[0], c[1], c[2]], channel);
            let v = if channels == 1 { v } else { v.chunks_exact(channels).map(grey).collect() };
            within_depth(Image::from_u16(width, height, depth.bits, v), depth)?
        }
        Values::F32(_) | Values::F64(_) => unreachable!("other kinds were refused"),
    })
}

/// Refuses a picture that states a sensor of fewer bits: its saturated pixels would count as measured.
fn saturation(says: &Says, depth: Depth) -> Result<()> {
    let full = (1u32 << depth.bits) - 1;
    // Other largest levels than those of a sensor are of writers that state the largest level of the picture itself.
    let sensor = |most: &u32| depth.saturates && *most < full && *most != 255 && (most + 1).is_power_of_two();
    let Some(most) = says.most.filter(sensor) else { return Ok(()) };
    Err(Fault::input(format!(
        "states {most} as its largest level (MAXVAL), {} {} bits, whose largest level is {full}",
        depth.declared, depth.bits
    ))
    .cause("the depth that is stated is another sensor's: saturated pixels would not be known as such")
    .next(depth.correct))
}

fn within_depth(image: Image, depth: Depth) -> Result<Image> {
    let Pixels::U16(p) = &image.pixels else { return Ok(image) };
    let largest = p.iter().copied().max().unwrap_or(0);
    if largest > image.full_scale() {
        return Err(Fault::input(format!(
            "holds the grey level {largest}, above the {} of a {}-bit sensor, and {} {}",
            image.full_scale(),
            image.bits,
            depth.declared,
            depth.bits
        ))
        .cause("the depth that is stated is too small, or the file was stretched to 16 bits")
        .next(depth.correct));
    }
    Ok(image)
}

fn mixed([r, g, b]: [u16; 3], channel: Channel) -> u16 {
    match channel {
        Channel::Red => r,
        Channel::Green => g,
        Channel::Blue => b,
        Channel::Luma => ((299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) + 500) / 1000) as u16,
    }
}

/// Writes a grey image as PNG, 8 or 16 bits. It does not wait for the disk: a simulated recording has hundreds of
/// pictures.
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

    #[test]
    fn a_pgm_of_a_smaller_sensor_is_refused_where_saturation_counts() {
        let decoded = |file: &[u8], bits: u8, saturates: bool| {
            decode(file, Channel::Luma, Depth { saturates, ..Depth::from(bits) })
        };
        let ten = b"P5 2 1 1023 \x03\xff\0\x02";
        let fault = decoded(ten, 12, true).unwrap_err();
        assert!(fault.what.contains("states 1023") && fault.what.contains("4095"), "{fault}");
        assert!(decoded(b"P5 2 1 127 \x7f\x02", 8, true).is_err());
        for (file, bits, saturates) in [
            (&ten[..], 10, true),
            (ten, 12, false),
            (b"P5 2 1 200 \xc8\x02", 8, true),
            (b"P5 2 1 65535 \x03\xff\0\x02", 12, true),
            (b"P5 2 1 4095 \x03\xff\0\x02", 10, true),
        ] {
            assert!(decoded(file, bits, saturates).is_ok(), "{bits}");
        }
    }
}
