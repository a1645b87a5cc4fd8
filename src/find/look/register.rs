//! In: scans of one object that nobody drew, from several sides, the rig that took them. Out: where each scan puts the object
//! against the first one, with covariance, and how the rig's errors move it: looks at it, as at a part.
//! Frame and unit: base frame about the object's middle; mm, rad. docs/math.md, Registration.

use super::levers::{Answer, Seen, levers};
use super::part_seen::{middle, seen_by};
use crate::fault::{Fault, Result};
use crate::find::insert::budget::Budget;
use crate::find::measure::points::Ordered;
use crate::geometry::{Base, Mat3, Part, Rigid, Vec3, exp};
use crate::rig::Rig;
use nalgebra::{Matrix6, SVector};
use std::collections::{BTreeMap, HashMap};

type Vector6 = SVector<f64, 6>;

/// One scan of the object against the first.
#[derive(Clone, Debug)]
pub struct Registered {
    /// Base axes about the object's middle, moved by what the scan differs by.
    pub base_from_object: Rigid<Base, Part>,
    /// How uncertain that is, and how the rig's errors move it.
    pub budget: Budget,
    /// Share of its pieces of surface that lie on the first scan's, and their distance from it, rms, mm.
    pub overlap: f64,
    /// Distance of these pieces from the first scan's surfaces, rms, mm.
    pub rms_mm: f64,
}

/// A nearly flat piece of surface.
#[derive(Clone, Copy, Debug)]
struct Piece {
    at: Vec3,
    normal: Vec3,
    /// The point in its middle, and the row of that.
    point: usize,
    row: u32,
}

/// Pieces of a scan; samples to each side of one; the least of them that must be there, and how flat it is: its thickness over
/// its width, squared.
const PIECES: usize = 4000;
const BESIDE: i64 = 3;
const MIN_SAMPLES: usize = 24;
const FLAT: f64 = 0.01;
/// Pieces that face each other by less than this are not of one surface, cosine.
const FACING: f64 = 0.9;
const MIN_MATCHED: usize = 60;
/// A shift or turn that no surface tells is known so far, mm and rad.
const UNKNOWN: [f64; 2] = [5.0, 0.05];
/// Farthest that two scans of one object lie apart, mm.
const FARTHEST: f64 = 5.0;
const ROUNDS: i32 = 25;
const TUKEY: f64 = 4.0;

fn pieces(points: &Ordered) -> Vec<Piece> {
    let stride = points.points.len().div_ceil(PIECES).max(1);
    (0..points.points.len()).step_by(stride).filter_map(|i| piece(points, i)).collect()
}

fn piece(points: &Ordered, i: usize) -> Option<Piece> {
    let (row, column) = (i64::from(points.row[i]), i64::from(points.column[i]));
    let around: Vec<Vec3> = (-BESIDE..=BESIDE)
        .flat_map(|r| (-BESIDE..=BESIDE).filter_map(move |c| points.at(row + r, column + c)))
        .map(|k| points.points[k])
        .collect();
    if around.len() < MIN_SAMPLES {
        return None;
    }
    let at = around.iter().sum::<Vec3>() / around.len() as f64;
    let scatter: Mat3 = around.iter().map(|p| (p - at) * (p - at).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let flat = eigen.eigenvalues[order[0]] < FLAT * eigen.eigenvalues[order[1]];
    flat.then(|| Piece { at, normal: eigen.eigenvectors.column(order[0]).into(), point: i, row: points.row[i] })
}

/// Pieces in cells, so that the nearest is found at once.
struct Index<'a> {
    pieces: &'a [Piece],
    cells: HashMap<[i32; 3], Vec<usize>>,
}

impl<'a> Index<'a> {
    fn key(p: &Vec3) -> [i32; 3] {
        [p.x, p.y, p.z].map(|v| (v / FARTHEST).floor() as i32)
    }
    fn new(pieces: &'a [Piece]) -> Index<'a> {
        let mut cells = HashMap::<_, Vec<usize>>::new();
        pieces.iter().enumerate().for_each(|(i, p)| cells.entry(Index::key(&p.at)).or_default().push(i));
        Index { pieces, cells }
    }
    fn nearest(&self, p: &Vec3, normal: &Vec3, gate: f64) -> Option<&'a Piece> {
        let [x, y, z] = Index::key(p);
        let around = (-1..=1).flat_map(|a| (-1..=1).flat_map(move |b| (-1..=1).map(move |c| [x + a, y + b, z + c])));
        let near = around.filter_map(|k| self.cells.get(&k)).flatten().map(|&i| &self.pieces[i]);
        let close = near.filter(|q| (q.at - p).norm() < gate && q.normal.dot(normal).abs() > FACING);
        close.min_by(|a, b| (a.at - p).norm_squared().total_cmp(&(b.at - p).norm_squared()))
    }
}

/// A place with the normal along which a shift of it is seen.
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

/// Brings pieces onto those of the first scan, point to plane [chen92]; what no surface tells stays where it is.
fn fit(first: &Index, moving: &[Piece], centre: &Vec3) -> Option<Fit> {
    let mut step = Vector6::zeros();
    let mut last = None;
    for round in 0..ROUNDS {
        let gate = (FARTHEST * 0.8f64.powi(round)).max(0.3 * FARTHEST);
        let turn = exp(&Vec3::new(step[3], step[4], step[5]));
        let shift = Vec3::new(step[0], step[1], step[2]);
        let pairs: Vec<(Vector6, f64, u32, u32)> = moving
            .iter()
            .filter_map(|p| {
                let at = centre + turn * (p.at - centre) + shift;
                let q = first.nearest(&at, &(turn * p.normal), gate)?;
                Some((row(&at, &q.normal, centre), -q.normal.dot(&(at - q.at)), p.row, q.row))
            })
            .collect();
        if pairs.len() < MIN_MATCHED {
            return None;
        }
        let mut sizes: Vec<f64> = pairs.iter().map(|p| p.1.abs()).collect();
        let sigma = crate::solve::robust_scale(&mut sizes, 1).max(1e-4);
        let weight = |r: f64| (1.0 - (r / (TUKEY * sigma)).powi(2)).max(0.0).powi(2) / (sigma * sigma);
        let (mut normal, mut right) = (known(), Vector6::zeros());
        right -= known() * step;
        for (j, r, ..) in &pairs {
            normal += weight(*r) * j * j.transpose();
            right += weight(*r) * *r * j;
        }
        let inverse = normal.try_inverse()?;
        step += inverse * right;
        last = Some((inverse, pairs, sigma));
    }
    let (inverse, pairs, sigma) = last?;
    // Pieces of one shot share its pose's error, in either scan.
    let clustered = |by: &dyn Fn(&(Vector6, f64, u32, u32)) -> u32| {
        let mut shots = BTreeMap::<u32, Vector6>::new();
        for p in &pairs {
            let u: f64 = p.1 / (TUKEY * sigma);
            *shots.entry(by(p)).or_default() += p.0 * (p.1 * (1.0 - u * u).max(0.0).powi(2) / (sigma * sigma));
        }
        shots.values().map(|g| g * g.transpose()).sum::<Matrix6<f64>>()
    };
    let middle = clustered(&|p| p.2) + clustered(&|p| p.3) + known();
    let rms = (pairs.iter().map(|p| p.1.abs().min(TUKEY * sigma).powi(2)).sum::<f64>() / pairs.len() as f64).sqrt();
    Some(Fit { step, covariance: inverse * middle * inverse, matched: pairs.len(), rms })
}

/// Registers scans of one object, two or more, each given with what to call it. Errors: a scan that does not fit the rig, too few
/// surfaces that both saw.
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
    let index = Index::new(&all[0]);
    let centre = all[0].iter().map(|p| p.at).sum::<Vec3>() / all[0].len() as f64;
    let mut out = Vec::new();
    for (i, ((name, points), pieces)) in scans.iter().zip(&all).enumerate() {
        let fit = match i {
            0 => {
                Fit { step: Vector6::zeros(), covariance: Matrix6::identity() * 1e-12, matched: pieces.len(), rms: 0.0 }
            }
            _ => fit(&index, pieces, &centre).ok_or_else(|| {
                weak(format!(
                    "{name}: fewer than {MIN_MATCHED} pieces lie within {FARTHEST} mm of the first scan's surfaces"
                ))
            })?,
        };
        let seen = seen_by(points, pieces.iter().map(|p| (p.row, p.point)));
        let [shift, turn] = [0, 3].map(|k| Vec3::new(fit.step[k], fit.step[k + 1], fit.step[k + 2]));
        let budget = budget(&seen, pieces, &centre, rig, fit.covariance)
            .ok_or_else(|| weak(format!("{name}: the scan does not say how its camera stood")))?;
        out.push(Registered {
            // What brings the scan back is what it is off by.
            base_from_object: Rigid::new(exp(&-turn), centre - shift),
            budget,
            overlap: fit.matched as f64 / pieces.len() as f64,
            rms_mm: fit.rms,
        });
    }
    Ok(out)
}

fn budget(seen: &[(usize, Seen)], pieces: &[Piece], centre: &Vec3, rig: &Rig, own: Matrix6<f64>) -> Option<Budget> {
    let normals: HashMap<usize, &Piece> = pieces.iter().map(|p| (p.point, p)).collect();
    let (seen, faces): (Vec<Seen>, Vec<&Piece>) = seen.iter().map(|(i, s)| (*s, normals[i])).unzip();
    let base_from_camera = middle(&seen, centre)?;
    let rows: Vec<Vector6> = faces.iter().map(|p| row(&p.at, &p.normal, centre)).collect();
    // One piece weighs as it does in the fit, about: what no surface tells does not follow either.
    let weight = 1e4;
    let normal = rows.iter().map(|j| j * j.transpose() * weight).sum::<Matrix6<f64>>() + known();
    let follow = normal.try_inverse()? * weight;
    let levers = levers(&seen, rig, |moved| {
        let right: Vector6 = (0..rows.len()).map(|i| rows[i] * faces[i].normal.dot(&moved[i])).sum();
        let m = follow * right;
        Answer::from_iterator(m.iter().copied().chain([0.0; 3]))
    });
    let complete = levers.iter().all(|l| l.covariance.is_some());
    Some(Budget { complete, levers, base_from_camera: Some(base_from_camera), ..Budget::of_look(own) })
}
