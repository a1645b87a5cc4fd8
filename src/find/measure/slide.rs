//! In: the points of a scan, a drawing, a pose that may be shifted along a long part. Out: the shift at
//! which most points lie where the drawing says.
//! Frame and unit: part frame, mm. Long parallel edges fit at every shift (the aperture problem), so the
//! search alone cannot tell; what lies at the part's ends can.

use super::datum::laid;
use super::options::MeasureOptions;
use super::points::Ordered;
use crate::find::model::drawing::Drawing;
use crate::geometry::{Base, Part, Rigid, Vec3};

/// Length over width from which a part counts as long.
const LONG: f64 = 4.0;
/// Shifts that are tried: this share of the length to both sides, this far apart (in the recipe's unit).
const REACH: f64 = 0.3;
const STEP: f64 = 0.5;
/// A point this near to a face's height lies on it: the tilt is known only roughly; in the recipe's unit.
const GATE: f64 = 1.0;
/// Points that vote.
const VOTERS: usize = 3000;

/// 0 where the part is long in x, 1 in y, `None` where it is not long.
pub fn long_axis(drawing: &Drawing) -> Option<usize> {
    let b = drawing.bounds();
    let (w, h) = (b[2] - b[0], b[3] - b[1]);
    match () {
        () if w >= LONG * h => Some(0),
        () if h >= LONG * w => Some(1),
        () => None,
    }
}

/// The pose laid onto the part's faces and shifted along its long axis to where the points agree best; as it was for parts
/// that are not long.
pub fn slide(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Rigid<Base, Part> {
    let Some(axis) = long_axis(drawing) else { return start };
    let start = laid(points, drawing, start, options);
    let faces = drawing.faces();
    let b = drawing.bounds();
    let unit = options.unit();
    let reach = REACH * (b[axis + 2] - b[axis]);
    let part_from_base = start.inverse();
    let grown = |k: usize, q: f64| {
        let around = 2.0 * unit + if k == axis { reach } else { 0.0 };
        q > b[k] - around && q < b[k + 2] + around
    };
    let near: Vec<Vec3> =
        points.points.iter().map(|p| part_from_base.point(p)).filter(|q| grown(0, q.x) && grown(1, q.y)).collect();
    let stride = (near.len() / VOTERS).max(1);
    let agreement = |shift: f64| -> i64 {
        let mut votes = 0;
        for q in near.iter().step_by(stride) {
            let mut p = *q;
            p[axis] -= shift;
            for f in &faces {
                let on = (p.z - f.z).abs() < GATE * unit;
                match (f.material(p.x, p.y), on) {
                    (true, true) => votes += 1,
                    (true, false) | (false, true) => votes -= 1,
                    (false, false) => {}
                }
            }
        }
        votes
    };
    let step = STEP * unit;
    let n = (reach / step).round() as i64;
    let best = (-n..=n).map(|k| k as f64 * step).max_by_key(|&s| (agreement(s), -(s.abs() / unit * 10.0) as i64));
    let mut by = Vec3::zeros();
    by[axis] = best.unwrap_or(0.0);
    start * Rigid::<Part, Part>::from_vectors(&Vec3::zeros(), by)
}
