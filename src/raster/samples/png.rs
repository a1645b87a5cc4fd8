//! Reads PNG: levels of 1, 2 and 4 bits as written, palettes, transparency and the orientation of an eXIf chunk.

use super::kind::{Kind, Values};
use super::picture::{DECODING, Samples, Wanted, unreadable};
use super::says::Says;
use super::turn::Orientation;
use super::xmp::{chosen, in_raw_profile};
use crate::fault::{Fault, Result};
use png::{BitDepth, ColorType, Info};
use std::io::Cursor;

pub(super) const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

pub(super) fn read(bytes: &[u8], wanted: &Wanted) -> Result<Samples> {
    let strange = |e: png::DecodingError| unreadable(bytes, &e);
    // The size is checked here, against the limits of this program.
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: usize::MAX });
    decoder.set_transformations(png::Transformations::IDENTITY);
    decoder.set_ignore_iccp_chunk(true);
    let [width, height] = <[u32; 2]>::from(decoder.read_header_info().map_err(strange)?.size());
    // An orientation later in the file may swap columns and rows; any other size is refused before anything is decoded.
    let swapped = wanted.size == Some([height, width]);
    wanted.fits(if swapped { 6 } else { 1 }, [width, height])?;
    let mut reader = decoder.read_info().map_err(strange)?;
    let buffer = reader.output_buffer_size().ok_or_else(|| unreadable(bytes, &"too large for this machine"))?;
    let _memory = DECODING.hold(3 * buffer as u64);
    // Decoded in place: levels of 16 bits need no copy.
    let values = if reader.info().bit_depth == BitDepth::Sixteen {
        let mut levels = vec![0u16; buffer / 2];
        reader.next_frame(bytemuck::cast_slice_mut(&mut levels)).map_err(strange)?;
        levels.iter_mut().for_each(|v| *v = u16::from_be(*v));
        Values::U16(levels)
    } else {
        let mut levels = vec![0u8; buffer];
        reader.next_frame(&mut levels).map_err(strange)?;
        Values::U8(levels)
    };
    // An eXIf chunk may follow the pixels; a file that ends before its end mark is complete enough.
    let _ = reader.finish();
    let info = reader.info();
    let (orientation, note) = orientation(info)?;
    wanted.fits(orientation.number, [width, height])?;
    single(info)?;
    let mut samples = samples(info, values)?.upright(orientation);
    samples.says.notes.extend(note);
    Ok(samples)
}

/// Refuses animations: their other pictures would be ignored.
fn single(info: &Info) -> Result<()> {
    match info.animation_control {
        Some(control) if control.num_frames > 1 => {
            Err(Fault::input(format!("is an animation of {} pictures (acTL)", control.num_frames))
                .cause("one picture is needed, and it is not stated which")
                .next("save that picture as a separate PNG"))
        }
        _ => Ok(()),
    }
}

/// The orientation of Exif, else of ImageMagick's copy of it, else of XMP; and a note if XMP contradicts.
fn orientation(info: &Info) -> Result<(Orientation, Option<String>)> {
    let number = |exif: &[u8]| {
        let exif = exif.strip_prefix(b"Exif\0\0").unwrap_or(exif);
        exif_orientation(exif)
    };
    let exif = info.exif_metadata.as_deref().and_then(number).map(Orientation::exif);
    let raw = || {
        let profile = ["Raw profile type exif", "Raw profile type APP1"].iter().find_map(|name| text_of(info, name));
        let number = number(&in_raw_profile(&profile?)?)?;
        Some(Orientation { number, by: "Raw profile type exif, tag 274" })
    };
    let profile = || text_of(info, "Raw profile type xmp").and_then(|text| in_raw_profile(&text));
    let xmp = text_of(info, "XML:com.adobe.xmp").map(String::into_bytes).or_else(profile);
    let (orientation, note) = chosen(exif.or_else(raw), xmp.as_deref())?;
    Ok((orientation.unwrap_or(Orientation::UPRIGHT), note))
}

/// The number of an orientation in Exif, which is a TIFF of one directory.
pub(super) fn exif_orientation(exif: &[u8]) -> Option<u16> {
    image::metadata::Orientation::from_exif_chunk(exif).map(|o| u16::from(o.to_exif()))
}

/// Largest text of a chunk that is unpacked, bytes.
const MOST_TEXT: usize = 1 << 20;

/// The text of the chunk with this keyword, in any of the three kinds of text chunks.
fn text_of(info: &Info, keyword: &str) -> Option<String> {
    let plain = info.uncompressed_latin1_text.iter().find(|t| t.keyword == keyword).map(|t| t.text.clone());
    let packed = || {
        let mut text = info.compressed_latin1_text.iter().find(|t| t.keyword == keyword)?.clone();
        text.decompress_text_with_limit(MOST_TEXT).ok()?;
        text.get_text().ok()
    };
    let wide = || {
        let mut text = info.utf8_text.iter().find(|t| t.keyword == keyword)?.clone();
        text.decompress_text_with_limit(MOST_TEXT).ok()?;
        text.get_text().ok()
    };
    plain.or_else(packed).or_else(wide)
}

fn samples(info: &Info, stored: Values) -> Result<Samples> {
    let (width, height) = info.size();
    let bits = info.bit_depth as u8;
    let in_file = info.color_type.samples();
    let values = match stored {
        Values::U8(packed) if bits < 8 => Values::U8(unpacked(&packed, bits, width as usize * in_file)),
        stored => stored,
    };
    let mut notes = Vec::new();
    if let Some(s) = info.sbit.as_ref().and_then(|s| s.iter().max()).filter(|s| **s < bits) {
        notes.push(format!(
            "the file says that {s} of its {bits} bits count (sBIT); levels are taken as they are written"
        ));
    }
    let says = Says { notes, ..Says::default() };
    let kind = Kind::Unsigned(bits);
    let mut samples = Samples { width, height, channels: in_file, kind, values, hidden: None, veiled: 0, says };
    if info.color_type == ColorType::Indexed {
        return coloured(samples, info);
    }
    let opaque = kind.most().unwrap_or(1.0);
    if matches!(info.color_type, ColorType::GrayscaleAlpha | ColorType::Rgba) {
        return Ok(samples.parted(opaque));
    }
    if let Some(clear) = &info.trns {
        // The `png` crate stores one byte for each level of up to 8 bits.
        let level = |b: &[u8]| f64::from(b.iter().fold(0u16, |v, b| v << 8 | u16::from(*b)));
        let clear: Vec<f64> = clear.chunks_exact(if bits == 16 { 2 } else { 1 }).map(level).collect();
        let there: Vec<f64> = (0..samples.pixel_count())
            .map(|i| f64::from(!clear.iter().enumerate().all(|(c, v)| samples.get(i, c) == *v)))
            .collect();
        samples.hide(|i| there[i]);
    }
    Ok(samples)
}

/// Replaces a palette's numbers by the colours; a palette of greys gives a grey picture.
fn coloured(mut samples: Samples, info: &Info) -> Result<Samples> {
    let palette = info.palette.as_deref().unwrap_or_default();
    let Values::U8(numbers) = samples.values.clone() else { return Ok(samples) };
    let most = usize::from(numbers.iter().copied().max().unwrap_or(0));
    if 3 * most + 2 >= palette.len() {
        return Err(Fault::input(format!("names colour {most} of a palette of {}", palette.len() / 3))
            .cause("a damaged file")
            .next("write the picture again"));
    }
    let colour = |n: &u8| -> [u8; 3] { [0, 1, 2].map(|c| palette[3 * usize::from(*n) + c]) };
    let grey = numbers.iter().all(|n| colour(n) == [colour(n)[0]; 3]);
    let alpha = |n: u8| info.trns.as_ref().and_then(|t| t.get(usize::from(n))).map_or(1.0, |a| f64::from(*a) / 255.0);
    let there: Vec<f64> = numbers.iter().map(|n| alpha(*n)).collect();
    let channels = if grey { 1 } else { 3 };
    if numbers.iter().any(|n| colour(n) != [*n; 3]) {
        samples.says.notes.push(palette_note("PLTE"));
    }
    let values = Values::U8(numbers.iter().flat_map(|n| colour(n).into_iter().take(channels)).collect());
    (samples.values, samples.channels, samples.kind) = (values, channels, Kind::Unsigned(8));
    if info.trns.is_some() {
        samples.hide(|i| there[i]);
    }
    Ok(samples)
}

/// A note on levels that are not the numbers in the file; `by` names what replaced them.
pub(super) fn palette_note(by: &str) -> String {
    format!("the levels are the shades of the file's palette, in 8 bits, not the numbers that are stored ({by})")
}

/// Unpacks samples of 1, 2 or 4 bits; the first is in the highest bits, and each row fills whole bytes.
pub(super) fn unpacked(raw: &[u8], bits: u8, in_row: usize) -> Vec<u8> {
    let bits = usize::from(bits);
    let stride = (in_row * bits).div_ceil(8);
    let sample = |row: &[u8], k: usize| {
        let shift = 8 - bits - (k * bits) % 8;
        (row[k * bits / 8] >> shift) & ((1u16 << bits) - 1) as u8
    };
    raw.chunks_exact(stride).flat_map(|row| (0..in_row).map(move |k| sample(row, k))).collect()
}
