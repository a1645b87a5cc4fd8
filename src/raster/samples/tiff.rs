//! Reads TIFF and BigTIFF: one page, every kind of number, samples as they are written.

use super::kind::{Kind, Values};
use super::picture::{DECODING, Samples, Wanted};
use super::png::{palette_note, unpacked};
use super::tiff_pages::{Pages, Place, pages};
use super::tiff_tags::{Shades, Tags, tags};
use super::turn::Orientation;
use crate::fault::{Fault, Result};
use std::borrow::Cow;
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{ByteOrder, Tag};

/// Whether a file starts like a TIFF or BigTIFF of either byte order.
pub(super) fn begins(bytes: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|mark| bytes.starts_with(*mark))
}

fn strange(e: &dyn std::fmt::Display) -> Fault {
    Fault::input(format!("is not a TIFF that can be read: {e}"))
        .cause("a damaged or truncated file, or a kind or compression of TIFF that is not read here")
        .next("save it as a TIFF without compression, or with LZW or deflate")
}

/// A copy of a file whose list of pages begins at another directory.
fn beginning_at(bytes: &[u8], directory: u64) -> Vec<u8> {
    let mut copy = bytes.to_vec();
    let big_endian = bytes.starts_with(b"MM");
    // BigTIFF: 64-bit offsets.
    let (at, length) = if bytes.get(2..4).is_some_and(|v| v.contains(&43)) { (8, 8) } else { (4, 4) };
    let mut number = directory.to_be_bytes()[8 - length..].to_vec();
    if !big_endian {
        number.reverse();
    }
    if let Some(place) = copy.get_mut(at..at + length) {
        place.copy_from_slice(&number);
    }
    copy
}

fn open(bytes: &[u8], page: usize) -> Result<Decoder<Cursor<&[u8]>>> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(|e| mosaic(bytes).unwrap_or_else(|| strange(&e)))?;
    if page > 0 {
        decoder.seek_to_image(page).map_err(|e| strange(&e))?;
    }
    Ok(decoder)
}

/// The error for colours that the `tiff` crate does not know: a sensor's raw data.
fn mosaic(bytes: &[u8]) -> Option<Fault> {
    let big_endian = bytes.starts_with(b"MM");
    let take = |at: usize, length: usize| -> Option<u64> {
        let b = bytes.get(at..at + length)?;
        let add = |n: u64, v: &u8| n << 8 | u64::from(*v);
        Some(if big_endian { b.iter().fold(0, add) } else { b.iter().rev().fold(0, add) })
    };
    let first = if take(2, 2)? == 43 { take(8, 8)? } else { take(4, 4)? };
    let place = value_of_tag(bytes, usize::try_from(first).ok()?, big_endian)?;
    let name = match take(*place.first()?, 2)? {
        32_803 => "32803, a raw mosaic of colour filters",
        34_892 => "34892, raw colours of a sensor (LinearRaw)",
        32_844 | 32_845 => "32844 or 32845, logarithms of light (LogLuv)",
        _ => return None,
    };
    Some(
        Fault::input(format!("has colours of kind {name} (PhotometricInterpretation, tag 262)"))
            .cause("a camera's raw data, whose neighbouring pixels need not have the same colour")
            .next("develop it with the camera's program, and save it as grey or as red, green and blue"),
    )
}

pub(super) fn read(bytes: &[u8], wanted: &Wanted) -> Result<Samples> {
    let pages = pages(&mut open(bytes, 0)?)?;
    let chosen = pages.chosen(wanted.page)?;
    let (mut samples, turned) = page(bytes, chosen, wanted, Orientation::UPRIGHT)?;
    samples.says.notes.extend(pages.note(chosen));
    whole_film(&samples, &pages, wanted)?;
    if let Some(mask) = pages.mask(chosen)? {
        let size = Some([samples.width, samples.height]);
        let (mask, _) = page(bytes, mask, &Wanted { size, ..*wanted }, turned)?;
        samples.hide(|i| f64::from(mask.get(i, 0) != 0.0));
    }
    Ok(samples)
}

/// Refuses a film whose other pictures are in no list of pages, unless the first is asked for.
fn whole_film(samples: &Samples, pages: &Pages, wanted: &Wanted) -> Result<()> {
    match samples.says.pictures {
        Some(said) if said > pages.pictures() && wanted.page.is_none() => Err(Fault::input(format!(
            "says that it holds {said} pictures, and lists {} (ImageJ, tag 270)",
            pages.pictures()
        ))
        .cause("a stack of ImageJ; which of its pictures is meant is not said")
        .next("save that picture as a separate file; import-map takes --page 1 for the first")),
        _ => Ok(()),
    }
}

/// One page, upright, and how it was turned. A page that states no orientation has the one of its picture, `above`.
fn page(bytes: &[u8], place: Place, wanted: &Wanted, above: Orientation) -> Result<(Samples, Orientation)> {
    let copy = place.listed.is_none().then(|| beginning_at(bytes, place.at));
    let bytes = copy.as_deref().unwrap_or(bytes);
    let index = place.listed.unwrap_or(0);
    let mut decoder = open(bytes, index)?;
    let (width, height) = decoder.dimensions().map_err(|e| strange(&e))?;
    let tags = tags(&mut decoder)?;
    let orientation = tags.orientation.unwrap_or(above);
    wanted.fits(orientation.number, [width, height])?;
    let plain = as_black_is_zero(bytes, &mut decoder, &tags)?;
    let mut decoder = match &plain {
        Cow::Borrowed(_) => decoder,
        Cow::Owned(plain) => open(plain, index)?,
    };
    let row = (u64::from(width) * tags.samples as u64 * u64::from(tags.bits)).div_ceil(8);
    let whole = row * u64::from(height);
    let _memory = DECODING.hold(3 * whole);
    let mut limits = Limits::default();
    limits.decoding_buffer_size = usize::try_from(whole).map_err(|e| strange(&e))?;
    decoder = decoder.with_limits(limits);
    let mut result = DecodingResult::U8(vec![]);
    let layout = decoder.read_image_to_buffer(&mut result).map_err(|e| strange(&e))?;
    let pixels = width as usize * height as usize;
    let mut values = values(result, tags.bits, width as usize * tags.samples);
    if values.len() != pixels * tags.samples {
        return Err(strange(&format!("{} samples for {width}x{height} pixels of {}", values.len(), tags.samples)));
    }
    if layout.planes > 1 {
        // PlanarConfiguration 2: all red, then all green, ...
        let n = tags.samples;
        values = values.picked((0..pixels * n).map(|k| (k % n) * pixels + k / n));
    }
    let Tags { kind, samples: channels, says, .. } = tags;
    let samples = Samples { width, height, channels, kind, values, hidden: None, veiled: 0, says };
    let samples = match tags.shades {
        Shades::Palette => coloured(samples, &tags.palette),
        _ if tags.alpha => samples.parted(kind.most().unwrap_or(1.0)),
        _ => samples,
    };
    Ok((samples.upright(orientation), orientation))
}

/// The `tiff` crate inverts the samples of a picture whose white is 0, and reads no palettes or masks. It gets a copy
/// of the file that states "black is 0", and then returns the samples as written.
fn as_black_is_zero<'a>(bytes: &'a [u8], file: &mut Decoder<Cursor<&'a [u8]>>, tags: &Tags) -> Result<Cow<'a, [u8]>> {
    if tags.shades == Shades::Rgb || (tags.shades == Shades::Grey && !tags.says.white_is_zero) {
        return Ok(Cow::Borrowed(bytes));
    }
    let big_endian = file.byte_order() == ByteOrder::BigEndian;
    let at = file.ifd_pointer().and_then(|p| usize::try_from(p.0).ok());
    let places = at
        .and_then(|at| value_of_tag(bytes, at, big_endian))
        .ok_or_else(|| strange(&"its PhotometricInterpretation (tag 262) is not a number of 16 bits"))?;
    let mut copy = bytes.to_vec();
    for at in places {
        copy[at..at + 2].copy_from_slice(&if big_endian { 1u16.to_be_bytes() } else { 1u16.to_le_bytes() });
    }
    Ok(Cow::Owned(copy))
}

/// Positions of the 16-bit values of PhotometricInterpretation in a directory of tags.
fn value_of_tag(bytes: &[u8], directory: usize, big_endian: bool) -> Option<Vec<usize>> {
    let number = |at: usize, length: usize| -> Option<u64> {
        let b = bytes.get(at..at.checked_add(length)?)?;
        let take = |n: u64, v: &u8| n << 8 | u64::from(*v);
        Some(if big_endian { b.iter().fold(0, take) } else { b.iter().rev().fold(0, take) })
    };
    // BigTIFF: 64-bit counts and offsets.
    let (count, entry, value) = if number(2, 2)? == 43 { (8, 20, 12) } else { (2, 12, 8) };
    let entries = usize::try_from(number(directory, count)?).ok()?;
    let start = directory.checked_add(count)?;
    let mut places = vec![];
    for k in 0..entries.min(bytes.len() / entry) {
        let at = start + k * entry;
        if number(at, 2)? == u64::from(Tag::PhotometricInterpretation.to_u16()) && number(at + 2, 2)? == 3 {
            number(at + value, 2)?;
            places.push(at + value);
        }
    }
    (!places.is_empty()).then_some(places)
}

/// The samples of a decoded page; samples of fewer than 8 bits are packed, each row in whole bytes.
fn values(result: DecodingResult, bits: u8, in_row: usize) -> Values {
    fn wide<T: Copy>(v: Vec<T>, number: impl Fn(T) -> f64) -> Values {
        Values::F64(v.into_iter().map(number).collect())
    }
    match result {
        DecodingResult::U8(v) if bits < 8 => Values::U8(unpacked(&v, bits, in_row)),
        DecodingResult::U8(v) => Values::U8(v),
        DecodingResult::U16(v) => Values::U16(v),
        DecodingResult::F16(v) => Values::F32(v.into_iter().map(|h| h.to_f32()).collect()),
        DecodingResult::F32(v) => Values::F32(v),
        DecodingResult::F64(v) => Values::F64(v),
        DecodingResult::U32(v) => wide(v, f64::from),
        DecodingResult::I8(v) => wide(v, f64::from),
        DecodingResult::I16(v) => wide(v, f64::from),
        DecodingResult::I32(v) => wide(v, f64::from),
        DecodingResult::U64(v) => wide(v, |n| n as f64),
        DecodingResult::I64(v) => wide(v, |n| n as f64),
    }
}

/// Replaces a palette's numbers by the colours; a palette of greys gives a grey picture.
fn coloured(mut samples: Samples, palette: &[u16]) -> Samples {
    let colours = palette.len() / 3;
    // 16 bits by the standard; some writers use 8.
    let shift = if palette.iter().any(|v| *v > 255) { 8 } else { 0 };
    let colour = |n: usize| [0, 1, 2].map(|c| (palette[c * colours + n] >> shift) as u8);
    let numbers: Vec<usize> = (0..samples.pixel_count()).map(|i| samples.get(i, 0) as usize).collect();
    samples.channels = if numbers.iter().all(|n| colour(*n) == [colour(*n)[0]; 3]) { 1 } else { 3 };
    let channels = samples.channels;
    if numbers.iter().any(|n| colour(*n).map(usize::from) != [*n; 3]) {
        samples.says.notes.push(palette_note("ColorMap, tag 320"));
    }
    samples.values = Values::U8(numbers.iter().flat_map(|n| colour(*n).into_iter().take(channels)).collect());
    samples.kind = Kind::Unsigned(8);
    samples
}
