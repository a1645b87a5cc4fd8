//! Reads BMP and the rarer kinds of PNM through the `image` crate, and JPEG as strictly as its decoder can.

use super::kind::{Kind, Values};
use super::picture::{DECODING, Samples, Wanted, unreadable};
use super::png::{exif_orientation, palette_note};
use super::says::Says;
use super::turn::Orientation;
use super::xmp::chosen;
use crate::fault::{Fault, Result};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::Cursor;
use zune_jpeg::JpegDecoder;
use zune_jpeg::errors::DecodeErrors;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

pub(super) fn read(bytes: &[u8], wanted: &Wanted) -> Result<Samples> {
    let strange = |e: &dyn std::fmt::Display| unreadable(bytes, e);
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| strange(&e))?;
    let format = reader.format();
    // The size is checked here, against the limits of this program.
    reader.no_limits();
    let mut decoder = reader.into_decoder().map_err(|e| strange(&e))?;
    let (width, height) = decoder.dimensions();
    let exif = decoder.exif_metadata().ok().flatten().and_then(|exif| exif_orientation(&exif));
    let xmp = decoder.xmp_metadata().ok().flatten();
    let (orientation, note) = chosen(exif.map(Orientation::exif), xmp.as_deref())?;
    let orientation = orientation.unwrap_or(Orientation::UPRIGHT);
    wanted.fits(orientation.number, [width, height])?;
    stretched(bytes)?;
    // The picture, and its samples without alpha, are in memory together.
    let _memory = DECODING.hold(3 * decoder.total_bytes());
    let says = Says {
        lossy: format == Some(ImageFormat::Jpeg),
        two_levels: bytes.starts_with(b"P1") || bytes.starts_with(b"P4"),
        notes: note.into_iter().chain(palette_of_bmp(bytes)).collect(),
        ..Says::default()
    };
    let (channels, kind, values) =
        if says.lossy { of_jpeg(bytes)? } else { decoded(DynamicImage::from_decoder(decoder), bytes)? };
    let samples = Samples { width, height, channels, kind, values, hidden: None, veiled: 0, says };
    let opaque = kind.most().unwrap_or(1.0);
    let samples = if channels % 2 == 0 { samples.parted(opaque) } else { samples };
    Ok(samples.upright(orientation))
}

/// Number of channels, and the samples.
fn decoded(picture: image::ImageResult<DynamicImage>, bytes: &[u8]) -> Result<(usize, Kind, Values)> {
    let picture = picture.map_err(|e| unreadable(bytes, &e))?;
    let channels = usize::from(picture.color().channel_count());
    let (kind, values) = match picture {
        DynamicImage::ImageLuma8(p) => (Kind::Unsigned(8), Values::U8(p.into_raw())),
        DynamicImage::ImageLumaA8(p) => (Kind::Unsigned(8), Values::U8(p.into_raw())),
        DynamicImage::ImageRgb8(p) => (Kind::Unsigned(8), Values::U8(p.into_raw())),
        DynamicImage::ImageRgba8(p) => (Kind::Unsigned(8), Values::U8(p.into_raw())),
        DynamicImage::ImageLuma16(p) => (Kind::Unsigned(16), Values::U16(p.into_raw())),
        DynamicImage::ImageLumaA16(p) => (Kind::Unsigned(16), Values::U16(p.into_raw())),
        DynamicImage::ImageRgb16(p) => (Kind::Unsigned(16), Values::U16(p.into_raw())),
        DynamicImage::ImageRgba16(p) => (Kind::Unsigned(16), Values::U16(p.into_raw())),
        _ => return Err(unreadable(bytes, &"a kind of samples that is not read")),
    };
    Ok((channels, kind, values))
}

/// Number of channels, 1 or 3, and the levels of a JPEG; one that ends too early or is damaged is refused. Decoders
/// made for viewers fill the missing part with grey, whose border a scan would take for a stripe.
fn of_jpeg(bytes: &[u8]) -> Result<(usize, Kind, Values)> {
    if !is_whole(bytes) {
        return Err(damaged("the file ends before its picture does"));
    }
    let options = DecoderOptions::default().set_max_width(usize::MAX).set_max_height(usize::MAX);
    let levels = match jpeg_levels(bytes, options.set_strict_mode(true)) {
        // Cameras pad their headers; the levels are whole.
        Err(DecodeErrors::FormatStatic(why)) if why.contains("between headers") => jpeg_levels(bytes, options),
        levels => levels,
    };
    let (channels, levels) = levels.map_err(|e| damaged(&format!("{e:?}")))?;
    Ok((channels, Kind::Unsigned(8), Values::U8(levels)))
}

fn jpeg_levels(bytes: &[u8], options: DecoderOptions) -> std::result::Result<(usize, Vec<u8>), DecodeErrors> {
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers()?;
    let grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let (channels, space) = if grey { (1, ColorSpace::Luma) } else { (3, ColorSpace::RGB) };
    decoder.set_options(options.jpeg_set_out_colorspace(space));
    Ok((channels, decoder.decode()?))
}

fn damaged(why: &str) -> Fault {
    Fault::input(format!("is a damaged JPEG: {why}"))
        .cause("it was copied in part, or changed on the way")
        .next("copy the file again; a part of a picture cannot be measured")
}

/// Whether the marker that ends the picture follows its data (ITU-T T.81, B.1.1).
fn is_whole(bytes: &[u8]) -> bool {
    const FILL: u8 = 0xff;
    let mut at = 2;
    let mut data = false;
    loop {
        let Some(start) = bytes.get(at..).and_then(|rest| rest.iter().position(|b| *b == FILL)) else { return false };
        at += start;
        let Some(code) = bytes[at..].iter().position(|b| *b != FILL) else { return false };
        at += code + 1;
        match bytes[at - 1] {
            // The end; a byte 255 of the data; a restart; these have no length.
            0xd9 => return data,
            0 | 1 | 0xd0..=0xd7 => {}
            marker => {
                let Some(&[high, low]) = bytes.get(at..at + 2) else { return false };
                at += usize::from(u16::from_be_bytes([high, low]));
                data |= marker == 0xda;
            }
        }
    }
}

/// A note on a BMP whose palette replaces the numbers that are stored; a palette that leaves them needs none.
fn palette_of_bmp(bytes: &[u8]) -> Option<String> {
    let number = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let header = number(14).filter(|_| bytes.starts_with(b"BM"))?;
    // The first kind of header (OS/2) has shorter fields, and colours of three bytes.
    let (depth_at, each) = if header == 12 { (24, 3) } else { (28, 4) };
    let depth = u32::from(u16::from_le_bytes(bytes.get(depth_at..depth_at + 2)?.try_into().ok()?));
    let all = 1usize.checked_shl(depth).filter(|_| (1..=8).contains(&depth))?;
    let named = if header == 12 { 0 } else { number(46)? as usize };
    let colours = if named == 0 { all } else { named.min(all) };
    let start = 14 + usize::try_from(header).ok()?;
    let palette = bytes.get(start..start + colours * each)?;
    let same = palette.chunks_exact(each).enumerate().all(|(n, c)| c[..3].iter().all(|v| usize::from(*v) == n));
    (!same).then(|| palette_note("the colour table of the BMP"))
}

/// The `image` crate stretches a PNM whose largest level is neither 255 nor 65535.
fn stretched(bytes: &[u8]) -> Result<()> {
    let head = String::from_utf8_lossy(&bytes[..bytes.len().min(1024)]).into_owned();
    let plain = head.lines().map(|l| l.split('#').next().unwrap_or("")).collect::<Vec<_>>().join(" ");
    let mut words = plain.split_ascii_whitespace();
    let most = match words.next() {
        Some("P3" | "P6") => words.nth(2),
        Some("P7") => words.skip_while(|w| *w != "MAXVAL").nth(1),
        _ => None,
    };
    match most.and_then(|w| w.parse::<u32>().ok()) {
        Some(most) if ![1, 255, 65_535].contains(&most) => {
            Err(Fault::input(format!("has {most} as its largest level (MAXVAL); allowed: 255 or 65535"))
                .cause("colour pictures of other depths would be stretched")
                .next("save it as PGM or as PNG"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;
    use image::{ExtendedColorType, RgbImage};

    fn photograph() -> Vec<u8> {
        let picture = RgbImage::from_fn(97, 61, |x, y| image::Rgb([(x * 2) as u8, (y * 3) as u8, (x * y % 251) as u8]));
        let mut out = Vec::new();
        JpegEncoder::new_with_quality(&mut out, 90).encode(&picture, 97, 61, ExtendedColorType::Rgb8).unwrap();
        out
    }

    #[test]
    fn a_jpeg_that_was_cut_off_or_damaged_is_refused() {
        let whole = photograph();
        let (channels, _, values) = of_jpeg(&whole).unwrap();
        let same = image::load_from_memory(&whole).unwrap().into_rgb8().into_raw();
        assert!(channels == 3 && matches!(values, Values::U8(levels) if levels == same));
        for share in [0.3, 0.6, 0.95, 0.999] {
            let cut = &whole[..(share * whole.len() as f64) as usize];
            assert!(of_jpeg(cut).unwrap_err().what.contains("ends before"), "{share}");
        }
        // Bytes behind the end, such as another picture, change nothing.
        assert!(of_jpeg(&[&whole[..], b"more"].concat()).is_ok());
        let mut damaged = whole.clone();
        let middle = damaged.len() / 2;
        damaged[middle..middle + 200].fill(0xff);
        assert!(of_jpeg(&damaged).is_err(), "data that no encoder writes");
    }
}
