//! In: a picture, the matches found in it, their model. Out: the picture for people with each match's edges, number
//! and reference point.
//! Frame and unit: pixels of the picture.

use super::full::Match;
use super::refine::Pose;
use crate::find::model::shape_model::ShapeModel;
use crate::raster::{Image, Rgb, RgbImage};

/// Colours that distinguish neighbouring matches, on grey.
const COLOURS: [Rgb; 6] =
    [[60, 255, 60], [255, 200, 40], [80, 200, 255], [255, 90, 220], [255, 120, 60], [180, 255, 220]];
/// Half an arm of the cross at the reference point, px.
const ARM_PX: f64 = 6.0;

/// Draws every match: its edges as short lines along them, its number, a cross whose longer arm points along the
/// template's x.
pub fn draw(image: &Image, model: &ShapeModel, matches: &[Match]) -> RgbImage {
    let mut out = RgbImage::from_grey(image);
    for (number, m) in matches.iter().enumerate() {
        let colour = COLOURS[number % COLOURS.len()];
        edges(&mut out, model, &m.pose, colour);
        let (s, c) = m.pose.angle.sin_cos();
        let at = |along: f64, across: f64| {
            (m.pose.x + ARM_PX * (c * along - s * across), m.pose.y + ARM_PX * (s * along + c * across))
        };
        out.line(at(-1.0, 0.0), at(2.5, 0.0), colour);
        out.line(at(0.0, -1.0), at(0.0, 1.0), colour);
        let (x, y) = at(1.0, 1.5);
        out.text(x.round() as i64, y.round() as i64, 1, colour, &(number + 1).to_string());
    }
    out
}

/// Draws a template's edges where they were taught; `reference` is the position of its reference point, px.
pub fn draw_model(image: &Image, model: &ShapeModel, reference: [f64; 2]) -> RgbImage {
    let mut out = RgbImage::from_grey(image);
    edges(&mut out, model, &Pose { x: reference[0], y: reference[1], angle: 0.0, scale: 1.0 }, COLOURS[0]);
    out
}

fn edges(out: &mut RgbImage, model: &ShapeModel, pose: &Pose, colour: Rgb) {
    for p in &model.levels[0] {
        let (x, y, nx, ny) = pose.place(p);
        out.line((x - ny, y + nx), (x + ny, y - nx), colour);
    }
}
