//! In: a report of an insertion with its height map. Out: a picture for people: the heights as the page shows them,
//! with the drawing at the measured pose and the part's axes.
//! Frame and unit: pixels of that picture; the grid's y goes up.

use super::locate::Report;
use crate::find::model::drawing::Drawing;
use crate::geometry::Vec3;
use crate::raster::RgbImage;
use crate::scan::Shown;

const PASSED: [u8; 3] = [255, 255, 255];
const FAILED: [u8; 3] = [255, 40, 200];
const X_AXIS: [u8; 3] = [255, 60, 60];
const Y_AXIS: [u8; 3] = [60, 255, 60];

/// Draws the map with the part where it was found: white when every gate was passed, magenta otherwise.
pub fn draw(report: &Report, drawing: &Drawing) -> RgbImage {
    let (mut image, place) = report.map.picture(Shown::Height);
    let grid_from_part = report.map.base_from_grid.inverse() * report.base_from_part;
    let at = |v: Vec3| {
        let q = grid_from_part.point(&v);
        place.pixel(q.x, q.y)
    };
    let colour = if report.passed { PASSED } else { FAILED };
    for (points, closed) in drawing.polylines() {
        let n = points.len();
        let corner = |i: usize| at(Vec3::new(points[i % n][0], points[i % n][1], 0.0));
        for i in 0..if closed { n } else { n - 1 } {
            image.line(corner(i), corner(i + 1), colour);
        }
    }
    let b = drawing.bounds();
    let arm = 0.25 * (b[2] - b[0]).max(b[3] - b[1]);
    image.line(at(Vec3::zeros()), at(Vec3::x() * arm), X_AXIS);
    image.line(at(Vec3::zeros()), at(Vec3::y() * 0.5 * arm), Y_AXIS);
    image
}
