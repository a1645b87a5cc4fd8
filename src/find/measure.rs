//! In: the points of a scan, a drawing, a first pose. Out: the part's pose by least squares on the
//! points: heights of its faces give height and tilt, ends of its surfaces give place and turn
//! (docs/math.md, Insertion (1) to (4)).
//! Frame and unit: base_from_part; mm, rad; covariance over x y z rx ry rz about the part's own axes.

use super::drawing::{Drawing, EdgeSample, Face};
use super::points::Ordered;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Part, Rigid, Vec3};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, Vector3};
use std::collections::HashMap;

/// How the pose is measured.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureOptions {
    /// A point nearer than this to a face's height lies on that face, mm, 0.05 to 2.
    pub height_gate_mm: f64,
    /// An end of a surface this far from the drawn edge is still taken for that edge, mm, 0.1 to 3.
    pub edge_gate_mm: f64,
    /// Points nearer than this to an edge do not vote on height and tilt, mm, 0 to 3.
    pub margin_mm: f64,
    /// Standard deviation of what all edges of one kind have in common and the model of partly lit
    /// samples does not explain, as a share of the sampling step, 0 to 0.5.
    pub edge_bias: f64,
}

impl Default for MeasureOptions {
    fn default() -> Self {
        MeasureOptions { height_gate_mm: 0.2, edge_gate_mm: 0.45, margin_mm: 0.35, edge_bias: 0.06 }
    }
}

impl MeasureOptions {
    pub fn check(&self) -> Result<()> {
        let range = |name: &str, v: f64, a: f64, b: f64| {
            if (a..=b).contains(&v) { Ok(()) } else { Err(Fault::usage(format!("{name} is {v}, wanted {a} to {b}"))) }
        };
        range("height_gate_mm", self.height_gate_mm, 0.05, 2.0)?;
        range("edge_gate_mm", self.edge_gate_mm, 0.1, 3.0)?;
        range("margin_mm", self.margin_mm, 0.0, 3.0)?;
        range("edge_bias", self.edge_bias, 0.0, 0.5)
    }
}

/// The end of a surface, seen between two neighbouring samples.
#[derive(Clone, Copy, Debug)]
pub struct Observation {
    /// Place in the part frame, mm.
    pub x: f64,
    pub y: f64,
    /// Distance beyond the drawn edge (positive: the surface reaches farther), and the edge's normal.
    pub residual: f64,
    pub nx: f64,
    pub ny: f64,
    /// 0 along the stripe, 1 from shot to shot.
    pub axis: usize,
    pub row: u32,
    pub shape: usize,
    pub element: usize,
    /// Took part in locating the part.
    pub locates: bool,
    pub weight: f64,
}

/// A measured pose.
#[derive(Clone, Debug)]
pub struct Measured {
    pub base_from_part: Rigid<Base, Part>,
    pub covariance: Matrix6<f64>,
    /// Points that gave height and tilt, and their robust deviation, mm.
    pub surface_points: usize,
    pub surface_rms: f64,
    /// Surface ends that gave place and turn, and their robust deviation, mm.
    pub edges: usize,
    pub edge_rms: f64,
    /// How much farther than drawn surfaces reach along the stripe and from shot to shot, mm.
    pub growth: [f64; 2],
    /// Largest distance between neighbouring samples along the stripe and from shot to shot, mm.
    pub step: [f64; 2],
    pub observations: Vec<Observation>,
}

/// Edge samples in buckets.
pub struct EdgeIndex {
    samples: Vec<EdgeSample>,
    buckets: HashMap<(i32, i32), Vec<u32>>,
}

/// Edge length of a bucket, mm; no gate reaches farther than three of them.
const BUCKET: f64 = 1.0;
const SPACING: f64 = 0.05;

impl EdgeIndex {
    pub fn new(drawing: &Drawing) -> EdgeIndex {
        let samples: Vec<EdgeSample> = drawing.samples(SPACING).into_iter().filter(|s| s.measure).collect();
        let mut buckets: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
        for (i, s) in samples.iter().enumerate() {
            buckets.entry(Self::key(s.x, s.y)).or_default().push(i as u32);
        }
        EdgeIndex { samples, buckets }
    }
    fn key(x: f64, y: f64) -> (i32, i32) {
        ((x / BUCKET).floor() as i32, (y / BUCKET).floor() as i32)
    }
    /// The nearest sample within `gate` that passes `good`.
    pub fn nearest(&self, x: f64, y: f64, gate: f64, good: impl Fn(&EdgeSample) -> bool) -> Option<&EdgeSample> {
        let (kx, ky) = Self::key(x, y);
        let reach = (gate / BUCKET).ceil() as i32;
        let mut best: Option<(f64, &EdgeSample)> = None;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                for &i in self.buckets.get(&(kx + dx, ky + dy)).into_iter().flatten() {
                    let s = &self.samples[i as usize];
                    let d = (s.x - x).hypot(s.y - y);
                    if d <= gate && best.is_none_or(|b| d < b.0) && good(s) {
                        best = Some((d, s));
                    }
                }
            }
        }
        best.map(|b| b.1)
    }
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
    pub fn samples(&self) -> &[EdgeSample] {
        &self.samples
    }
}

/// Rounds of datum and edges; the pose moves by less than a micrometre in the last.
const ROUNDS: usize = 8;
/// A face needs so many points, an in-plane fit so many edges.
const MIN_SURFACE: usize = 60;
const MIN_EDGES: usize = 40;
/// An edge is taken from samples that cross it at up to 53 degrees from its normal, so that edges at 45
/// degrees to the sweep are seen along the stripe and from shot to shot.
const LEAST_COSINE: f64 = 0.6;
/// Standard deviation of where between two shots an edge is put, as a share of the step: the light of
/// partly lit samples tells it to about half of what a uniform phase (0.29) would leave.
const PHASE: f64 = 0.15;
/// Prior standard deviation of the growth of surfaces, mm: half a laser line.
const GROWTH_PRIOR: f64 = 0.05;

/// Measures the pose. Refuses when too little of the part is seen to determine it.
pub fn measure(
    points: &Ordered,
    drawing: &Drawing,
    start: Rigid<Base, Part>,
    options: &MeasureOptions,
) -> Result<Measured> {
    options.check()?;
    let faces = drawing.faces();
    let edges = EdgeIndex::new(drawing);
    if faces.is_empty() || edges.is_empty() {
        return Err(Fault::input("the drawing has no closed shape to measure on")
            .cause("only lines and arcs, or measure = false everywhere")
            .next("draw at least one rectangle, circle or polygon with inside = \"high\""));
    }
    let mut pose = start;
    let mut last = None;
    for round in 0..ROUNDS {
        let local = localise(points, drawing, &pose);
        let datum = fit_datum(points, &local, &faces, &edges, options, round)?;
        pose = pose
            * Rigid::<Part, Part>::from_vectors(
                &Vec3::new(datum.step[1], datum.step[2], 0.0),
                Vec3::new(0.0, 0.0, datum.step[0]),
            );
        let local = localise(points, drawing, &pose);
        let gate = if round < 2 { 2.0 * options.edge_gate_mm } else { options.edge_gate_mm };
        let (observations, step) = surface_ends(points, &local, &faces, &edges, options, gate);
        let plane = fit_edges(observations, &step, options)?;
        pose = pose
            * Rigid::<Part, Part>::from_vectors(
                &Vec3::new(0.0, 0.0, plane.step[2]),
                Vec3::new(plane.step[0], plane.step[1], 0.0),
            );
        last = Some((datum, plane, step));
    }
    let (datum, plane, step) = last.expect("at least one round");
    let mut covariance = Matrix6::zeros();
    // Datum unknowns are z, rx, ry; edge unknowns x, y, rz.
    for (i, a) in [2, 3, 4].into_iter().enumerate() {
        for (k, b) in [2, 3, 4].into_iter().enumerate() {
            covariance[(a, b)] = datum.covariance[(i, k)];
        }
    }
    for (i, a) in [0, 1, 5].into_iter().enumerate() {
        for (k, b) in [0, 1, 5].into_iter().enumerate() {
            covariance[(a, b)] = plane.covariance[(i, k)];
        }
    }
    Ok(Measured {
        base_from_part: pose,
        covariance,
        surface_points: datum.used,
        surface_rms: datum.sigma,
        edges: plane.used,
        edge_rms: plane.sigma,
        growth: plane.growth,
        step,
        observations: plane.observations,
    })
}

/// Points near the part in its own frame; `None` for the others.
pub fn localise(points: &Ordered, drawing: &Drawing, pose: &Rigid<Base, Part>) -> Vec<Option<Vec3>> {
    let b = drawing.bounds();
    let part_from_base = pose.inverse();
    points
        .points
        .iter()
        .map(|p| {
            let q = part_from_base.point(p);
            let near = q.x > b[0] - 3.0 && q.x < b[2] + 3.0 && q.y > b[1] - 3.0 && q.y < b[3] + 3.0;
            near.then_some(q)
        })
        .collect()
}

struct Datum {
    step: Vector3<f64>,
    covariance: Matrix3<f64>,
    used: usize,
    sigma: f64,
}

/// Height and tilt from the points inside the faces.
fn fit_datum(
    points: &Ordered,
    local: &[Option<Vec3>],
    faces: &[Face],
    edges: &EdgeIndex,
    options: &MeasureOptions,
    round: usize,
) -> Result<Datum> {
    let gate = if round == 0 { 4.0 * options.height_gate_mm } else { 2.0 * options.height_gate_mm };
    let mut rows: Vec<(Vector3<f64>, f64, u32)> = Vec::new();
    for (i, q) in local.iter().enumerate() {
        let Some(q) = q else { continue };
        let Some(face) = faces.iter().filter(|f| (q.z - f.z).abs() < gate).find(|f| f.material(q.x, q.y)) else {
            continue;
        };
        if edges.nearest(q.x, q.y, options.margin_mm, |s| s.z == face.z).is_none() {
            rows.push((Vector3::new(1.0, q.y, -q.x), q.z - face.z, points.row[i]));
        }
    }
    if rows.len() < MIN_SURFACE {
        return Err(Fault::refused(format!(
            "{} points lie on the part's level surfaces, at least {MIN_SURFACE} are needed",
            rows.len()
        ))
        .cause("the part is hidden, is another one, or the search was misled")
        .next("look at the picture of the match, then scan the part again"));
    }
    robust(&rows, &[], 0.005)
        .map(|f| Datum { step: f.step, covariance: f.covariance, used: f.used, sigma: f.sigma })
        .ok_or_else(|| {
            Fault::refused("the seen surfaces do not determine height and tilt")
                .cause("they lie on one line")
                .next("scan more of the part")
        })
}

/// Ends of surfaces: a sample on a face whose next neighbour is not. The end lies where the light that
/// the last samples still send back says: a sample that is lit by half counts as half a step.
fn surface_ends(
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
                if !(0.005..2.0).contains(&length) {
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

struct InPlane {
    step: Vector3<f64>,
    growth: [f64; 2],
    covariance: Matrix3<f64>,
    used: usize,
    sigma: f64,
    observations: Vec<Observation>,
}

fn fit_edges(mut observations: Vec<Observation>, step: &[f64; 2], options: &MeasureOptions) -> Result<InPlane> {
    let axes = [0, 1].map(|a| observations.iter().filter(|o| o.locates && o.axis == a).count());
    let locating = axes[0] + axes[1];
    if locating < MIN_EDGES {
        return Err(Fault::refused(format!(
            "{} ends of surfaces lie at the drawn edges ({} along the stripe, {} from shot to shot), at least {MIN_EDGES} are needed",
            locating,
            axes[0],
            axes[1]
        ))
        .cause("the part is hidden, is another one, or the search was misled")
        .next("look at the picture of the match, then scan the part again"));
    }
    let rows: Vec<(SVector<f64, 5>, f64, u32)> = observations
        .iter()
        .filter(|o| o.locates)
        .map(|o| {
            let mut j = SVector::<f64, 5>::zeros();
            j[0] = o.nx;
            j[1] = o.ny;
            j[2] = o.x * o.ny - o.y * o.nx;
            j[3 + o.axis] = 1.0;
            (j, o.residual, o.row)
        })
        .collect();
    let fit = robust(&rows, &[(3, GROWTH_PRIOR), (4, GROWTH_PRIOR)], 0.03).ok_or_else(|| {
        Fault::refused("the seen edges do not determine the part's place and turn")
            .cause("only edges of one direction are seen")
            .next("scan more of the part")
    })?;
    for (o, w) in observations.iter_mut().filter(|o| o.locates).zip(&fit.weights) {
        o.weight = *w;
    }
    let mut covariance: Matrix3<f64> = fit.covariance.fixed_view::<3, 3>(0, 0).into();
    // From shot to shot an edge that runs along the stripe is seen by one or two shots only, and all its
    // samples share the place of those shots against it: one measurement each, however many columns.
    let mut shared: HashMap<(u32, bool), Vector3<f64>> = HashMap::new();
    let mut normal = Matrix3::zeros();
    for o in observations.iter().filter(|o| o.locates && o.weight > 0.0) {
        let j = Vector3::new(o.nx, o.ny, o.x * o.ny - o.y * o.nx) * o.weight;
        normal += j * j.transpose() / o.weight;
        if o.axis == 1 {
            let ascending = if o.nx.abs() > o.ny.abs() { o.nx > 0.0 } else { o.ny > 0.0 };
            *shared.entry((o.row, ascending)).or_insert_with(Vector3::zeros) += j;
        }
    }
    if let Some(inverse) = normal.try_inverse() {
        let phase = PHASE * step[1];
        let middle = shared.values().map(|j| j * j.transpose()).sum::<Matrix3<f64>>() * (phase * phase);
        covariance += inverse * middle * inverse;
    }
    // What all edges of a kind have in common shifts the part as a whole.
    let bias = options.edge_bias * step[0].max(step[1]);
    covariance[(0, 0)] += bias * bias;
    covariance[(1, 1)] += bias * bias;
    let far = observations.iter().filter(|o| o.locates).map(|o| o.x * o.x + o.y * o.y);
    let span = far.sum::<f64>() / locating as f64;
    covariance[(2, 2)] += bias * bias / span.max(1.0);
    Ok(InPlane {
        step: fit.step.fixed_rows::<3>(0).into(),
        growth: [fit.step[3], fit.step[4]],
        covariance,
        used: fit.used,
        sigma: fit.sigma,
        observations,
    })
}

struct Fit<const N: usize> {
    step: SVector<f64, N>,
    covariance: SMatrix<f64, N, N>,
    used: usize,
    sigma: f64,
    weights: Vec<f64>,
}

/// Tukey-weighted least squares of `residual = j . step` with priors (unknown, sigma) around zero. Rows
/// of one shot share its pose's error, so the covariance is the sandwich over shots. `floor`: least
/// robust sigma, mm.
fn robust<const N: usize>(rows: &[(SVector<f64, N>, f64, u32)], priors: &[(usize, f64)], floor: f64) -> Option<Fit<N>> {
    const TUKEY: f64 = 3.0;
    let mut step = SVector::<f64, N>::zeros();
    let mut weights = vec![1.0; rows.len()];
    let mut sigma = 1.0f64;
    let mut inverse = SMatrix::<f64, N, N>::zeros();
    for round in 0..15 {
        let mut size: Vec<f64> = rows.iter().map(|(j, r, _)| (r - j.dot(&step)).abs()).collect();
        let middle = size.len() / 2;
        sigma = (1.4826 * *size.select_nth_unstable_by(middle, f64::total_cmp).1).max(floor);
        let (mut a, mut b) = (SMatrix::<f64, N, N>::zeros(), SVector::<f64, N>::zeros());
        for ((j, r, _), w) in rows.iter().zip(&mut weights) {
            let u = (r - j.dot(&step)) / (TUKEY * sigma);
            *w = if round == 0 { 1.0 } else { (1.0 - u * u).max(0.0).powi(2) };
            a += *w * j * j.transpose();
            b += *w * *r * j;
        }
        for &(k, prior) in priors {
            a[(k, k)] += (sigma / prior).powi(2);
        }
        let scale = SVector::<f64, N>::from_fn(|k, _| a[(k, k)].max(1e-300).sqrt().recip());
        let unit = SMatrix::<f64, N, N>::from_fn(|i, k| a[(i, k)] * scale[i] * scale[k]);
        let decomposed = nalgebra::Cholesky::new(unit)?;
        // The smallest pivot of a unit-diagonal matrix is near 0 where a motion is free.
        if (0..N).any(|k| decomposed.l()[(k, k)] < 1e-3) {
            return None;
        }
        let inv = decomposed.inverse();
        inverse = SMatrix::<f64, N, N>::from_fn(|i, k| inv[(i, k)] * scale[i] * scale[k]);
        step = inverse * b;
    }
    let mut by_shot: HashMap<u32, SVector<f64, N>> = HashMap::new();
    for ((j, r, shot), w) in rows.iter().zip(&weights) {
        *by_shot.entry(*shot).or_insert_with(SVector::zeros) += *w * (r - j.dot(&step)) * j;
    }
    let clusters = by_shot.len() as f64;
    let middle = by_shot.values().map(|g| g * g.transpose()).sum::<SMatrix<f64, N, N>>()
        * (clusters / (clusters - N as f64).max(1.0));
    let used = weights.iter().filter(|w| **w > 0.0).count();
    let sandwich = inverse * middle * inverse;
    let plain = inverse * (sigma * sigma);
    // Few shots make the sandwich optimistic: never below the plain estimate.
    let covariance = if (0..N).all(|k| sandwich[(k, k)] >= plain[(k, k)]) {
        sandwich
    } else {
        let grow = (0..N).map(|k| plain[(k, k)] / sandwich[(k, k)].max(1e-300)).fold(1.0, f64::max).min(4.0);
        sandwich * grow
    };
    Some(Fit { step, covariance, used, sigma, weights })
}
