//! Finds the orientation of a picture where it stands elsewhere than in its Exif: in XMP, and in the text chunk in
//! which ImageMagick keeps the Exif of a PNG.

use super::turn::Orientation;
use crate::fault::{Fault, Result};

/// The name of the orientation in XMP.
const NAME: &str = "tiff:Orientation";

/// Exif has precedence over XMP, as in other readers; a note says so if they differ.
pub(super) fn chosen(exif: Option<Orientation>, xmp: Option<&[u8]>) -> Result<(Option<Orientation>, Option<String>)> {
    let xmp = xmp.map_or(Ok(None), in_xmp)?;
    let note = match (exif, xmp) {
        (Some(exif), Some(xmp)) if exif.number != xmp.number => Some(format!(
            "the file states two orientations, {} = {} and {} = {}: the first is followed",
            exif.by, exif.number, xmp.by, xmp.number
        )),
        _ => None,
    };
    Ok((exif.or(xmp), note))
}

/// The orientation that XMP states: `tiff:Orientation="4"` or `<tiff:Orientation>4</tiff:Orientation>`.
///
/// # Errors
/// Numbers other than 1 to 8, which no reader can follow.
fn in_xmp(xmp: &[u8]) -> Result<Option<Orientation>> {
    let text = String::from_utf8_lossy(xmp);
    let Some((_, rest)) = text.split_once(NAME) else { return Ok(None) };
    let value = rest.trim_start_matches(|c: char| c.is_whitespace() || "=>\"'".contains(c));
    let value: String = value.chars().take_while(|c| c.is_ascii_alphanumeric()).take(8).collect();
    match value.parse() {
        // Writers that do not know the orientation write 0.
        Ok(number @ 0..=8u16) => Ok(Some(Orientation { number: number.max(1), by: "XMP, tiff:Orientation" })),
        _ => Err(Fault::input(format!("has orientation '{value}' (XMP, tiff:Orientation); allowed: 1 to 8"))
            .cause("a slip of the program that wrote the file")
            .next("correct the orientation, or save the picture without XMP")),
    }
}

/// The bytes of ImageMagick's text `Raw profile type exif`: a name, the number of bytes, the bytes as digits.
pub(super) fn in_raw_profile(text: &str) -> Option<Vec<u8>> {
    let (name, rest) = text.trim_start().split_once('\n')?;
    let (length, digits) = rest.trim_start().split_once('\n')?;
    let length: usize = length.trim().parse().ok()?;
    if name.trim().is_empty() || length > text.len() {
        return None;
    }
    let digits: Vec<u8> = digits.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
    let byte = |two: &[u8]| std::str::from_utf8(two).ok().and_then(|two| u8::from_str_radix(two, 16).ok());
    let bytes = digits.chunks(2).map(byte).collect::<Option<Vec<u8>>>()?;
    (bytes.len() == length).then_some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orientations_are_found_wherever_they_stand() {
        let number = |xmp: &str| in_xmp(xmp.as_bytes()).unwrap().map(|o| o.number);
        assert_eq!(number(r#"<rdf:Description tiff:Make="x" tiff:Orientation="4"/>"#), Some(4));
        assert_eq!(number("<rdf:Description tiff:Orientation = '6'>"), Some(6));
        assert_eq!(number("<tiff:Orientation>8</tiff:Orientation>"), Some(8));
        assert_eq!(number(r#"tiff:Orientation="0""#), Some(1));
        assert_eq!(number("<x:xmpmeta/>"), None);
        for wrong in [r#"tiff:Orientation="9""#, r#"tiff:Orientation="top""#, "tiff:Orientation"] {
            assert!(in_xmp(wrong.as_bytes()).unwrap_err().what.contains("tiff:Orientation"), "{wrong}");
        }
        assert_eq!(in_raw_profile("\nexif\n       3\n4578\n69\n").unwrap(), b"Exi");
        for wrong in ["", "\nexif\n", "\nexif\n 3\n4578", "\nexif\n 1\nzz", "\nexif\n 99999999999\n00"] {
            assert!(in_raw_profile(wrong).is_none(), "{wrong}");
        }
    }
}
