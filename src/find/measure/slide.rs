//! In: the points of a scan, a drawing, a pose that may be shifted, along a long part or by a shadow. Out: the shift at
//! which most points agree with the drawing.
//! Frame and unit: part frame, mm. Long parallel edges fit at every shift (the aperture problem), so the search alone
//! cannot decide; the points at the part's ends can.

use super::datum::laid;
use super::options::MeasureOptions;
use super::points::Ordered;
use crate::find::model::drawing::Drawing;
use crate::find::model::face::Face;
use crate::geometry::{Base, Part, Rigid, Vec3};

/// Length over width from which a part counts as long.
const LONG: f64 = 4.0;
/// Range of the tried shifts as a share of the length to both sides, and their spacing in the recipe's unit.
const REACH: f64 = 0.3;
const STEP: f64 = 0.5;
/// Range of the shifts in all directions, where a shadow may have misled the search, in the recipe's unit of about 1
/// mm.
const SHADOW: f64 = 4.0;
/// Height tolerance for a point to lie on a face, in the recipe's unit: the tilt is known only roughly.
const GATE: f64 = 1.0;
/// Number of points that vote, about.
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

/// The voters: points around a part whose pose is roughly known, in the part frame, and the part's faces.
struct Voters {
    points: Vec<Vec3>,
    faces: Vec<Face>,
    gate: f64,
}

impl Voters {
    /// Points within `around` of the part's box, mm in x and y.
    fn new(points: &Ordered, drawing: &Drawing, pose: &Rigid<Base, Part>, around: [f64; 2], unit: f64) -> Voters {
        let (b, part_from_base) = (drawing.bounds(), pose.inverse());
        let near = |q: &Vec3| (0..2).all(|k| q[k] > b[k] - around[k] && q[k] < b[k + 2] + around[k]);
        let all: Vec<Vec3> = points.points.iter().map(|p| part_from_base.point(p)).filter(near).collect();
        let stride = (all.len() / VOTERS).max(1);
        Voters { points: all.into_iter().step_by(stride).collect(), faces: drawing.faces(), gate: GATE * unit }
    }

    /// Points on a face that is drawn there, less those that contradict a part shifted by `by`.
    fn agree(&self, by: [f64; 2]) -> i64 {
        let vote = |q: &Vec3, f: &Face| match (f.material(q.x - by[0], q.y - by[1]), (q.z - f.z).abs() < self.gate) {
            (true, true) => 1,
            (false, false) => 0,
            _ => -1,
        };
        self.points.iter().map(|q| self.faces.iter().map(|f| vote(q, f)).sum::<i64>()).sum()
    }
}

fn shifted(pose: Rigid<Base, Part>, by: [f64; 2]) -> Rigid<Base, Part> {
    pose * Rigid::<Part, Part>::from_vectors(&Vec3::zeros(), Vec3::new(by[0], by[1], 0.0))
}

/// The pose laid onto the part's faces and shifted along its long axis to where the points agree best; unchanged for
/// parts that are not long.
pub fn slide(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Rigid<Base, Part> {
    let Some(axis) = long_axis(drawing) else { return start };
    let start = laid(points, drawing, start, options);
    let (b, unit) = (drawing.bounds(), options.unit());
    let reach = REACH * (b[axis + 2] - b[axis]);
    let along = |v: f64| [0, 1].map(|k| if k == axis { v } else { 0.0 });
    let around = along(reach).map(|r| r + 2.0 * unit);
    let voters = Voters::new(points, drawing, &start, around, unit);
    let step = STEP * unit;
    let n = (reach / step).round() as i64;
    let best = (-n..=n)
        .map(|k| k as f64 * step)
        .max_by_key(|&s| (voters.agree(along(s)), -(s.abs() / unit * 10.0) as i64))
        .unwrap_or(0.0);
    shifted(start, along(best))
}

/// The pose laid onto the part's faces and shifted to where the points around it agree best. A shadow beside a part
/// has as straight an edge as the part, and windows have theirs on the same side: a map's edges fit a part that is
/// shifted by the length of its shadow nearly as well. The points do not: none lies in a shadow.
pub fn settle(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Rigid<Base, Part> {
    let unit = options.unit();
    let start = laid(points, drawing, start, options);
    let voters = Voters::new(points, drawing, &start, [SHADOW * unit; 2], unit);
    let n = (SHADOW / STEP).round() as i64;
    let shifts = (-n..=n).flat_map(|j| (-n..=n).map(move |i| [i, j]));
    let best = shifts.max_by_key(|s| (voters.agree(s.map(|k| k as f64 * STEP * unit)), -(s[0] * s[0] + s[1] * s[1])));
    shifted(start, best.unwrap_or_default().map(|k| k as f64 * STEP * unit))
}
