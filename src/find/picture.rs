//! In: a report of an insertion with its height map. Out: a picture for people: heights in colours, the
//! drawing laid over them where the part was measured, its axes.
//! Frame and unit: height-map cells, each drawn as a square of pixels, y downwards along the rows.

use super::drawing::Drawing;
use super::insertion::Report;
use crate::geometry::{Part, Rigid, Vec3};
use crate::raster::RgbImage;
use crate::scan::HeightMap;

const MISSING: [u8; 3] = [24, 24, 28];
const PASSED: [u8; 3] = [255, 255, 255];
const FAILED: [u8; 3] = [255, 40, 200];
const X_AXIS: [u8; 3] = [255, 60, 60];
const Y_AXIS: [u8; 3] = [60, 255, 60];
/// The picture is made about this wide, px.
const WIDTH: u32 = 1200;

/// Draws the map with the part where it was found: white when every gate was passed, magenta otherwise.
pub fn draw(report: &Report, drawing: &Drawing) -> RgbImage {
    let map = &report.map;
    let zoom = (WIDTH / map.width.max(1)).clamp(1, 12);
    let mut image = heights(map, zoom);
    let grid_from_part = map.base_from_grid.inverse() * report.base_from_part;
    let colour = if report.passed { PASSED } else { FAILED };
    for (points, closed) in drawing.polylines() {
        let n = points.len();
        for i in 0..if closed { n } else { n - 1 } {
            let place = |p: [f64; 2]| pixel(&grid_from_part, &Vec3::new(p[0], p[1], 0.0), map.cell, zoom);
            image.line(place(points[i]), place(points[(i + 1) % n]), colour);
        }
    }
    let b = drawing.bounds();
    let arm = 0.25 * (b[2] - b[0]).max(b[3] - b[1]);
    let at = |v: Vec3| pixel(&grid_from_part, &v, map.cell, zoom);
    image.line(at(Vec3::zeros()), at(Vec3::x() * arm), X_AXIS);
    image.line(at(Vec3::zeros()), at(Vec3::y() * 0.5 * arm), Y_AXIS);
    image
}

fn pixel<G: crate::geometry::Frame>(t: &Rigid<G, Part>, p: &Vec3, cell: f64, zoom: u32) -> (f64, f64) {
    let q = t.point(p);
    (q.x / cell * f64::from(zoom), q.y / cell * f64::from(zoom))
}

/// Blue (low) over green to red (high) between the 2nd and 98th percentile.
fn heights(map: &HeightMap, zoom: u32) -> RgbImage {
    let (low, high) = map.quantiles(0.02, 0.98).unwrap_or((0.0, 1.0));
    let mut image = RgbImage::filled(map.width * zoom, map.height * zoom, MISSING);
    for iy in 0..map.height * zoom {
        for ix in 0..map.width * zoom {
            let z = map.z[(iy / zoom) as usize * map.width as usize + (ix / zoom) as usize];
            if z.is_finite() {
                let t = ((z - low) / (high - low).max(1e-6)).clamp(0.0, 1.0);
                let ramp = |centre: f32| ((1.5 - (4.0 * t - centre).abs()).clamp(0.0, 1.0) * 190.0) as u8;
                image.set(i64::from(ix), i64::from(iy), [ramp(3.0), ramp(2.0), ramp(1.0)]);
            }
        }
    }
    image
}
