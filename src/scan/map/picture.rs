//! In: a height map. Out: colour pictures for viewing: heights with hillshade, intensity, sigma, coverage, each with
//! a numeric scale and a length bar.
//! Frame and unit: the grid seen from above, x to the right, y up; mm and grey levels on the scales.

use super::heightmap::quantiles;
use crate::raster::{Rgb, RgbImage, colour, text_width};
use crate::scan::HeightMap;

/// Which of a height map's values is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// Height above the grid's plane, mm; with hillshade.
    Height,
    /// Mean stripe amplitude, grey levels.
    Intensity,
    /// Standard deviation of the height, mm.
    Sigma,
    /// Points per cell.
    Coverage,
}

/// Colour of cells without a measurement.
const MISSING: Rgb = [38, 42, 50];
const PAPER: Rgb = [18, 20, 24];
const INK: Rgb = [226, 230, 235];
/// The map is enlarged by an integer factor until it is at least this wide, px.
const WIDE: u32 = 900;

impl HeightMap {
    fn shown(&self, what: Shown) -> Vec<f32> {
        match what {
            Shown::Height => self.z.clone(),
            Shown::Intensity => self.intensity.clone(),
            Shown::Sigma => self.sigma.clone(),
            Shown::Coverage => self.count.iter().map(|&n| if n > 0 { n as f32 } else { f32::NAN }).collect(),
        }
    }

    /// The picture, and the pixel of the outer corner of cell (0, 0) with the pixels per mm. A mark at grid (x, y)
    /// mm belongs at the pixel that [`MapPlace::pixel`] gives.
    pub fn picture(&self, what: Shown) -> (RgbImage, MapPlace) {
        let values = self.shown(what);
        let (low, high) = span(&values, what);
        let scale = WIDE.div_ceil(self.width.max(1)).clamp(1, 8);
        let (w, h) = (i64::from(self.width * scale), i64::from(self.height * scale));
        let (left, top, bottom, right) = (24, 24, 56, 150);
        let tall = (h + top + bottom).max(240);
        let mut picture = RgbImage::filled((w + left + right) as u32, tall as u32, PAPER);
        for iy in 0..i64::from(self.height) {
            for ix in 0..i64::from(self.width) {
                let value = values[(iy * i64::from(self.width) + ix) as usize];
                let ink = if value.is_finite() {
                    let x = (value - low) / (high - low).max(f32::MIN_POSITIVE);
                    match what {
                        Shown::Height => shaded(colour::ordered(x), self.slope_light(ix, iy)),
                        Shown::Sigma => colour::ordered(x),
                        Shown::Intensity | Shown::Coverage => colour::grey(0.12 + 0.88 * x),
                    }
                } else {
                    MISSING
                };
                let y = top + h - (iy + 1) * i64::from(scale);
                picture.fill(left + ix * i64::from(scale), y, scale.into(), scale.into(), ink);
            }
        }
        let unit = match what {
            Shown::Height | Shown::Sigma => "mm",
            Shown::Intensity => "grey",
            Shown::Coverage => "points",
        };
        let bar_height = (tall - top - bottom).max(120);
        value_scale(&mut picture, left + w + 18, top, bar_height, (low, high), unit, what);
        length_bar(&mut picture, left, top + h + 14, self.cell / f64::from(scale), w);
        (picture, MapPlace { origin: (left as f64, (top + h) as f64), pixels_per_mm: f64::from(scale) / self.cell })
    }

    /// Hillshade factor of a cell, with light from the upper left, 0.6 to 1.2; flat ground is 1.
    fn slope_light(&self, ix: i64, iy: i64) -> f32 {
        let Some(here) = self.get(ix, iy) else { return 1.0 };
        let rise = |dx: i64, dy: i64| match (self.get(ix + dx, iy + dy), self.get(ix - dx, iy - dy)) {
            (Some(a), Some(b)) => (a - b) / (2.0 * self.cell as f32),
            (Some(a), None) => (a - here) / self.cell as f32,
            (None, Some(b)) => (here - b) / self.cell as f32,
            (None, None) => 0.0,
        };
        let (gx, gy) = (rise(1, 0), rise(0, 1));
        let steep = (gx * gx + gy * gy + 1.0).sqrt();
        (1.0 + 0.45 * (gx - gy) / steep).clamp(0.6, 1.2)
    }
}

/// Where a height map lies in its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPlace {
    /// Pixel of the grid's origin.
    pub origin: (f64, f64),
    /// Scale of the picture: px per mm of the grid.
    pub pixels_per_mm: f64,
}

impl MapPlace {
    /// Pixel of a position on the grid, mm.
    pub fn pixel(&self, x: f64, y: f64) -> (f64, f64) {
        (self.origin.0 + x * self.pixels_per_mm, self.origin.1 - y * self.pixels_per_mm)
    }
}

/// The range that holds 99 % of the cells' values; it starts at zero except for heights.
fn span(values: &[f32], what: Shown) -> (f32, f32) {
    let Some((low, high)) = quantiles(values, 0.005, 0.995) else { return (0.0, 1.0) };
    let low = if what == Shown::Height { low } else { 0.0 };
    let high = if high > low { high } else { low + 1.0 };
    // The lowest tenth of the colours is nearly black: a plate that fills the map must stay visible.
    (if what == Shown::Height { low - 0.12 * (high - low) } else { low }, high)
}

fn shaded(c: Rgb, light: f32) -> Rgb {
    c.map(|v| (f32::from(v) * light).min(255.0) as u8)
}

/// 1, 2 or 5 times a power of ten: the largest that is not above `most`.
fn round_number(most: f64) -> f64 {
    let power = 10f64.powf(most.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * power).find(|v| *v <= most * 1.000_001).unwrap_or(power)
}

fn number(v: f64, step: f64) -> String {
    let digits = (-step.log10().floor()).max(0.0) as usize;
    // Print -0 as 0.
    format!("{:.digits$}", if v.abs() < step / 1e3 { 0.0 } else { v })
}

fn value_scale(picture: &mut RgbImage, x: i64, y: i64, height: i64, span: (f32, f32), unit: &str, what: Shown) {
    let (low, high) = (f64::from(span.0), f64::from(span.1));
    for i in 0..height {
        let v = 1.0 - i as f32 / (height - 1) as f32;
        let ink = match what {
            Shown::Height | Shown::Sigma => colour::ordered(v),
            _ => colour::grey(0.12 + 0.88 * v),
        };
        picture.fill(x, y + i, 22, 1, ink);
    }
    let step = round_number((high - low) / 4.0);
    let mut tick = (low / step).ceil() * step;
    while tick <= high + step * 1e-6 {
        let at = y + ((high - tick) / (high - low) * (height - 1) as f64).round() as i64;
        picture.fill(x + 22, at, 6, 1, INK);
        picture.text(x + 33, (at - 7).max(0), 2, INK, &number(tick, step));
        tick += step;
    }
    picture.text(x, y + height + 14, 2, INK, unit);
}

fn length_bar(picture: &mut RgbImage, x: i64, y: i64, mm_per_pixel: f64, width: i64) {
    let length = round_number(width as f64 * mm_per_pixel / 4.0);
    let pixels = (length / mm_per_pixel).round() as i64;
    picture.fill(x, y + 4, pixels, 3, INK);
    picture.fill(x, y, 2, 11, INK);
    picture.fill(x + pixels - 2, y, 2, 11, INK);
    let label = format!("{} mm", number(length, length));
    picture.text(x + pixels / 2 - text_width(&label, 2) / 2, y + 16, 2, INK, &label);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Rigid;

    #[test]
    fn marks_land_on_their_cells_and_y_points_up() {
        let mut map = HeightMap::empty(40, 20, 0.5, Rigid::identity());
        map.z.fill(0.0);
        map.z[3 * 40 + 30] = 7.0;
        let (picture, place) = map.picture(Shown::Height);
        let (x, y) = place.pixel(30.5 * 0.5, 3.5 * 0.5);
        let at = |x: f64, y: f64| picture.pixels[y as usize * picture.width as usize + x as usize];
        let (high, low) = (at(x, y), at(place.pixel(5.0, 5.0).0, place.pixel(5.0, 5.0).1));
        assert!(high[0] > 150 && low[0] < 100, "{high:?} {low:?}");
        // A low y is at the bottom of the picture.
        assert!(y > f64::from(picture.height) / 2.0);
    }

    #[test]
    fn an_empty_map_still_makes_a_picture() {
        let map = HeightMap::empty(3, 2, 0.1, Rigid::identity());
        for what in [Shown::Height, Shown::Intensity, Shown::Sigma, Shown::Coverage] {
            assert!(map.picture(what).0.width > 100);
        }
    }

    #[test]
    fn scales_have_round_numbers() {
        for (most, want) in [(0.3, 0.2), (1.0, 1.0), (26.0, 20.0), (7.0, 5.0), (0.012, 0.01)] {
            assert!((round_number(most) - want).abs() < 1e-12, "{most}");
        }
        assert_eq!(number(-0.0, 0.5), "0.0");
        assert_eq!(number(2.5, 0.5), "2.5");
    }
}
