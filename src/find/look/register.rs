//! In: scans of one object without a drawing, from several sides, and the rig that took them. Out: the object's pose in
//! each scan relative to the first, with covariance, and how the rig's errors move it, as for scans of a part.
//! Frame and unit: base frame about the object's middle; mm, rad. docs/math.md, Registration.

use super::levers::{Answer, Seen, levers};
use super::part_seen::{middle, seen_by};
use super::pieces::{FARTHEST, Piece, Surface, pieces};
use crate::fault::{Fault, Result};
use crate::find::insert::budget::Budget;
use crate::find::measure::points::Ordered;
use crate::geometry::{Base, Part, Rigid, Vec3, exp};
use crate::rig::Rig;
use nalgebra::{Matrix6, SVector};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

type Vector6 = SVector<f64, 6>;

/// One scan of the object, compared with the first.
#[derive(Clone, Debug)]
pub struct Registered {
    /// Base axes about the object's middle, moved by how the scan differs from the first.
    pub base_from_object: Rigid<Base, Part>,
    /// The uncertainty of that pose, and how the rig's errors move it.
    pub budget: Budget,
    /// Share of its surface pieces that lie on those of the first scan.
    pub overlap: f64,
    /// Distance of these pieces from the first scan's surfaces, rms, mm.
    pub rms_mm: f64,
}

/// A piece of the scan, paired with one of the first scan.
struct Pair {
    /// Derivative of its distance by a step.
    row: Vector6,
    /// Its distance along the normal, mm.
    off: f64,
    /// Rows (shots) of the two pieces, the cell in which they lie, the direction in which they face.
    shots: [u32; 2],
    cell: [i32; 3],
    facing: [i32; 3],
    step: f64,
    lean: f64,
}

const MIN_MATCHED: usize = 60;
/// Prior standard deviation of a shift and a turn that no surface determines, mm and rad.
const UNKNOWN: [f64; 2] = [5.0, 0.05];
/// Errors of a stripe's centre along the surface's normal that do not average out, as shares of the sampling step,
/// standard deviations. `LEVEL_BIAS`: the pixels' raster, common to one place. `LEAN_BIAS`, times the lean's sine:
/// common to all surfaces that lean away from the camera in one direction. It stems from curvature within the light and
/// within the samples that are fitted together (balls of 9 mm in ten scans: 0.04 to 0.06).
const LEVEL_BIAS: f64 = 0.01;
const LEAN_BIAS: f64 = 0.07;
/// Number of directions that are distinguished for each unit of a normal's length.
const FACINGS: f64 = 2.0;
/// Rounds of one path to the optimum.
const ROUNDS: i32 = 25;
/// Starts of the paths, mm in x and y: surfaces of several directions have local optima beside the right one.
const STARTS: [[f64; 2]; 5] = [[0.0, 0.0], [2.0, 0.0], [-2.0, 0.0], [0.0, 2.0], [0.0, -2.0]];
/// Turns about the vertical from which the best path continues, rad: rows of pins have local optima a third of a degree
/// to both sides.
const TURNS: [f64; 3] = [-6e-3, 0.0, 6e-3];
/// Number of times that a better optimum is continued from with these turns: it may have better ones beside it again.
const FARTHER: usize = 4;
/// Least scale of the distances in the first round, mm; it is reduced by a third each round.
const WIDE: f64 = 0.5;
/// Number of last rounds with the distances' own scale.
const LAST: i32 = 5;
/// Number of first rounds that use only the pieces in cells: from afar these attract over a wider range.
const COARSE: i32 = 15;
/// Search distance for a partner in the last rounds, mm.
const NEAREST: f64 = 1.5;
const TUKEY: f64 = 4.0;

/// Derivative of a place's distance along its normal, by shift and turn about `centre`.
fn row(at: &Vec3, normal: &Vec3, centre: &Vec3) -> Vector6 {
    let turned = (at - centre).cross(normal);
    Vector6::new(normal.x, normal.y, normal.z, turned.x, turned.y, turned.z)
}

fn known() -> Matrix6<f64> {
    let [mm, rad] = UNKNOWN.map(|s| 1.0 / (s * s));
    Matrix6::from_diagonal(&Vector6::new(mm, mm, mm, rad, rad, rad))
}

struct Fit {
    /// Brings the scan's object onto the first one's: shift, turn about the centre.
    step: Vector6,
    covariance: Matrix6<f64>,
    matched: usize,
    rms: f64,
}

/// Tukey's weight of a distance, mm⁻².
fn weight(off: f64, sigma: f64) -> f64 {
    (1.0 - (off / (TUKEY * sigma)).powi(2)).max(0.0).powi(2) / (sigma * sigma)
}

/// Scatter of the scores, summed within each cluster [liang86].
fn clustered<K: Ord>(pairs: &[Pair], sigma: f64, by: impl Fn(&Pair) -> K) -> Matrix6<f64> {
    scatter(pairs, by, |p| p.row * (p.off * weight(p.off, sigma)))
}

/// Scatter of the scores that an offset of this size makes when it is common to each cluster.
fn common<K: Ord>(pairs: &[Pair], sigma: f64, by: impl Fn(&Pair) -> K, offset: impl Fn(&Pair) -> f64) -> Matrix6<f64> {
    scatter(pairs, by, |p| p.row * (offset(p) * weight(p.off, sigma)))
}

fn scatter<K: Ord>(pairs: &[Pair], by: impl Fn(&Pair) -> K, score: impl Fn(&Pair) -> Vector6) -> Matrix6<f64> {
    let mut scores = BTreeMap::<K, Vector6>::new();
    for p in pairs {
        *scores.entry(by(p)).or_default() += score(p);
    }
    scores.values().map(|g| g * g.transpose()).sum()
}

/// The pairs of a scan's pieces once the scan is moved by this step.
fn pairs(first: &Surface, moving: &[Piece], centre: &Vec3, step: &Vector6, gate: f64, among_all: bool) -> Vec<Pair> {
    let turn = exp(&Vec3::new(step[3], step[4], step[5]));
    let shift = Vec3::new(step[0], step[1], step[2]);
    let pair = |p: &Piece| {
        let at = centre + turn * (p.at - centre) + shift;
        let q = first.nearest(&at, &(turn * p.normal), gate, among_all)?;
        Some(Pair {
            row: row(&at, &q.normal, centre),
            off: -q.normal.dot(&(at - q.at)),
            shots: [p.row, q.row],
            cell: Surface::key(&q.at),
            facing: (q.normal * FACINGS).map(|v| v.round() as i32).into(),
            step: q.step,
            lean: q.lean,
        })
    };
    moving.par_iter().filter_map(pair).collect()
}

/// One path to an optimum.
struct Way {
    step: Vector6,
    inverse: Matrix6<f64>,
    pairs: Vec<Pair>,
    sigma: f64,
}

/// Brings pieces onto those of the first scan, point to plane [chen92]; directions that no surface determines stay
/// unchanged. The first `coarse` rounds use only the pieces in cells.
fn walk(first: &Surface, moving: &[Piece], centre: &Vec3, mut step: Vector6, coarse: i32) -> Option<Way> {
    let mut last = None;
    for round in 0..ROUNDS {
        let gate = (FARTHEST * 0.8f64.powi(round)).max(NEAREST);
        let pairs = pairs(first, moving, centre, &step, gate, round >= coarse);
        if pairs.len() < MIN_MATCHED {
            return None;
        }
        let mut sizes: Vec<f64> = pairs.iter().map(|p| p.off.abs()).collect();
        // Most pieces are flat and lie on one another from the start. The few that show a shift are outliers to their
        // scatter, so a larger scale is reduced round by round.
        let wide = WIDE * 0.65f64.powi(round);
        let sigma = crate::solve::robust_scale(&mut sizes, 1).max(if round + LAST < ROUNDS { wide } else { 1e-4 });
        let (mut normal, mut right) = (known(), Vector6::zeros());
        right -= known() * step;
        for p in &pairs {
            let w = weight(p.off, sigma);
            normal += w * p.row * p.row.transpose();
            right += w * p.off * p.row;
        }
        let inverse = normal.try_inverse()?;
        step += inverse * right;
        last = Some(Way { step, inverse, pairs, sigma });
    }
    last
}

/// The path that leaves the least of all pieces' distances. Pieces without a partner count as far off; the scale is
/// that of the path that fits best.
fn best_of(ways: &[Way], pieces: usize) -> Option<usize> {
    let scale = TUKEY * ways.iter().map(|w| w.sigma).min_by(f64::total_cmp)?;
    let left = |w: &Way| pieces as f64 - w.pairs.iter().map(|p| 1.0 - (p.off / scale).powi(2).min(1.0)).sum::<f64>();
    (0..ways.len()).min_by(|&a, &b| left(&ways[a]).total_cmp(&left(&ways[b])))
}

/// The best of the paths from several starts, continued from there with several turns while that finds a better one.
fn fit(first: &Surface, moving: &[Piece], centre: &Vec3) -> Option<Fit> {
    let start = |[x, y]: [f64; 2]| Vector6::new(x, y, 0.0, 0.0, 0.0, 0.0);
    let mut ways: Vec<Way> = STARTS.iter().filter_map(|&s| walk(first, moving, centre, start(s), COARSE)).collect();
    ways.extend(walk(first, moving, centre, start([0.0; 2]), 0));
    let mut best = best_of(&ways, moving.len())?;
    let mut turn = 0.0;
    for _ in 0..FARTHER {
        let from = ways[best].step;
        let turned = |more: f64| Vector6::new(from[0], from[1], from[2], 0.0, 0.0, turn + more);
        ways.extend(TURNS.iter().filter_map(|&more| walk(first, moving, centre, turned(more), 0)));
        let now = best_of(&ways, moving.len())?;
        if now == best {
            break;
        }
        (best, turn) = (now, ways[now].step[5]);
    }
    let way = ways.swap_remove(best);
    let Way { step, inverse, pairs, sigma } = way;
    // Pieces of one shot share its pose's error, in either scan. Pieces of one place share the effect of its slope and
    // its edges on a stripe's centre.
    let middle = clustered(&pairs, sigma, |p| p.shots[0])
        + clustered(&pairs, sigma, |p| p.shots[1])
        + clustered(&pairs, sigma, |p| p.cell)
        + common(&pairs, sigma, |p| p.cell, |p| LEVEL_BIAS * p.step)
        + common(&pairs, sigma, |p| p.facing, |p| LEAN_BIAS * p.step * p.lean)
        + known();
    let rms = (pairs.iter().map(|p| p.off.abs().min(TUKEY * sigma).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt();
    Some(Fit { step, covariance: inverse * middle * inverse, matched: pairs.len(), rms })
}

/// Registers two or more scans of one object, each with its name. Errors: fewer than two scans, a scan that does not
/// fit the rig, too few surfaces that both saw.
pub fn register(scans: &[(String, Ordered)], rig: &Rig) -> Result<Vec<Registered>> {
    let weak = |what: String| {
        Fault::refused(what)
            .cause("the object was moved, the scans hold too little of the same surfaces, or calibrations are far off")
            .next("scan an object with surfaces of several directions twice, from sides that both see them")
    };
    if scans.len() < 2 {
        return Err(Fault::usage(format!("{} scan of the object, two or more can be compared", scans.len()))
            .next("name the object's scans one by one"));
    }
    let all: Vec<Vec<Piece>> = scans.iter().map(|s| pieces(&s.1)).collect();
    if let Some((s, p)) = scans.iter().zip(&all).find(|(_, p)| p.len() < MIN_MATCHED) {
        return Err(weak(format!("{}: {} flat pieces of surface, {MIN_MATCHED} are needed", s.0, p.len())));
    }
    let first = Surface::new(&scans[0].1, &all[0]);
    let centre = all[0].iter().map(|p| p.at).sum::<Vec3>() / all[0].len() as f64;
    let mut out = Vec::new();
    for (i, ((name, points), pieces)) in scans.iter().zip(&all).enumerate() {
        let fit = match i {
            0 => {
                Fit { step: Vector6::zeros(), covariance: Matrix6::identity() * 1e-12, matched: pieces.len(), rms: 0.0 }
            }
            _ => fit(&first, pieces, &centre).ok_or_else(|| {
                weak(format!(
                    "{name}: fewer than {MIN_MATCHED} pieces lie within {FARTHEST} mm of the first scan's surfaces"
                ))
            })?,
        };
        let seen = seen_by(points, pieces.iter().map(|p| (p.row, p.point)));
        let [shift, turn] = [0, 3].map(|k| Vec3::new(fit.step[k], fit.step[k + 1], fit.step[k + 2]));
        let budget = budget(&seen, pieces, &centre, rig, fit.covariance)?
            .ok_or_else(|| weak(format!("{name}: the scan does not state its camera's poses")))?;
        out.push(Registered {
            // The scan's deviation is the inverse of the step that brings it back.
            base_from_object: Rigid::new(exp(&-turn), centre - shift),
            budget,
            overlap: fit.matched as f64 / pieces.len() as f64,
            rms_mm: fit.rms,
        });
    }
    Ok(out)
}

fn budget(
    seen: &[(usize, Seen)],
    pieces: &[Piece],
    centre: &Vec3,
    rig: &Rig,
    own: Matrix6<f64>,
) -> Result<Option<Budget>> {
    let normals: HashMap<usize, &Piece> = pieces.iter().map(|p| (p.point, p)).collect();
    let (seen, faces): (Vec<Seen>, Vec<&Piece>) = seen.iter().map(|(i, s)| (*s, normals[i])).unzip();
    let Some(base_from_camera) = middle(&seen, centre) else { return Ok(None) };
    let rows: Vec<Vector6> = faces.iter().map(|p| row(&p.at, &p.normal, centre)).collect();
    // Each piece has about its weight in the fit: directions that no surface determines do not follow either.
    let weight = 1e4;
    let normal = rows.iter().map(|j| j * j.transpose() * weight).sum::<Matrix6<f64>>() + known();
    let Some(follow) = normal.try_inverse().map(|n| n * weight) else { return Ok(None) };
    let levers = levers(&seen, rig, |moved| {
        let right: Vector6 = (0..rows.len()).map(|i| rows[i] * faces[i].normal.dot(&moved[i])).sum();
        let m = follow * right;
        Answer::from_iterator(m.iter().copied().chain([0.0; 3]))
    })?;
    let complete = levers.iter().all(|l| l.covariance.is_some());
    Ok(Some(Budget { complete, levers, base_from_camera: Some(base_from_camera), ..Budget::of_look(own) }))
}
