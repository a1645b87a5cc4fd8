//! In: the points of a scan near a part. Out: where its surfaces end, along the stripe and from shot to shot
//! (docs/math.md, Insertion (2)).
//! Frame and unit: part frame, mm; light as a share of a fully lit sample's.

use super::options::MeasureOptions;
use super::points::Ordered;
use super::robust::median;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::Vec3;

/// The end of a surface, seen between two neighbouring samples.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Position along the part's x, mm.
    pub x: f64,
    /// Position along the part's y, mm.
    pub y: f64,
    /// Distance beyond the drawn edge, mm (positive: the surface reaches farther).
    pub residual: f64,
    /// x of the drawn edge's unit normal, away from the material.
    pub nx: f64,
    /// y of the drawn edge's unit normal.
    pub ny: f64,
    /// 0 along the stripe, 1 from shot to shot.
    pub axis: usize,
    /// Row of the ordered points, one for each shot, that holds the last sample.
    pub row: u32,
    /// Index of the drawing's shape that the edge belongs to.
    pub shape: usize,
    /// Element of that shape's grid, row by row, from 0.
    pub element: usize,
    /// True where the end takes part in locating the part.
    pub locates: bool,
    /// Weight in the robust fit, 0 to 1; stays 1 where the end does not locate.
    pub weight: f64,
}

/// Least cosine between a step from sample to sample and an edge's normal: up to 53 degrees. Edges at 45 degrees to the
/// sweep are thus seen both along the stripe and from shot to shot.
const LEAST_COSINE: f64 = 0.6;

/// The sides of a sample: the axis as in [`Observation::axis`], then the step to the next sample in rows and columns.
const SIDES: [(usize, i64, i64); 4] = [(0, 0, 1), (0, 0, -1), (1, 1, 0), (1, -1, 0)];
/// Most steps of an axis that enter their median.
const MOST_STEPS: usize = 4000;

/// The step to a sample on a face from the one before it.
struct Step {
    before: usize,
    /// The neighbour after the sample, on the face or not.
    next: Option<usize>,
    dx: f64,
    dy: f64,
    length: f64,
}

/// The end of a face at its last sample.
struct End {
    /// Position of the sample before the last one in the part frame, mm, and the direction from there.
    x: f64,
    y: f64,
    nx: f64,
    ny: f64,
    /// Light of the last sample and the next one, in units of a fully lit sample.
    lit: f64,
    /// Height of the face, mm.
    z: f64,
    /// Index into [`SIDES`].
    side: usize,
    row: u32,
}

/// Finds the ends of surfaces: samples on a face whose next neighbour is not on it. The light that the last samples
/// still return gives the place: a half-lit sample counts as half a step. Also returns the median steps between samples
/// along the stripe and from shot to shot, mm.
pub(in crate::find) fn surface_ends(
    points: &Ordered,
    local: &[Option<Vec3>],
    faces: &[Face],
    edges: &EdgeIndex,
    options: &MeasureOptions,
    gate: f64,
) -> (Vec<Observation>, [f64; 2]) {
    let samples = Samples { points, local, options, stride: shot_stride(points) };
    let mut found: Vec<End> = Vec::new();
    let mut last_steps: [Vec<f64>; 4] = Default::default();
    let mut steps: [Vec<f64>; 2] = [vec![], vec![]];
    for (i, q) in local.iter().enumerate() {
        let Some(q) = q else { continue };
        for face in faces {
            if (q.z - face.z).abs() > options.height_gate_mm {
                continue;
            }
            for (side, (axis, ..)) in SIDES.into_iter().enumerate() {
                let Some(step) = samples.step(i, q, face.z, side) else { continue };
                if !step.next.is_some_and(|n| samples.near(n, face.z, options.height_gate_mm)) {
                    last_steps[side].push(step.length);
                    found.push(samples.end(i, &step, face.z, side));
                } else if steps[axis].len() < MOST_STEPS {
                    steps[axis].push(step.length);
                }
            }
        }
    }
    // The last sample is partly lit, so its place lies behind the sheet's: by less on the side where a wall below the
    // edge still shows, by more on the side of the shadow. The median last step of a side is therefore the ruler for
    // that side, not the step between full samples.
    let rulers = last_steps.map(median);
    let observations = found.iter().filter_map(|end| end.at_edge(rulers[end.side], edges, gate)).collect();
    (observations, steps.map(median))
}

/// A scan's samples in the part frame.
struct Samples<'a> {
    points: &'a Ordered,
    local: &'a [Option<Vec3>],
    options: &'a MeasureOptions,
    stride: u32,
}

impl Samples<'_> {
    fn near(&self, k: usize, z: f64, gate: f64) -> bool {
        self.local[k].is_some_and(|p| (p.z - z).abs() <= gate)
    }

    /// The step to sample `i` at `q` on the face at `z`; `None` where its neighbours on that side and opposite give no
    /// information.
    fn step(&self, i: usize, q: &Vec3, z: f64, side: usize) -> Option<Step> {
        let (points, (_, dr, dc)) = (self.points, SIDES[side]);
        let (row, column) = (i64::from(points.row[i]), i64::from(points.column[i]));
        if !points.covers(row + dr, column + dc) || !consecutive(points, row, dr, self.stride) {
            return None;
        }
        let before = points.at(row - dr, column - dc).filter(|&b| self.near(b, z, self.options.height_gate_mm))?;
        let p = self.local[before].expect("on the face");
        let (dx, dy) = (q.x - p.x, q.y - p.y);
        let length = dx.hypot(dy);
        (0.005..2.0).contains(&(length / self.options.unit())).then(|| Step {
            before,
            next: points.at(row + dr, column + dc),
            dx,
            dy,
            length,
        })
    }

    /// The end with the light of the last sample `i` and, where it still shows near the face, of the next one.
    fn end(&self, i: usize, step: &Step, z: f64, side: usize) -> End {
        let intensity = &self.points.intensity;
        let full = f64::from(intensity[step.before]).max(1e-6);
        let light = |k: usize| (f64::from(intensity[k]) / full).min(1.0);
        let mut lit = light(i);
        if let Some(n) = step.next.filter(|&n| self.near(n, z, 2.0 * self.options.height_gate_mm)) {
            lit += light(n);
        }
        let p = self.local[step.before].expect("on the face");
        let (nx, ny) = (step.dx / step.length, step.dy / step.length);
        End { x: p.x, y: p.y, nx, ny, lit, z, side, row: self.points.row[i] }
    }
}

impl End {
    /// The end measured against the drawn edge; `None` where none is near in that direction. `ruler`: the median last
    /// step of the side.
    fn at_edge(&self, ruler: f64, edges: &EdgeIndex, gate: f64) -> Option<Observation> {
        let reach = ruler * (0.5 + self.lit);
        let (x, y) = (self.x + self.nx * reach, self.y + self.ny * reach);
        // The nearest edge in any direction is used: at a corner or beside a hole, no edge is mistaken for another.
        let s = edges.nearest(x, y, gate, |s| s.z == self.z)?;
        if s.nx * self.nx + s.ny * self.ny < LEAST_COSINE {
            return None;
        }
        Some(Observation {
            x,
            y,
            residual: (x - s.x) * s.nx + (y - s.y) * s.ny,
            nx: s.nx,
            ny: s.ny,
            axis: SIDES[self.side].0,
            row: self.row,
            shape: s.shape,
            element: s.element,
            locates: s.locates,
            weight: 1.0,
        })
    }
}

/// The least difference of shot numbers between rows.
fn shot_stride(points: &Ordered) -> u32 {
    points.shot.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(1)
}

/// From shot to shot, an end is known only where no shot is missing before or after it.
fn consecutive(points: &Ordered, row: i64, dr: i64, stride: u32) -> bool {
    if dr == 0 {
        return true;
    }
    let gap = |a: i64, b: i64| points.shot[a.max(b) as usize] - points.shot[a.min(b) as usize];
    let (next, before) = (row + dr, row - dr);
    before >= 0 && before < points.shot.len() as i64 && gap(row, next) == stride && gap(row, before) == stride
}
