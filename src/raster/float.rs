//! In: float values on a grid. Out: a single-channel 32-bit float TIFF; and the reverse.
//! Frame and unit: the caller's; the first row has the smallest y; NaN stays NaN.

use super::samples::{Kind, Values, Wanted, read_samples};
use crate::fault::{Fault, Result};
use std::io::Cursor;
use tiff::encoder::{TiffEncoder, colortype::Gray32Float};

/// Orientation (tag 274) of rows that run upwards: the first one is the lowest.
const ROWS_UP: u16 = 4;

/// The bytes of a TIFF with one float a pixel; `values` is row-major, its first row the lowest (Orientation 4).
/// `description` goes into the ImageDescription tag.
pub fn float_tiff(width: u32, height: u32, values: &[f32], description: &str) -> Vec<u8> {
    assert_eq!(values.len(), width as usize * height as usize);
    let mut out = Cursor::new(Vec::new());
    let write = |out: &mut Cursor<Vec<u8>>| -> tiff::TiffResult<()> {
        let mut tiff = TiffEncoder::new(out)?;
        let mut image = tiff.new_image::<Gray32Float>(width, height)?;
        image.encoder().write_tag(tiff::tags::Tag::ImageDescription, description)?;
        image.encoder().write_tag(tiff::tags::Tag::Orientation, ROWS_UP)?;
        image.write_data(values)
    };
    write(&mut out).expect("memory takes every picture below 4 GB");
    out.into_inner()
}

/// Most cells that a map may have.
const MOST_CELLS: u64 = 1 << 26;

/// Width, height and values of a single-channel float TIFF, the first row the lowest. A file without an orientation,
/// as earlier versions wrote it, has its rows in that order too.
pub fn read_float_tiff(bytes: &[u8]) -> Result<(u32, u32, Vec<f32>)> {
    let strange = |what: String| {
        Fault::input(format!("is not a float TIFF: {what}"))
            .cause("another kind of picture, or a truncated file")
            .next("give the height.tif of a scan, or a single-channel 32-bit float TIFF")
    };
    let read = read_samples(bytes, &Wanted { size: None, most: MOST_CELLS, page: None });
    let samples = read.map_err(|e| strange(e.what))?;
    let upright = samples.says.orientation;
    if let Some(other) = upright.filter(|o| *o != ROWS_UP) {
        return Err(strange(format!("its orientation is {other} (tag 274), wanted {ROWS_UP}, rows that run upwards")));
    }
    match (samples.kind, samples.channels, samples.values) {
        (Kind::Float(32), 1, Values::F32(mut values)) => {
            if upright.is_some() {
                // It was turned upright, the highest row first.
                values = values.rchunks(samples.width.max(1) as usize).flatten().copied().collect();
            }
            Ok((samples.width, samples.height, values))
        }
        (kind, channels, _) => {
            Err(strange(format!("its pixels are {channels} x {kind}, wanted one 32-bit float each")))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_and_missing_values_come_back() {
        let values = vec![1.5, f32::NAN, -0.25, 1e-7, 3e8, 0.0];
        let (w, h, back) = read_float_tiff(&float_tiff(3, 2, &values, "mm")).unwrap();
        assert_eq!((w, h), (3, 2));
        assert!(values.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert!(read_float_tiff(b"II*\0garbage").is_err());
        // Other readers see the highest row first; files without an orientation and other orientations.
        let file = float_tiff(3, 2, &values, "mm");
        let seen = read_samples(&file, &Wanted { size: None, most: 10, page: None }).unwrap();
        assert_eq!((seen.says.orientation, seen.get(0, 0)), (Some(4), f64::from(values[3])));
        let at = file.windows(4).rposition(|w| w == [18, 1, 3, 0]).unwrap() + 8;
        let turned = |number: u8| {
            let mut file = file.clone();
            file[at] = number;
            read_float_tiff(&file)
        };
        assert_eq!(turned(1).unwrap().2[0], 1.5);
        assert!(turned(3).unwrap_err().what.contains("tag 274"));
    }
}
