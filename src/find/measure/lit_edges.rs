//! In: the points of a scan near a part whose pose is known to some tenths of a millimetre. Out: its place and turn,
//! from the share of the sheet's light that each sample beside an edge still returns (docs/math.md, Insertion (3) and
//! (4)).
//! Frame and unit: a correction in the part frame: x y mm, turn about z rad; light as a share of a fully lit sample's.

use super::edge_pieces::{N, Prior, Row, Solved, Unknowns, solve};
use super::options::MeasureOptions;
use super::points::Ordered;
use super::robust::median;
use super::shape::{Shape, shape_row};
use crate::find::model::drawn_edges::EdgeSample;
use crate::find::model::edge_index::EdgeIndex;
use crate::find::model::face::Face;
use crate::geometry::{Base, Camera, Part, Rigid, Vec3};
use nalgebra::{Matrix3, Rotation2, Vector2, Vector3};

/// Prior mean and standard deviation of growth and width, in the recipe's unit of about 1 mm, like the lengths below.
/// Optics blur a stripe's end by about a pixel, and a laser line is about a tenth of a millimetre wide. Both are
/// measured where edges are sharp.
const PRIORS: [Prior; 4] = [(3, 0.0, 0.05), (4, 0.0, 0.05), (5, 0.25, 0.15), (6, 0.12, 0.08)];
/// Prior standard deviations of the sizes: fixed to the drawing where the part is placed, nearly free where they are
/// measured.
const DRAWN: f64 = 1e-9;
const FREE: f64 = 0.1;

fn priors(unit: f64, sizes: f64) -> Vec<Prior> {
    let known = PRIORS.map(|(k, mean, sd)| (k, mean * unit, sd * unit));
    known.into_iter().chain((7..N).map(|k| (k, 0.0, sizes))).collect()
}
/// Least width of the fall: with a sharper one, single samples would decide.
const SHARPEST: f64 = 0.03;
/// A sample this far inside an edge is fully lit; the largest distance from an edge at which a sample measures it.
const DEEP: f64 = 0.6;
const NEAR: f64 = 0.8;
/// Edges farther away than this do not reduce a sample's light.
const BEYOND: f64 = 1.0;
/// The full light of a partly lit sample comes from fully lit samples around it, within the first of these distances
/// that holds enough. Between a row of pins and an edge, none are near.
const AROUND: [f64; 4] = [1.6, 3.2, 6.4, 12.8];
const MIN_FULL: usize = 6;
/// A second edge at least this many widths away dims a sample slightly, which is predicted; with a nearer one, the
/// sample is skipped.
const APART: f64 = 1.5;
/// Range of use, in widths inside the edge. A sample lit by less than half may show another surface's light; more than
/// 2.5 widths inside, no light is missing.
const USED: [f64; 2] = [0.0, 2.5];
const MIN_SAMPLES: usize = 60;
const ROUNDS: usize = 6;
/// Least number of shots, and of points in each, for the scatter of the robot's reported poses from height noise. The
/// factor accounts for the scatter of its turns, which act over the length of the tool and show in the plane only.
const MIN_SHOTS: usize = 8;
const TURNS_TOO: f64 = 1.4;

/// The place, turn and, if requested, sizes that the light of the samples gives.
pub(in crate::find) struct Lit {
    /// Correction x, y, turn.
    pub step: Vector3<f64>,
    pub covariance: Matrix3<f64>,
    pub shape: Shape,
    pub samples: usize,
    /// Robust deviation of the light from the model, as a share of full light.
    pub sigma: f64,
}

struct Sample {
    at: Vector2<f64>,
    /// Directions along the stripe and from shot to shot, at this shot.
    directions: [Vector2<f64>; 2],
    light: f64,
    row: u32,
    z: f64,
}

/// Fits the unknowns from a start; returns also the number of samples used in the last round.
fn settle(
    samples: &[Sample],
    edges: &EdgeIndex,
    priors: &[Prior],
    mut x: Unknowns,
    noise: [f64; 2],
) -> Option<(Unknowns, Solved, usize)> {
    let unit = edges.unit();
    let mut last = None;
    for _ in 0..ROUNDS {
        let rows: Vec<Row> = samples.iter().filter_map(|s| row(s, edges, &x)).collect();
        if rows.len() < MIN_SAMPLES {
            return None;
        }
        let solved = solve(&rows, &x, priors, noise, unit)?;
        x += solved.step;
        (5..7).for_each(|k| x[k] = x[k].max(SHARPEST * unit));
        last = Some((solved, rows.len()));
    }
    let (solved, used) = last?;
    Some((x, solved, used))
}

/// Fits the light of the samples beside locating edges; `None` where too few are seen. With `shape` the part's sizes
/// are unknowns too, and start from it.
pub(in crate::find) fn fit_light(
    points: &Ordered,
    pose: &Rigid<Base, Part>,
    (local, faces): (&[Option<Vec3>], &[Face]),
    edges: &EdgeIndex,
    options: &MeasureOptions,
    shape: Option<Vector3<f64>>,
) -> Option<Lit> {
    let on: Vec<Option<f64>> = local.iter().map(|q| face_of(q.as_ref()?, faces, options.height_gate_mm)).collect();
    let unit = edges.unit();
    let turns = turns(points, local, pose);
    let [along, across] = sampling(points, local, &on, &turns)?;
    let slant = slant(points, local, &turns, unit);
    let deep: Vec<bool> = (0..on.len())
        .map(|i| {
            let (Some(q), Some(z)) = (&local[i], on[i]) else { return false };
            faces.iter().any(|f| f.z == z && f.material(q.x, q.y))
                && edges.nearest(q.x, q.y, DEEP * unit, |s| s.z == z).is_none()
        })
        .collect();
    let mut samples = Vec::new();
    for i in (0..on.len()).filter(|&i| !deep[i]) {
        let (Some(q), Some(z)) = (&local[i], on[i]) else { continue };
        if edges.nearest(q.x, q.y, NEAR * unit, |s| s.z == z && s.locates).is_none() {
            continue;
        }
        let Some(full) = full_light(points, local, &deep, &on, i, [along.norm(), across.norm()], unit) else {
            continue;
        };
        // Where the middle of the sheet meets the surface: the middle of a cut-off spot is not the middle of the sheet.
        let (row, turn) = (points.row[i], turns[points.row[i] as usize]);
        let at = Vector2::new(q.x, q.y) + turn * slant * (q.z - z);
        let directions = [turn * along.normalize(), turn * across.normalize()];
        samples.push(Sample { at, directions, light: f64::from(points.intensity[i]) / full, row, z });
    }
    let scatter = TURNS_TOO * pose_scatter(points, local, &deep, &on);
    let bias = options.edge_bias * along.norm().max(across.norm());
    let mut x = Unknowns::zeros();
    let priors = priors(unit, if shape.is_some() { FREE } else { DRAWN });
    priors.iter().for_each(|p| x[p.0] = p.1);
    x.fixed_rows_mut::<3>(7).copy_from(&shape.unwrap_or_default());
    let (x, solved, samples) = settle(&samples, edges, &priors, x, [bias, scatter])?;
    let block = |k: usize| Matrix3::from(solved.covariance.fixed_view::<3, 3>(k, k));
    Some(Lit {
        step: Vector3::new(x[0], x[1], x[2]),
        covariance: block(0),
        shape: Shape { strain: Vector3::new(x[7], x[8], x[9]), covariance: block(7) },
        samples,
        sigma: solved.sigma,
    })
}

fn face_of(q: &Vec3, faces: &[Face], gate: f64) -> Option<f64> {
    faces.iter().map(|f| f.z).find(|z| (q.z - z).abs() <= gate)
}

/// How far each row's shot is turned about the part's normal relative to the shot that saw the part's middle: on a
/// turntable the stripe crosses a part in another direction at every place. No turn where the camera's pose is unknown.
fn turns(points: &Ordered, local: &[Option<Vec3>], pose: &Rigid<Base, Part>) -> Vec<Rotation2<f64>> {
    let on: Vec<u32> = (0..local.len()).filter(|&i| local[i].is_some()).map(|i| points.row[i]).collect();
    let middle = on.get(on.len() / 2).and_then(|row| points.from_camera[*row as usize]);
    let into_part = pose.rotation.transpose();
    let turn = |camera: &Option<Rigid<Base, Camera>>| {
        let (Some(camera), Some(middle)) = (camera, &middle) else { return Rotation2::identity() };
        let r = into_part * camera.rotation * middle.rotation.transpose() * pose.rotation;
        Rotation2::new((r[(1, 0)] - r[(0, 1)]).atan2(r[(0, 0)] + r[(1, 1)]))
    };
    points.from_camera.iter().map(turn).collect()
}

/// The median steps between neighbouring samples along the stripe and from shot to shot, in the part's plane, in the
/// directions of the shot that saw its middle.
fn sampling(
    points: &Ordered,
    local: &[Option<Vec3>],
    on: &[Option<f64>],
    turns: &[Rotation2<f64>],
) -> Option<[Vector2<f64>; 2]> {
    let step = |dr: i64, dc: i64| {
        let (mut x, mut y) = (vec![], vec![]);
        for i in (0..on.len()).filter(|&i| on[i].is_some()) {
            let next = points.at(i64::from(points.row[i]) + dr, i64::from(points.column[i]) + dc);
            if let (Some(p), Some(q)) = (&local[i], next.filter(|&n| on[n] == on[i]).and_then(|n| local[n])) {
                let step = turns[points.row[i] as usize].inverse() * (q - p).xy();
                x.push(step.x);
                y.push(step.y);
            }
        }
        (x.len() >= 20).then(|| Vector2::new(median(x), median(y))).filter(|s| s.norm() > 0.0)
    };
    Some([step(0, 1)?, step(1, 0)?])
}

/// How far the sheet moves in the part's plane for a millimetre of height, in the directions of the shot that saw the
/// part's middle. It is derived from the shots' points, which lie in the sheet; zero where they all lie on one line.
fn slant(points: &Ordered, local: &[Option<Vec3>], turns: &[Rotation2<f64>], unit: f64) -> Vector2<f64> {
    let mut rows = std::collections::BTreeMap::<u32, Vec<Vec3>>::new();
    for (q, row) in local.iter().zip(&points.row) {
        if let Some(q) = q {
            let flat = turns[*row as usize].inverse() * q.xy();
            rows.entry(*row).or_default().push(Vec3::new(flat.x, flat.y, q.z));
        }
    }
    let (mut scatter, mut n) = (Matrix3::zeros(), 0.0);
    for list in rows.values().filter(|l| l.len() > 10) {
        let mean = list.iter().sum::<Vec3>() / list.len() as f64;
        list.iter().for_each(|p| scatter += (p - mean) * (p - mean).transpose());
        n += list.len() as f64;
    }
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let normal = eigen.eigenvectors.column(order[0]);
    let flat = Vector2::new(normal.x, normal.y);
    // Needs 0.3 units of height differences, and a sheet that is not parallel to the surface.
    let told = n > 0.0 && (eigen.eigenvalues[order[1]] / n).sqrt() > 0.3 * unit && flat.norm() > 0.1;
    if told { flat * (normal.z / flat.norm_squared()) } else { Vector2::zeros() }
}

/// Mean light of the fully lit samples around a sample.
fn full_light(
    points: &Ordered,
    local: &[Option<Vec3>],
    deep: &[bool],
    on: &[Option<f64>],
    i: usize,
    step: [f64; 2],
    unit: f64,
) -> Option<f64> {
    let q = local[i]?;
    for around in AROUND.map(|a| a * unit) {
        let reach = step.map(|s| (around / s).ceil().min(80.0) as i64);
        // A few hundred samples are enough.
        let stride = reach.map(|r| (r / 8).max(1) as usize);
        let (mut sum, mut n) = (0.0, 0usize);
        for dr in (-reach[1]..=reach[1]).step_by(stride[1]) {
            for dc in (-reach[0]..=reach[0]).step_by(stride[0]) {
                let there = points.at(i64::from(points.row[i]) + dr, i64::from(points.column[i]) + dc);
                let Some(k) = there.filter(|&k| deep[k] && on[k] == on[i]) else { continue };
                if local[k].is_some_and(|p| (p - q).norm() < around) {
                    sum += f64::from(points.intensity[k]);
                    n += 1;
                }
            }
        }
        if n >= MIN_FULL && sum > 0.0 {
            return Some(sum / n as f64);
        }
    }
    None
}

/// Standard deviation of the shots' heights beyond their points' noise: the scatter of the poses, mm.
fn pose_scatter(points: &Ordered, local: &[Option<Vec3>], deep: &[bool], on: &[Option<f64>]) -> f64 {
    let mut shots = std::collections::BTreeMap::<u32, Vec<f64>>::new();
    for i in (0..deep.len()).filter(|&i| deep[i]) {
        if let (Some(q), Some(z)) = (&local[i], on[i]) {
            shots.entry(points.row[i]).or_default().push(q.z - z);
        }
    }
    let (mut means, mut noise) = (vec![], vec![]);
    for list in shots.values().filter(|l| l.len() >= MIN_SHOTS) {
        let n = list.len() as f64;
        let mean = list.iter().sum::<f64>() / n;
        means.push(mean.abs());
        // The stripe is smoothed along itself: about three neighbours share one noise value.
        noise.push(list.iter().map(|z| (z - mean).powi(2)).sum::<f64>() / n / (n / 3.0));
    }
    if means.len() < MIN_SHOTS {
        return 0.0;
    }
    let (all, own) = (1.4826 * median(means), median(noise));
    (all * all - own).max(0.0).sqrt()
}

/// The predicted light of a sample, its derivatives, and which piece of which edge it measures.
fn row(s: &Sample, edges: &EdgeIndex, x: &Unknowns) -> Option<Row> {
    let directions = &s.directions;
    let (sin, cos) = x[2].sin_cos();
    let (dx, dy) = (s.at.x - x[0], s.at.y - x[1]);
    let (px, py) = (cos * dx + sin * dy, cos * dy - sin * dx);
    // The place in the drawing that corresponds to this one on a part of these sizes.
    let (px, py) = (px - x[7] * px - 0.5 * x[9] * py, py - x[8] * py - 0.5 * x[9] * px);
    let edge = edges.nearest_locating(px, py, NEAR * edges.unit(), s.z)?;
    let EdgeSample { nx, ny, .. } = *edge;
    let (t, share, width) = widths_inside(edge, px, py, x, directions);
    if !(USED[0]..USED[1]).contains(&t) {
        return None;
    }
    // A curved edge's normal changes along it: its own samples are not a second edge.
    let same = |o: &EdgeSample| (o.shape, o.element) == (edge.shape, edge.element) && o.curvature != 0.0;
    let other = edges.nearest(px, py, BEYOND * edges.unit(), |o| o.z == s.z && o.nx * nx + o.ny * ny < 0.8 && !same(o));
    let spared = match other.map(|o| widths_inside(o, px, py, x, directions).0) {
        Some(t) if t < APART => return None,
        Some(t) => fall(t).0,
        None => 1.0,
    };
    let (lit, slope) = fall(t);
    let (lit, slope) = (lit * spared, slope * spared / width);
    let mut j = Unknowns::zeros();
    j[0] = slope * nx;
    j[1] = slope * ny;
    j[2] = slope * (px * ny - py * nx);
    for k in 0..2 {
        j[3 + k] = slope * share[k];
        j[5 + k] = -slope * t * x[5 + k] * share[k] / width;
    }
    for (k, by) in shape_row(px, py, nx, ny).into_iter().enumerate() {
        j[7 + k] = slope * by;
    }
    Some(Row { j, residual: s.light - lit, shot: s.row, slope, normal: [nx, ny], piece: edges.piece(edge, px, py) })
}

/// Distance of a place inside an edge in widths of the light's fall, the shares of the two directions in its normal,
/// and that width in mm. The light falls off along a curved edge as well: a disc's rim is lit less, and a hole's rim
/// more, than a straight edge.
fn widths_inside(
    edge: &EdgeSample,
    px: f64,
    py: f64,
    x: &Unknowns,
    directions: &[Vector2<f64>; 2],
) -> (f64, [f64; 2], f64) {
    let EdgeSample { nx, ny, .. } = *edge;
    let share = directions.map(|d| (nx * d.x + ny * d.y).powi(2));
    let width = (x[5].powi(2) * share[0] + x[6].powi(2) * share[1]).sqrt();
    let beside = x[5].powi(2) * share[1] + x[6].powi(2) * share[0];
    let inside = (edge.x - px) * nx + (edge.y - py) * ny - 0.5 * edge.curvature * beside;
    ((inside + x[3] * share[0] + x[4] * share[1]) / width, share, width)
}

/// Share of a Gaussian sheet that falls on the surface when its middle is `t` widths inside, and its derivative.
fn fall(t: f64) -> (f64, f64) {
    let density = (-0.5 * t * t).exp() / (2.0 * std::f64::consts::PI).sqrt();
    // Abramowitz and Stegun 26.2.17: error below 7.5e-8.
    let k = 1.0 / (1.0 + 0.231_641_9 * t.abs());
    let poly =
        k * (0.319_381_53 + k * (-0.356_563_782 + k * (1.781_477_937 + k * (-1.821_255_978 + k * 1.330_274_429))));
    let upper = 1.0 - density * poly;
    (if t >= 0.0 { upper } else { 1.0 - upper }, density)
}
