//! In: a shot's picture and its peaks. Out: the picture with every peak drawn, coloured by its fate.
//! Frame and unit: pixels of the shot.

use crate::raster::{Image, Rgb, RgbImage};
use crate::stages::peak::{Peak, Reject};

/// Colour of a peak's fate; kept is green, everything else is told apart by hue.
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
    }
}

/// Draws all peaks, the kept ones last.
pub fn draw(image: &Image, peaks: &[Peak]) -> RgbImage {
    let mut picture = RgbImage::from_grey(image);
    for kept in [false, true] {
        for k in peaks.iter().filter(|k| k.kept() == kept) {
            picture.set(k.u.round() as i64, k.v.round() as i64, colour(k.reject()));
        }
    }
    picture
}
