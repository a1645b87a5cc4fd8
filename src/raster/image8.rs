//! In: colours and shapes. Out: 8-bit colour pictures for people: overlays, height maps, residual plots.
//! Frame and unit: pixels, x to the right, y down.

use crate::fault::Result;
use std::path::Path;

/// Red, green and blue, 0..=255.
pub type Rgb = [u8; 3];

/// A colour picture, row-major.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// Rows from the top, each from the left, `width * height` colours.
    pub pixels: Vec<Rgb>,
}

impl RgbImage {
    /// A picture of one colour, sizes in px.
    pub fn filled(width: u32, height: u32, colour: Rgb) -> RgbImage {
        RgbImage { width, height, pixels: vec![colour; width as usize * height as usize] }
    }
    /// A grey picture to draw on.
    pub fn from_grey(image: &super::Image) -> RgbImage {
        RgbImage { width: image.width, height: image.height, pixels: image.to_u8().iter().map(|&v| [v; 3]).collect() }
    }
    /// Colours one pixel; a place outside the picture is ignored.
    pub fn set(&mut self, x: i64, y: i64, colour: Rgb) {
        if (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y) {
            self.pixels[y as usize * self.width as usize + x as usize] = colour;
        }
    }
    /// A straight line, one pixel wide.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64), colour: Rgb) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().clamp(1.0, 1e5);
        for i in 0..=steps as i64 {
            let t = i as f64 / steps;
            self.set(
                (from.0 + t * (to.0 - from.0)).round() as i64,
                (from.1 + t * (to.1 - from.1)).round() as i64,
                colour,
            );
        }
    }
    /// PNG bytes, for files and for pages that embed their pictures.
    pub fn to_png(&self) -> Vec<u8> {
        let mut out = std::io::Cursor::new(Vec::new());
        image::write_buffer_with_format(
            &mut out,
            bytemuck::cast_slice(&self.pixels),
            self.width,
            self.height,
            image::ExtendedColorType::Rgb8,
            image::ImageFormat::Png,
        )
        .expect("memory takes every picture");
        out.into_inner()
    }
    /// Writes a PNG file; an existing file of that name is replaced once the new one is complete.
    pub fn save_png(&self, path: &Path) -> Result<()> {
        crate::files::write(path, &self.to_png())
    }
}
