//! Reads JPEG, BMP and the rarer kinds of PNM through the `image` crate.

use super::kind::{Kind, Values};
use super::picture::{DECODING, Samples, Wanted, unreadable};
use super::says::Says;
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
    let orientation = decoder.orientation().map_or(1, |o| u16::from(o.to_exif()));
    wanted.fits(orientation, [width, height])?;
    stretched(bytes)?;
    // The picture, and its samples without alpha, are in memory together.
    let _memory = DECODING.hold(3 * decoder.total_bytes());
    let picture = DynamicImage::from_decoder(decoder).map_err(|e| strange(&e))?;
    let says = Says {
        lossy: format == Some(ImageFormat::Jpeg),
        two_levels: bytes.starts_with(b"P1") || bytes.starts_with(b"P4"),
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
