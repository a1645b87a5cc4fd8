//! Reads what a page of a TIFF states about its samples, and refuses by name what no reader here supports.

use super::kind::Kind;
use super::says::Says;
use crate::fault::{Fault, Result};
use std::io::Cursor;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// Largest text of a tag that is read, bytes.
const MOST_TEXT: usize = 64 << 10;
/// Scale, offset and more of a band, as XML.
const GDAL_METADATA: Tag = Tag::Unknown(42_112);

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
    pub orientation: u16,
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
    // Writers that do not know the orientation write 0.
    let orientation = number(file, Tag::Orientation, 1)?.max(1);
    if orientation > 8 {
        return Err(refused(format!("has orientation {orientation} (tag 274); allowed: 1 to 8")));
    }
    let palette = if shades == Shades::Palette { numbers(file, Tag::ColorMap) } else { vec![] };
    if shades == Shades::Palette && (!matches!(kind, Kind::Unsigned(1..=8)) || palette.len() != 3 << bits) {
        return Err(refused(format!("has a palette of {} numbers for {kind} (ColorMap, tag 320)", palette.len())));
    }
    let says = says(file, photometric)?;
    Ok(Tags { shades, kind, bits: bits as u8, samples: usize::from(samples), alpha, orientation, palette, says })
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
    let gdal = text(file, GDAL_METADATA).map(|xml| scale_of_gdal(&xml)).transpose()?.flatten();
    let imagej = text(file, Tag::ImageDescription).map(|t| scale_of_imagej(&t)).transpose()?.flatten();
    if let Some(([factor, offset], by)) =
        gdal.map(|s| (s, "GDAL, tag 42112")).or(imagej.map(|s| (s, "ImageJ, tag 270")))
        && [factor, offset] != [1.0, 0.0]
    {
        says.scale = Some([factor, offset]);
        says.notes.push(format!("a sample means {factor} * sample + {offset}, as the file says ({by})"));
    }
    if let Ok(Some(value)) = file.find_tag(Tag::ModelPixelScaleTag)
        && let Ok([x, y, ..]) = value.into_f64_vec().as_deref()
    {
        says.spacing = Some([*x, *y]);
    }
    Ok(says)
}

/// Factor and offset of a linear scale, from numbers as text.
fn line(factor: Option<&str>, offset: Option<&str>) -> Result<Option<[f64; 2]>> {
    if factor.is_none() && offset.is_none() {
        return Ok(None);
    }
    let number = |t: Option<&str>, otherwise: f64| {
        let parsed = t.map_or(Ok(otherwise), |t| t.trim().parse::<f64>().map_err(|_| t));
        parsed.ok().filter(|v| v.is_finite())
    };
    match (number(factor, 1.0), number(offset, 0.0)) {
        (Some(factor), Some(offset)) if factor != 0.0 => Ok(Some([factor, offset])),
        _ => Err(refused(format!("scales its samples by {factor:?} and {offset:?}, which are no usable numbers"))),
    }
}

/// `<Item name="SCALE" sample="0" role="scale">0.01</Item>`, and the same for the offset.
fn scale_of_gdal(xml: &str) -> Result<Option<[f64; 2]>> {
    let item = |role: &str| {
        let start = xml.find(&format!("role=\"{role}\""))?;
        xml[start..].split_once('>')?.1.split('<').next()
    };
    line(item("scale"), item("offset"))
}

/// ImageJ stores signed whole numbers as unsigned ones and states how to undo it: `cf=0`, `c0=-32768`, `c1=1`.
fn scale_of_imagej(description: &str) -> Result<Option<[f64; 2]>> {
    if !description.starts_with("ImageJ") {
        return Ok(None);
    }
    let value = |key: &str| description.lines().find_map(|l| l.trim().strip_prefix(key)?.strip_prefix('='));
    match value("cf").map(str::trim) {
        None => Ok(None),
        Some("0") => line(value("c1"), value("c0")),
        Some(other) => {
            Err(refused(format!("calibrates its samples by ImageJ's function {other}; allowed: 0, a straight line"))
                .next("in ImageJ apply the calibration and save the result as 32 bits"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_read_and_strange_ones_refused() {
        let xml = r#"<GDALMetadata><Item name="OFFSET" sample="0" role="offset">-5.5</Item>
            <Item name="SCALE" sample="0" role="scale">0.01</Item></GDALMetadata>"#;
        assert_eq!(scale_of_gdal(xml).unwrap(), Some([0.01, -5.5]));
        assert_eq!(scale_of_gdal("<GDALMetadata></GDALMetadata>").unwrap(), None);
        assert!(scale_of_gdal(r#"<Item role="scale">one</Item>"#).is_err());
        assert!(scale_of_gdal(r#"<Item role="scale">0</Item>"#).is_err());
        let signed = "ImageJ=1.54f\nmin=0\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=gray value\n";
        assert_eq!(scale_of_imagej(signed).unwrap(), Some([1.0, -32_768.0]));
        assert_eq!(scale_of_imagej("ImageJ=1.54f\nimages=2").unwrap(), None);
        assert_eq!(scale_of_imagej("cf=0\nc0=1\nc1=2").unwrap(), None);
        assert!(scale_of_imagej("ImageJ=1\ncf=8\nc0=1\nc1=2").is_err());
    }
}
