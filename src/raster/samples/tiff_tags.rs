//! Reads what a page of a TIFF states about its samples, and refuses by name what no reader here supports.

use super::kind::Kind;
use super::says::Says;
use super::tiff_land;
use super::tiff_said::{Gdal, imagej_value, scale_of_imagej, spacing_of_imagej, spacing_of_ome, unit_of_imagej};
use super::turn::Orientation;
use super::xmp::chosen;
use crate::fault::{Fault, Result};
use std::io::Cursor;
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

/// Largest text of a tag that is read, bytes.
const MOST_TEXT: usize = 64 << 10;
/// Scale, offset and more of a band, as XML.
const GDAL_METADATA: Tag = Tag::Unknown(42_112);
/// XMP, as XML.
const XMP: Tag = Tag::Unknown(700);
/// Keys of a map of the land, 16-bit numbers.
const GEO_KEYS: Tag = Tag::Unknown(34_735);

/// How the numbers of a page represent shades or colours (tag 262).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shades {
    Grey,
    Rgb,
    Palette,
    Mask,
}

#[derive(Debug)]
pub(super) struct Tags {
    pub shades: Shades,
    pub kind: Kind,
    /// Bits of a sample.
    pub bits: u8,
    /// Samples of a pixel, alpha included.
    pub samples: usize,
    pub alpha: bool,
    /// `None` if the page states none.
    pub orientation: Option<Orientation>,
    /// All reds of a palette, then all greens, then all blues, 16 bits.
    pub palette: Vec<u16>,
    pub says: Says,
}

fn refused(what: String) -> Fault {
    Fault::input(what)
        .cause("a kind of TIFF that is not read here")
        .next("save it as a TIFF of one grey sample a pixel: whole numbers of 8, 16 or 32 bits, or floating point")
}

type File<'a> = Decoder<Cursor<&'a [u8]>>;

fn number(file: &mut File, tag: Tag, otherwise: u16) -> Result<u16> {
    let found = file.find_tag_unsigned::<u16>(tag);
    found
        .map(|n| n.unwrap_or(otherwise))
        .map_err(|e| refused(format!("has a tag {} that is not a number: {e}", tag.to_u16())))
}

fn numbers(file: &mut File, tag: Tag) -> Vec<u16> {
    file.find_tag_unsigned_vec(tag).ok().flatten().unwrap_or_default()
}

/// Text up to its end mark. Some writers omit the mark, which the `tiff` crate requires.
fn text(file: &mut File, tag: Tag) -> Option<String> {
    let mut buffer = vec![0; MOST_TEXT];
    let length = file.image_ifd().find_tag_bytes(tag, &mut buffer, 0).ok()??;
    buffer.truncate(length);
    let end = buffer.iter().position(|b| *b == 0).unwrap_or(buffer.len());
    Some(String::from_utf8_lossy(&buffer[..end]).trim().to_owned()).filter(|t| !t.is_empty())
}

/// The tags of the current page.
pub(super) fn tags(file: &mut File) -> Result<Tags> {
    let samples = number(file, Tag::SamplesPerPixel, 1)?;
    let photometric = number(file, Tag::PhotometricInterpretation, 1)?;
    let (shades, colours) = match photometric {
        0 | 1 => (Shades::Grey, 1),
        2 => (Shades::Rgb, 3),
        3 => (Shades::Palette, 1),
        4 => (Shades::Mask, 1),
        other => {
            let name = match other {
                5 => "CMYK",
                6 => "YCbCr",
                8..=10 => "CIE L*a*b*",
                _ => "unknown",
            };
            return Err(refused(format!("has colours of kind {other}, {name} (PhotometricInterpretation, tag 262)")));
        }
    };
    let extra = numbers(file, Tag::ExtraSamples);
    let alpha = match (samples.checked_sub(colours), &extra[..]) {
        (Some(0), _) => false,
        (Some(1), [1 | 2]) => true,
        // Many programs write alpha after red, green and blue without stating it.
        (Some(1), []) if shades == Shades::Rgb => true,
        _ => {
            return Err(refused(format!(
                "has {samples} samples a pixel where {colours} are meant (SamplesPerPixel, tag 277; ExtraSamples, 338)"
            ))
            .cause("several bands or measurements in one picture; which of them is meant is not said")
            .next("save that band as a separate TIFF"));
        }
    };
    let bits = numbers(file, Tag::BitsPerSample).first().copied().unwrap_or(1);
    let format = numbers(file, Tag::SampleFormat).first().copied().unwrap_or(1);
    let kind = match (format, bits) {
        (1, 1 | 2 | 4) if samples == 1 => Kind::Unsigned(bits as u8),
        (1, 8 | 16 | 32 | 64) => Kind::Unsigned(bits as u8),
        (2, 8 | 16 | 32 | 64) => Kind::Signed(bits as u8),
        (3, 16 | 32 | 64) => Kind::Float(bits as u8),
        _ => {
            return Err(refused(format!(
                "has samples of {bits} bits and format {format} (BitsPerSample, tag 258; SampleFormat, tag 339)"
            )));
        }
    };
    let order = number(file, Tag::FillOrder, 1)?;
    if order != 1 {
        return Err(refused(format!("has the bits of its bytes in order {order} (FillOrder, tag 266); allowed: 1")));
    }
    let (orientation, note) = orientation(file)?;
    let palette = if shades == Shades::Palette { numbers(file, Tag::ColorMap) } else { vec![] };
    if shades == Shades::Palette && (!matches!(kind, Kind::Unsigned(1..=8)) || palette.len() != 3 << bits) {
        return Err(refused(format!("has a palette of {} numbers for {kind} (ColorMap, tag 320)", palette.len())));
    }
    let mut says = says(file, photometric)?;
    says.notes.extend(note);
    Ok(Tags { shades, kind, bits: bits as u8, samples: usize::from(samples), alpha, orientation, palette, says })
}

/// The orientation of tag 274, else of XMP; that of a map of the land if none is stated. And a note on contradictions.
fn orientation(file: &mut File) -> Result<(Option<Orientation>, Option<String>)> {
    // Writers that do not know the orientation write 0.
    let number = number(file, Tag::Orientation, 0)?;
    if number > 8 {
        return Err(refused(format!("has orientation {number} (tag 274); allowed: 1 to 8")));
    }
    let exif = (number > 0).then(|| Orientation::exif(number));
    let (stated, note) = chosen(exif, text(file, XMP).as_deref().map(str::as_bytes))?;
    let land = doubles(file, Tag::ModelTransformationTag).and_then(|m| tiff_land::orientation(&m));
    let orientation = match (stated, land) {
        // 1 is what writers put there without a thought.
        (None | Some(Orientation { number: 1, .. }), Some(land)) => Some(land),
        (Some(stated), Some(land)) if stated.mirrors() != land.mirrors() => {
            return Err(Fault::input(format!(
                "states two orientations that contradict: {} = {} and {}, which amounts to {}",
                stated.by, stated.number, land.by, land.number
            ))
            .cause("one of them was kept when the picture was turned")
            .next("take out the wrong tag"));
        }
        (stated, _) => stated,
    };
    Ok((orientation, note))
}

fn doubles(file: &mut File, tag: Tag) -> Option<Vec<f64>> {
    file.find_tag(tag).ok().flatten()?.into_f64_vec().ok()
}

/// Pixels in a unit of length, of ImageJ: the resolution of columns and rows.
fn resolution(file: &mut File) -> Option<[f64; 2]> {
    let mut ratio = |tag| match file.find_tag(tag).ok().flatten()? {
        Value::Rational(a, b) => Some(f64::from(a) / f64::from(b)),
        _ => None,
    };
    let [x, y] = [ratio(Tag::XResolution)?, ratio(Tag::YResolution)?];
    (x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()).then_some([x, y])
}

fn says(file: &mut File, photometric: u16) -> Result<Says> {
    let mut says = Says {
        white_is_zero: photometric == 0,
        two_levels: photometric == 4,
        lossy: matches!(number(file, Tag::Compression, 1)?, 6 | 7 | 34_712),
        ..Says::default()
    };
    if let Some(text) = text(file, Tag::GdalNodata) {
        says.missing = Some(text.parse().map_err(|_| {
            Fault::input(format!(
                "names '{text}' as the sample of a missing pixel (GDAL_NODATA, tag 42113), which is not a number"
            ))
            .cause("a slip of the program that wrote the file")
            .next("correct the tag, or take it out")
        })?);
    }
    let gdal = text(file, GDAL_METADATA).map(|xml| Gdal::of(&xml)).transpose()?.unwrap_or_default();
    let description = text(file, Tag::ImageDescription).unwrap_or_default();
    let imagej = scale_of_imagej(&description)?;
    if let Some(([factor, offset], by)) =
        gdal.scale.map(|s| (s, "GDAL, tag 42112")).or(imagej.map(|s| (s, "ImageJ, tag 270")))
        && [factor, offset] != [1.0, 0.0]
    {
        says.scale = Some([factor, offset]);
        says.notes.push(format!("a sample means {factor} * sample + {offset}, as the file says ({by})"));
    }
    says.pictures = imagej_value(&description, "images").and_then(|n| n.parse().ok());
    let keys = numbers(file, GEO_KEYS);
    says.unit = gdal.unit.or_else(|| tiff_land::vertical_unit(&keys)).or_else(|| unit_of_imagej(&description));
    let scale = doubles(file, Tag::ModelPixelScaleTag);
    let matrix = doubles(file, Tag::ModelTransformationTag);
    let land = tiff_land::spacing(scale.as_deref(), matrix.as_deref());
    let resolution = resolution(file);
    says.spacing =
        land.or_else(|| spacing_of_imagej(&description, resolution)).or_else(|| spacing_of_ome(&description));
    says.notes.extend(tiff_land::notes(scale.as_deref(), matrix.as_deref()));
    Ok(says)
}
