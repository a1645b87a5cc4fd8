//! In: a shot's picture and its peaks. Out: the part of the picture with the stripe, enlarged. Every peak is drawn
//! at its sub-pixel position in the colour of its rejection reason, with a legend that counts them.
//! Frame and unit: pixels of the shot.

use crate::raster::{Image, Rgb, RgbImage, text_width};
use crate::stages::peak::found::{Peak, Reject};

/// Colour of a peak's rejection reason: accepted peaks are green, each reason has another hue.
pub fn colour(fate: Reject) -> Rgb {
    match fate {
        Reject::Kept => [0, 230, 60],
        Reject::Region => [120, 120, 120],
        Reject::Faint => [90, 90, 255],
        Reject::Narrow => [255, 255, 0],
        Reject::Wide => [255, 140, 0],
        Reject::Uncertain => [200, 110, 255],
        Reject::Steep => [0, 220, 255],
        Reject::Echo => [255, 0, 0],
        Reject::Unsupported => [255, 0, 200],
        Reject::NoPoint => [255, 255, 255],
        Reject::Mixed => [150, 170, 0],
    }
}

/// Rows shown above and below the outermost peaks, px.
const MARGIN: i64 = 40;
/// The picture is enlarged by an integer factor until it is at least this wide, px.
const WIDE: u32 = 1200;
const LEGEND: i64 = 30;

/// Draws all peaks, the accepted ones last. It shows only the rows around the accepted peaks, or around all peaks if
/// none was accepted. Grey levels follow a square-root curve, because reflections are faint.
pub fn draw(image: &Image, peaks: &[Peak]) -> RgbImage {
    let any_kept = peaks.iter().any(Peak::kept);
    let rows = peaks.iter().filter(|k| k.kept() || !any_kept).map(|k| k.v.round() as i64);
    let height = i64::from(image.height);
    let middle = height / 2;
    let top = (rows.clone().min().unwrap_or(middle) - MARGIN).clamp(0, height - 1);
    let bottom = (rows.max().unwrap_or(middle) + MARGIN).clamp(top, height - 1);
    let scale = i64::from(WIDE.div_ceil(image.width).clamp(1, 8));
    let shown = (bottom - top + 1) * scale;
    let mut picture = RgbImage::filled(image.width * scale as u32, (shown + LEGEND) as u32, [18, 20, 24]);
    let full = f32::from(image.full_scale());
    for y in top..=bottom {
        for x in 0..image.width {
            let level = f32::from(image.get(x, y as u32)) / full;
            let grey = [(level.sqrt() * 255.0) as u8; 3];
            picture.fill(i64::from(x) * scale, (y - top) * scale, scale, scale, grey);
        }
    }
    // The centre of pixel (0, 0) lies half an enlarged pixel inside the picture.
    let at = |p: f32| ((f64::from(p) + 0.5) * scale as f64 - 0.5).round() as i64;
    for kept in [false, true] {
        for k in peaks.iter().filter(|k| k.kept() == kept) {
            let (x, y) = (at(k.u), at(k.v) - top * scale);
            let ink = colour(k.reject());
            picture.set(x, y, ink);
            if !kept {
                // Rejected peaks are few and must be visible: they get a small cross.
                for d in 1..=scale + 1 {
                    [(d, 0), (-d, 0), (0, d), (0, -d)].iter().for_each(|(dx, dy)| picture.set(x + dx, y + dy, ink));
                }
            }
        }
    }
    let mut x = 10;
    for fate in Reject::ALL {
        let count = peaks.iter().filter(|k| k.reject() == fate).count();
        if count > 0 {
            let label = format!("{} {count}", fate.words());
            picture.fill(x, shown + 9, 12, 12, colour(fate));
            picture.text(x + 18, shown + 8, 2, [226, 230, 235], &label);
            x += 18 + text_width(&label, 2) + 18;
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_are_drawn_where_they_are_and_counted() {
        let image = Image::from_u8(640, 200, vec![0; 640 * 200]);
        let peak = |u: f32, v: f32, flags: u32| Peak { u, v, flags, ..bytemuck::Zeroable::zeroed() };
        let echo = peak(300.25, 120.0, 0);
        let picture = draw(&image, &[echo, peak(100.0, 100.0, 0)]);
        assert_eq!(picture.width, 1280);
        // Rows 60..=160 are shown, enlarged twice; u 300.25 is at (300.75 * 2 - 0.5).
        assert_eq!(picture.height as i64, (160 - 60 + 1) * 2 + LEGEND);
        let row = (120 - 60) * 2;
        let lit = |x: i64| [row, row + 1].iter().any(|y| picture.pixels[(y * 1280 + x) as usize][1] > 100);
        assert!(lit(601) && !lit(590));
        assert_eq!(draw(&image, &[]).width, 1280);
    }
}
