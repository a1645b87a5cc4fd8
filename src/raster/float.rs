//! In: float values on a grid. Out: a single-channel 32-bit float TIFF, and the way back.
//! Frame and unit: the caller's; NaN stays NaN.

use crate::fault::{Fault, Result};
use std::io::Cursor;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::{TiffEncoder, colortype::Gray32Float};

/// The bytes of a TIFF with one float a pixel; `values` is row-major. `description` goes into the
/// ImageDescription tag.
pub fn float_tiff(width: u32, height: u32, values: &[f32], description: &str) -> Vec<u8> {
    assert_eq!(values.len(), width as usize * height as usize);
    let mut out = Cursor::new(Vec::new());
    let write = |out: &mut Cursor<Vec<u8>>| -> tiff::TiffResult<()> {
        let mut tiff = TiffEncoder::new(out)?;
        let mut image = tiff.new_image::<Gray32Float>(width, height)?;
        image.encoder().write_tag(tiff::tags::Tag::ImageDescription, description)?;
        image.write_data(values)
    };
    write(&mut out).expect("memory takes every picture below 4 GB");
    out.into_inner()
}

/// Most cells that a map may have.
const MOST_CELLS: u64 = 1 << 26;

/// Width, height and values of a single-channel float TIFF.
pub fn read_float_tiff(bytes: &[u8]) -> Result<(u32, u32, Vec<f32>)> {
    let strange = |e: &dyn std::fmt::Display| {
        Fault::input(format!("is not a float TIFF: {e}"))
            .cause("another kind of picture, or a truncated file")
            .next("give the height.tif of a scan, or a single-channel 32-bit float TIFF")
    };
    let decoder = Decoder::new(Cursor::new(bytes)).map_err(|e| strange(&e))?;
    // One float a cell, whatever number of samples the file claims.
    let mut limits = Limits::default();
    limits.decoding_buffer_size = 4 * MOST_CELLS as usize;
    let mut decoder = decoder.with_limits(limits);
    let (width, height) = decoder.dimensions().map_err(|e| strange(&e))?;
    let cells = u64::from(width) * u64::from(height);
    if cells > MOST_CELLS {
        return Err(strange(&format!("{width}x{height} are {cells} cells, limit {MOST_CELLS}")));
    }
    match decoder.read_image().map_err(|e| strange(&e))? {
        DecodingResult::F32(values) if values.len() == width as usize * height as usize => Ok((width, height, values)),
        _ => Err(strange(&"its pixels are not one 32-bit float each")),
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
    }
}
