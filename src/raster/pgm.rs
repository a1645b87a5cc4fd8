//! In: bytes of a binary PGM (P5). Out: its grey levels as they are written: other readers stretch a 12-bit sensor's
//! levels, whose file says 4095, to 16 bits. Frame and unit: pixels, grey levels.

use super::{Image, Pixels};
use crate::fault::{Fault, Result};

/// Size, largest level and place of the first pixel.
struct Header {
    width: u32,
    height: u32,
    most: u32,
    start: usize,
}

fn header(bytes: &[u8]) -> Option<Header> {
    let mut at = 2;
    let mut next = || {
        loop {
            match bytes.get(at)? {
                b'#' => at += bytes[at..].iter().position(|&b| b == b'\n')?,
                b if b.is_ascii_whitespace() => at += 1,
                _ => break,
            }
        }
        let digits = bytes[at..].iter().take_while(|b| b.is_ascii_digit()).count();
        let number = std::str::from_utf8(&bytes[at..at + digits]).ok()?.parse::<u32>().ok()?;
        at += digits;
        Some(number)
    };
    let (width, height, most) = (next()?, next()?, next()?);
    // One blank, then the pixels.
    let good = bytes.get(at)?.is_ascii_whitespace() && width > 0 && height > 0 && (1..=65_535).contains(&most);
    good.then_some(Header { width, height, most, start: at + 1 })
}

/// `bits` is the depth that the recording declares. Levels above it are left for the caller to find.
pub fn decode(bytes: &[u8], bits: u8, size: Option<[u32; 2]>) -> Result<Image> {
    let broken = |what: String| {
        Err(Fault::input(what)
            .cause("the file is truncated, or its header is of another program")
            .next("record the shot again, or pass --skip-bad to leave it out"))
    };
    let Some(Header { width, height, most, start }) = header(bytes) else {
        return broken(format!("is not a readable picture ({} bytes): a PGM without a whole header", bytes.len()));
    };
    super::size::fits(width, height, size)?;
    let deep = most > 255;
    if deep != (bits > 8) {
        return Err(Fault::input(format!(
            "holds {} bits a pixel, the recording declares {bits}",
            if deep { 16 } else { 8 }
        ))
        .cause("meta.json and the pictures are from different cameras or exports")
        .next("correct image.bits in meta.json"));
    }
    let pixels = u64::from(width) * u64::from(height);
    let (have, need) = ((bytes.len() - start) as u64, pixels * if deep { 2 } else { 1 });
    if have < need {
        return broken(format!("is not a readable picture: {have} bytes of pixels, {width}x{height} need {need}"));
    }
    let body = &bytes[start..start + need as usize];
    let pixels = match deep {
        false => Pixels::U8(body.to_vec()),
        true => Pixels::U16(body.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()),
    };
    Ok(Image { width, height, bits, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_read_as_they_are_written() {
        let decode = |bytes: &[u8], bits| super::decode(bytes, bits, None);
        let mut bytes = b"P5\n# a comment\n3 1\n4095\n".to_vec();
        bytes.extend([0, 7, 15, 255, 1, 0]);
        assert_eq!(decode(&bytes, 12).unwrap(), Image::from_u16(3, 1, 12, vec![7, 4095, 256]));
        assert!(decode(&bytes, 8).unwrap_err().what.contains("16 bits"));
        assert!(decode(&bytes[..bytes.len() - 1], 12).unwrap_err().what.contains("5 bytes"));
        assert_eq!(decode(b"P5 2 1 255\n\x0a\x20", 8).unwrap(), Image::from_u8(2, 1, vec![10, 32]));
        for wrong in [&b"P5"[..], b"P5 2", b"P5 2 1 0 ab", b"P5 0 1 255 a", b"P5 2 1 99999 ab", b"P5 # no end"] {
            assert!(decode(wrong, 8).is_err());
        }
    }
}
