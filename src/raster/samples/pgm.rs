//! Reads PGM (P5 and P2) with its levels as written: other readers stretch a 12-bit sensor's levels to 16 bits.

use super::kind::{Kind, Values};
use super::picture::{Samples, Wanted};
use super::says::Says;
use crate::fault::{Fault, Result};

/// Size, largest level and offset of the first pixel.
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
    // One whitespace byte, then the pixels.
    let good = bytes.get(at)?.is_ascii_whitespace() && width > 0 && height > 0 && (1..=65_535).contains(&most);
    good.then_some(Header { width, height, most, start: at + 1 })
}

/// Reads a PGM; the levels are not stretched, whatever largest level the header states.
pub(super) fn read(bytes: &[u8], wanted: &Wanted) -> Result<Samples> {
    let broken = |what: String| {
        Err(Fault::input(what)
            .cause("the file is truncated, or its header is of another program")
            .next("write the file again"))
    };
    let Some(Header { width, height, most, start }) = header(bytes) else {
        return broken(format!("is not a readable picture ({} bytes): a PGM without a whole header", bytes.len()));
    };
    wanted.fits(1, [width, height])?;
    let deep = most > 255;
    let pixels = u64::from(width) * u64::from(height);
    let values = if bytes.starts_with(b"P2") {
        let Some((levels, rest)) = words(&bytes[start..], pixels, most) else {
            return broken(format!("is not a readable picture: its text holds no {pixels} levels up to {most}"));
        };
        alone(rest.as_bytes())?;
        if deep { Values::U16(levels) } else { Values::U8(levels.into_iter().map(|v| v as u8).collect()) }
    } else {
        let (have, need) = ((bytes.len() - start) as u64, pixels * if deep { 2 } else { 1 });
        if have < need {
            return broken(format!("is not a readable picture: {have} bytes of pixels, {width}x{height} need {need}"));
        }
        let (body, rest) = bytes[start..].split_at(need as usize);
        alone(rest)?;
        within(body, most)?;
        match deep {
            false => Values::U8(body.to_vec()),
            true => Values::U16(body.chunks_exact(2).map(|b| u16::from_be_bytes([b[0], b[1]])).collect()),
        }
    };
    let kind = Kind::Unsigned(if deep { 16 } else { 8 });
    let says = Says { most: Some(most), ..Says::default() };
    Ok(Samples { width, height, channels: 1, kind, values, hidden: None, veiled: 0, says })
}

/// Refuses levels above the largest one that the header states.
fn within(body: &[u8], most: u32) -> Result<()> {
    let levels = |of: fn([u8; 2]) -> u16| body.chunks_exact(2).map(move |b| u32::from(of([b[0], b[1]])));
    let deep = most > 255;
    let largest = match deep {
        false => body.iter().map(|b| u32::from(*b)).max(),
        true => levels(u16::from_be_bytes).max(),
    };
    let Some(largest) = largest.filter(|largest| *largest > most) else { return Ok(()) };
    let swapped = deep && levels(u16::from_le_bytes).all(|v| v <= most);
    Err(Fault::input(format!("holds the level {largest}, above the largest level {most} that it states (MAXVAL)"))
        .cause(match swapped {
            true => "its levels are stored with the low byte first; a PGM has the high byte first",
            false => "the program that wrote it stated another depth than that of the levels",
        })
        .next("write the file again with the largest level and the byte order of PGM, or as a PNG of 16 bits"))
}

/// Refuses further pictures behind the first.
fn alone(rest: &[u8]) -> Result<()> {
    let rest = rest.trim_ascii_start();
    let another = matches!(rest, [b'P', b'1'..=b'7', next, ..] if next.is_ascii_whitespace() || *next == b'#');
    if !another {
        return Ok(());
    }
    Err(Fault::input("holds several pictures, one behind the other")
        .cause("a film; one picture is needed, and it is not stated which")
        .next("save that picture as a separate file"))
}

/// The levels of a PGM written as text (P2), and the word after them.
fn words(text: &[u8], pixels: u64, most: u32) -> Option<(Vec<u16>, String)> {
    // A level takes at least a digit and a blank.
    if pixels > text.len() as u64 {
        return None;
    }
    let text = std::str::from_utf8(text).ok()?;
    let mut words = text.lines().map(|l| l.split('#').next().unwrap_or("")).flat_map(str::split_ascii_whitespace);
    let level = |w: &str| w.parse::<u16>().ok().filter(|v| u32::from(*v) <= most);
    let levels = words.by_ref().take(pixels as usize).map(level).collect::<Option<Vec<u16>>>()?;
    // A blank ends the word, as it ends the mark of a further picture.
    (levels.len() as u64 == pixels).then(|| (levels, words.next().map(|w| format!("{w} ")).unwrap_or_default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_read_as_they_are_written() {
        let decode = |bytes: &[u8]| read(bytes, &Wanted { size: None, most: 100, page: None });
        let mut bytes = b"P5\n# a comment\n3 1\n4095\n".to_vec();
        bytes.extend([0, 7, 15, 255, 1, 0]);
        assert_eq!(decode(&bytes).unwrap().values, Values::U16(vec![7, 4095, 256]));
        assert!(decode(&bytes[..bytes.len() - 1]).unwrap_err().what.contains("5 bytes"));
        assert_eq!(decode(b"P5 2 1 255\n\x0a\x20").unwrap().values, Values::U8(vec![10, 32]));
        assert_eq!(decode(b"P2\n3 1 # three\n4095\n7 4095\n256\n").unwrap().values, Values::U16(vec![7, 4095, 256]));
        assert_eq!(decode(b"P2 2 1 15 3 15").unwrap().values, Values::U8(vec![3, 15]));
        for wrong in [
            &b"P5"[..],
            b"P5 2",
            b"P5 2 1 0 ab",
            b"P5 0 1 255 a",
            b"P5 2 1 99999 ab",
            b"P5 # no end",
            b"P2 2 1 15 3 16",
            b"P2 2 1 15 3",
            b"P2 2 1 15 3 x",
            b"P5 2 1 15 \x10\x0f",
        ] {
            assert!(decode(wrong).is_err());
        }
        let swapped = decode(b"P5 2 1 4095 \xff\x0f\x02\0").unwrap_err();
        assert!(swapped.what.contains("MAXVAL") && swapped.cause.contains("low byte first"), "{swapped}");
        for film in [&b"P5 2 1 15 \x01\x0fP5 2 1 15 \x01\x0f"[..], b"P2 2 1 15 3 4\nP2\n2 1 15 5 6\n"] {
            assert!(decode(film).unwrap_err().what.contains("several pictures"));
        }
        for end in [&b"P5 2 1 15 \x01\x0f\n"[..], b"P5 2 1 15 \x01\x0f and more", b"P2 2 1 15 3 4\n# the end\n"] {
            assert!(decode(end).is_ok());
        }
    }
}
