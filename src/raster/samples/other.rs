//! Reads JPEG, BMP and the rarer kinds of PNM through the `image` crate.

use super::kind::{Kind, Values};
use super::picture::{DECODING, Samples, Wanted, unreadable};
use super::png::{exif_orientation, palette_note};
use super::says::Says;
use super::turn::Orientation;
use super::xmp::chosen;
use crate::fault::{Fault, Result};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::io::Cursor;

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
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| strange(&e))?;
    let says = Says {
        lossy: format == Some(ImageFormat::Jpeg),
        two_levels: bytes.starts_with(b"P1") || bytes.starts_with(b"P4"),
        notes: note.into_iter().chain(palette_of_bmp(bytes)).collect(),
        ..Says::default()
    };
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
        _ => return Err(strange(&"a kind of samples that is not read")),
    };
    let samples = Samples { width, height, channels, kind, values, hidden: None, veiled: 0, says };
    let opaque = kind.most().unwrap_or(1.0);
    let samples = if channels % 2 == 0 { samples.parted(opaque) } else { samples };
    Ok(samples.upright(orientation))
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
