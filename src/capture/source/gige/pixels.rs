//! In: the bytes of a grey picture in one of the standard's pixel formats. Out: the picture.
//! Frame and unit: grey levels of the sensor's depth.

use crate::fault::{Fault, Result};
use crate::raster::Image;

/// Layout of the levels in the bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layout {
    /// One byte per level.
    Byte,
    /// Two bytes per level, little endian.
    Word,
    /// Levels as consecutive bits, the lowest first, rows without gaps (PFNC's `p`).
    Dense,
    /// Two levels in three bytes: high bits, low bits of both, high bits (GigE Vision's `Packed`).
    Packed,
}

/// Depth and layout of a grey format; none for any other format.
fn layout(format: &str) -> Option<(u8, Layout)> {
    Some(match format {
        "Mono8" => (8, Layout::Byte),
        "Mono10" => (10, Layout::Word),
        "Mono12" => (12, Layout::Word),
        "Mono14" => (14, Layout::Word),
        "Mono16" => (16, Layout::Word),
        "Mono10p" => (10, Layout::Dense),
        "Mono12p" => (12, Layout::Dense),
        "Mono14p" => (14, Layout::Dense),
        "Mono10Packed" => (10, Layout::Packed),
        "Mono12Packed" => (12, Layout::Packed),
        _ => return None,
    })
}

/// Bits per level of a grey format.
///
/// # Errors
/// A format that is not grey or not known.
pub fn depth(format: &str) -> Result<u8> {
    layout(format).map(|(bits, _)| bits).ok_or_else(|| {
        Fault::input(format!("the camera's pixel format is {format}"))
            .cause("a colour camera, or one that interpolates colours itself")
            .next(
                "set a grey one: sheetlight camera set PixelFormat Mono8 (or Mono10, Mono12, Mono16 and their \
                   packed forms)",
            )
    })
}

/// Converts the bytes to a picture. With one byte per level and no padding they are used without a copy. `padding`
/// is the number of bytes after each row.
///
/// # Errors
/// A format that is not grey; too few bytes; a level above the depth.
pub fn unpack(format: &str, width: u32, height: u32, padding: usize, mut bytes: Vec<u8>) -> Result<Image> {
    let bits = depth(format)?;
    let (_, layout) = layout(format).expect("it has a depth");
    let (w, h) = (width as usize, height as usize);
    let row = match layout {
        Layout::Byte => w,
        Layout::Word => 2 * w,
        Layout::Dense => (w * usize::from(bits)).div_ceil(8),
        Layout::Packed => (w * 3).div_ceil(2),
    };
    // Without padding, packed levels continue from row to row.
    let dense = matches!(layout, Layout::Dense | Layout::Packed) && padding == 0;
    let whole = match layout {
        Layout::Dense if dense => (w * h * usize::from(bits)).div_ceil(8),
        Layout::Packed if dense => (w * h * 3).div_ceil(2),
        _ => (row + padding) * h.saturating_sub(1) + row,
    };
    if bytes.len() < whole || w == 0 || h == 0 {
        return Err(Fault::input(format!(
            "a picture of {} bytes, {width}x{height} in {format} has {whole}",
            bytes.len()
        ))
        .cause("the camera's size or format was changed while it runs")
        .next("stop, set the camera, start again"));
    }
    if layout == Layout::Byte && padding == 0 {
        bytes.truncate(whole);
        return Ok(Image::from_u8(width, height, bytes));
    }
    let rows = |y: usize| &bytes[y * (row + padding)..][..row];
    if layout == Layout::Byte {
        return Ok(Image::from_u8(width, height, (0..h).flat_map(rows).copied().collect()));
    }
    let level = |bytes: &[u8], x: usize| match layout {
        Layout::Word => u16::from_le_bytes([bytes[2 * x], bytes[2 * x + 1]]),
        Layout::Dense => {
            let at = x * usize::from(bits);
            let byte = |i: usize| u32::from(bytes.get(at / 8 + i).copied().unwrap_or(0));
            let word = byte(0) | byte(1) << 8 | byte(2) << 16;
            (word >> (at % 8) & ((1 << bits) - 1)) as u16
        }
        _ => {
            let three = |i: usize| u16::from(bytes.get(x / 2 * 3 + i).copied().unwrap_or(0));
            let low = u16::from(bits - 8);
            let (high, bits_of) = if x.is_multiple_of(2) { (three(0), three(1)) } else { (three(2), three(1) >> 4) };
            high << low | bits_of & ((1 << low) - 1)
        }
    };
    let levels: Vec<u16> = if dense {
        (0..w * h).map(|i| level(&bytes, i)).collect()
    } else {
        (0..h).flat_map(|y| (0..w).map(move |x| (y, x))).map(|(y, x)| level(rows(y), x)).collect()
    };
    let (largest, full) = (levels.iter().copied().max().unwrap_or(0), ((1u32 << bits) - 1) as u16);
    if largest > full {
        return Err(Fault::input(format!("a picture holds the level {largest}, above the {full} of {format}"))
            .cause("a camera that shifts its levels to the top of 16 bits")
            .next("set PixelFormat to Mono16, or to a packed format"));
    }
    Ok(Image::from_u16(width, height, bits, levels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::Pixels;

    #[test]
    fn each_grey_format_is_read_as_the_standard_lays_it() {
        let want = [0x123u16, 0xabc, 0x7ff, 0x001];
        let levels =
            |format: &str, bytes: &[u8], padding| match unpack(format, 2, 2, padding, bytes.to_vec()).unwrap().pixels {
                Pixels::U16(levels) => levels,
                Pixels::U8(levels) => levels.into_iter().map(u16::from).collect(),
            };
        assert_eq!(levels("Mono8", &[1, 2, 0, 3, 4, 0], 1), [1, 2, 3, 4]);
        let words: Vec<u8> = want.iter().flat_map(|l| l.to_le_bytes()).collect();
        assert_eq!(levels("Mono12", &words, 0), want);
        assert_eq!(levels("Mono12p", &[0x23, 0xc1, 0xab, 0xff, 0x17, 0x00], 0), want);
        assert_eq!(levels("Mono12Packed", &[0x12, 0xc3, 0xab, 0x7f, 0x1f, 0x00], 0), want);
        // 0x3ff, 0, 0x155, 0x2aa: ten bits each, the lowest first.
        assert_eq!(levels("Mono10p", &[0xff, 0x03, 0x50, 0x95, 0xaa], 0), [0x3ff, 0, 0x155, 0x2aa]);
        assert_eq!(levels("Mono10Packed", &[0xff, 0x03, 0x00, 0x55, 0x21, 0xaa], 0), [0x3ff, 0, 0x155, 0x2aa]);
        assert!(unpack("Mono12", 2, 2, 0, vec![0xff; 8]).unwrap_err().what.contains("4095"));
        assert!(unpack("Mono8", 2, 2, 0, vec![0; 3]).unwrap_err().what.contains("has 4"));
        assert!(depth("BayerRG8").unwrap_err().next.contains("Mono8"));
    }
}
