//! In: picture files and raw sensor bytes. Out: grey images of 8 to 16 bits, rows without padding.
//! Frame and unit: pixels, x to the right, y down, (0, 0) is the centre of the top left pixel; grey levels.

mod bracket;
mod budget;
pub mod colour;
mod file;
mod float;
mod hot;
mod image8;
mod light;
mod mask;
mod named;
mod read_out;
mod response;
mod samples;
mod size;
mod text;

pub use bracket::{Bracket, Levels, MERGED_BITS, MOST_EXPOSURES, MOST_RATIO, Shares};
pub use file::{Channel, Depth, decode, decode_in_part, load, load_in_part, load_sized, png, save_png};
pub use float::{float_tiff, read_float_tiff};
pub use hot::HotPixels;
pub use image8::{Rgb, RgbImage};
pub use light::Light;
pub use mask::Mask;
pub use named::{Named, other_format, pictures_in};
pub use read_out::{Otherwise, ReadOut};
pub use response::Response;
pub use samples::{Kind, Samples, Says, Wanted, read_samples, unit_mm};
pub use size::{MOST_PIXELS, MOST_SIDE};
pub use text::text_width;

/// Grey levels, row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pixels {
    /// Levels of a sensor of 8 bits.
    U8(Vec<u8>),
    /// Levels of a sensor of 9..=16 bits, not stretched to 16.
    U16(Vec<u16>),
}

/// A grey image. `bits` is the sensor's depth: 8 with `Pixels::U8`, 9..=16 with `Pixels::U16`;
/// a pixel never exceeds `2^bits - 1`, which is saturation.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Depth of the sensor, 8..=16.
    pub bits: u8,
    /// Rows from the top, each from the left, `width * height` levels.
    pub pixels: Pixels,
}

impl Image {
    /// 8-bit image; panics when `pixels` is not `width * height` long.
    pub fn from_u8(width: u32, height: u32, pixels: Vec<u8>) -> Image {
        assert_eq!(pixels.len(), width as usize * height as usize);
        Image { width, height, bits: 8, pixels: Pixels::U8(pixels) }
    }
    /// 9..=16-bit image; panics when `pixels` is not `width * height` long.
    pub fn from_u16(width: u32, height: u32, bits: u8, pixels: Vec<u16>) -> Image {
        assert_eq!(pixels.len(), width as usize * height as usize);
        assert!((9..=16).contains(&bits));
        Image { width, height, bits, pixels: Pixels::U16(pixels) }
    }
    /// Grey level at a pixel inside the image.
    pub fn get(&self, x: u32, y: u32) -> u16 {
        let i = y as usize * self.width as usize + x as usize;
        match &self.pixels {
            Pixels::U8(p) => u16::from(p[i]),
            Pixels::U16(p) => p[i],
        }
    }
    /// The grey level of a saturated pixel.
    pub fn full_scale(&self) -> u16 {
        ((1u32 << self.bits) - 1) as u16
    }
    /// Width times height.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }
    /// Grey levels as f32, row-major.
    pub fn to_f32(&self) -> Vec<f32> {
        match &self.pixels {
            Pixels::U8(p) => p.iter().map(|&v| f32::from(v)).collect(),
            Pixels::U16(p) => p.iter().map(|&v| f32::from(v)).collect(),
        }
    }
    /// The 8 most significant bits, for display and for detectors that need 8 bits.
    pub fn to_u8(&self) -> Vec<u8> {
        match &self.pixels {
            Pixels::U8(p) => p.clone(),
            Pixels::U16(p) => p.iter().map(|&v| (v >> (self.bits - 8)) as u8).collect(),
        }
    }
}
