//! In: the points of a scan near a part. Out: where its surfaces end, along the stripe and from shot to shot
//! (docs/math.md, Insertion (2)).
//! Frame and unit: part frame, mm; light as a share of a fully lit sample's.

use super::options::MeasureOptions;
use super::points::Ordered;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::Vec3;

/// The end of a surface, seen between two neighbouring samples.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Place in the part frame, mm.
    pub x: f64,
    /// Along the part's y, mm.
    pub y: f64,
    /// Distance beyond the drawn edge (positive: the surface reaches farther), and the edge's normal.
    pub residual: f64,
    /// x of the drawn edge's unit normal, away from the material.
    pub nx: f64,
    /// y of the drawn edge's unit normal.
    pub ny: f64,
    /// 0 along the stripe, 1 from shot to shot.
    pub axis: usize,
    /// Row of the ordered points, one a shot, whose sample ends there.
    pub row: u32,
    /// Index of the drawing's shape that the edge belongs to.
    pub shape: usize,
    /// Element of that shape's grid, row by row, from 0.
    pub element: usize,
    /// Took part in locating the part.
    pub locates: bool,
    /// Weight in the robust fit, 0 to 1; stays 1 where the end does not locate.
    pub weight: f64,
}

/// An edge is taken from samples that cross it at up to 53 degrees from its normal, so that edges at 45
/// degrees to the sweep are seen along the stripe and from shot to shot.
const LEAST_COSINE: f64 = 0.6;

/// Ends of surfaces: a sample on a face whose next neighbour is not. The end lies where the light that
/// the last samples still send back says: a sample that is lit by half counts as half a step.
pub(in crate::find) fn surface_ends(
    points: &Ordered,
    local: &[Option<Vec3>],
    faces: &[Face],
    edges: &EdgeIndex,
    options: &MeasureOptions,
    gate: f64,
) -> (Vec<Observation>, [f64; 2]) {
    let mut found: Vec<(Observation, f64, usize)> = Vec::new();
    let mut last_steps: [Vec<f64>; 4] = Default::default();
    let mut steps: [Vec<f64>; 2] = [vec![], vec![]];
    let stride = shot_stride(points);
    for (i, q) in local.iter().enumerate() {
        let Some(q) = q else { continue };
        for face in faces {
            if (q.z - face.z).abs() > options.height_gate_mm {
                continue;
            }
            let (row, column) = (i64::from(points.row[i]), i64::from(points.column[i]));
            for (side, (axis, dr, dc)) in [(0, 0, 1), (0, 0, -1), (1, 1, 0), (1, -1, 0)].into_iter().enumerate() {
                let (next, before) = ((row + dr, column + dc), (row - dr, column - dc));
                if !points.covers(next.0, next.1) || !consecutive(points, row, dr, stride) {
                    continue;
                }
                let on = |k: usize| local[k].is_some_and(|p| (p.z - face.z).abs() <= options.height_gate_mm);
                let Some(b) = points.at(before.0, before.1).filter(|&b| on(b)) else { continue };
                let n = points.at(next.0, next.1);
                let p = local[b].expect("on the face");
                let (dx, dy) = (q.x - p.x, q.y - p.y);
                let length = dx.hypot(dy);
                if !(0.005..2.0).contains(&(length / options.unit())) {
                    continue;
                }
                if n.is_some_and(on) {
                    if steps[axis].len() < 4000 {
                        steps[axis].push(length);
                    }
                    continue;
                }
                // Light of the last sample and, where it still shows near the face, of the next one.
                let full = f64::from(points.intensity[b]).max(1e-6);
                let mut lit = (f64::from(points.intensity[i]) / full).min(1.0);
                if let Some(n) =
                    n.filter(|&n| local[n].is_some_and(|p| (p.z - face.z).abs() <= 2.0 * options.height_gate_mm))
                {
                    lit += (f64::from(points.intensity[n]) / full).min(1.0);
                }
                let template = Observation {
                    x: p.x,
                    y: p.y,
                    residual: lit,
                    nx: dx / length,
                    ny: dy / length,
                    axis,
                    row: points.row[i],
                    shape: 0,
                    element: 0,
                    locates: true,
                    weight: 1.0,
                };
                last_steps[side].push(length);
                found.push((template, face.z, side));
            }
        }
    }
    let median = |mut s: Vec<f64>| {
        if s.is_empty() {
            return 0.0;
        }
        let middle = s.len() / 2;
        *s.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let step = steps.map(median);
    // The last sample is lit in part, so its place lies back from the sheet's: by less on the side where
    // a wall below the edge still shows, by more on the side of the shadow. The usual last step of a
    // side is therefore the ruler for that side, not the step between full samples.
    let rulers = last_steps.map(median);
    let observations = found
        .into_iter()
        .filter_map(|(o, z, side)| {
            let reach = rulers[side] * (0.5 + o.residual);
            let (x, y) = (o.x + o.nx * reach, o.y + o.ny * reach);
            // The nearest edge of any direction: at a corner or beside a hole none is taken for another.
            let s = edges.nearest(x, y, gate, |s| s.z == z)?;
            if s.nx * o.nx + s.ny * o.ny < LEAST_COSINE {
                return None;
            }
            let residual = (x - s.x) * s.nx + (y - s.y) * s.ny;
            let (shape, element, locates) = (s.shape, s.element, s.locates);
            Some(Observation { x, y, residual, nx: s.nx, ny: s.ny, shape, element, locates, ..o })
        })
        .collect();
    (observations, step)
}

/// The usual difference of shot numbers between rows.
fn shot_stride(points: &Ordered) -> u32 {
    points.shot.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(1)
}

/// From shot to shot an end is known only where no shot is missing before and behind it.
fn consecutive(points: &Ordered, row: i64, dr: i64, stride: u32) -> bool {
    if dr == 0 {
        return true;
    }
    let gap = |a: i64, b: i64| points.shot[a.max(b) as usize] - points.shot[a.min(b) as usize];
    let (next, before) = (row + dr, row - dr);
    before >= 0 && before < points.shot.len() as i64 && gap(row, next) == stride && gap(row, before) == stride
}
