//! In: a scan. Out: its nearly flat pieces of surface, and the one nearest to a place.
//! Frame and unit: base frame, mm. docs/math.md, Registration.

use crate::find::measure::points::Ordered;
use crate::geometry::{Mat3, Vec3};
use std::collections::HashMap;

/// A nearly flat piece of surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub at: Vec3,
    /// Towards the camera.
    pub normal: Vec3,
    /// Distance to the next sample in the shorter direction, mm; sine of the angle between normal and line of sight.
    pub step: f64,
    pub lean: f64,
    /// The point in its middle, and the row of that point.
    pub point: usize,
    pub row: u32,
}

/// Number of pieces of a scan; samples to each side of a piece's middle; least number of samples in a piece; largest
/// square of its thickness over its width.
const PIECES: usize = 4000;
const BESIDE: i64 = 3;
const MIN_SAMPLES: usize = 24;
const FLAT: f64 = 0.01;
/// Two pieces belong to one surface only if the cosine between their normals exceeds this.
const FACING: f64 = 0.9;
/// Largest distance between two scans of one object, mm.
pub(super) const FARTHEST: f64 = 5.0;

pub(super) fn pieces(points: &Ordered) -> Vec<Piece> {
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
    if !(eigen.eigenvalues[order[0]] < FLAT * eigen.eigenvalues[order[1]]) {
        return None;
    }
    let normal: Vec3 = eigen.eigenvectors.column(order[0]).into();
    let sight = points.from_camera[points.row[i] as usize].map_or(normal, |c| (c.translation - at).normalize());
    let normal = if normal.dot(&sight) < 0.0 { -normal } else { normal };
    // A line of 2 BESIDE + 1 samples scatters by twice their step.
    let step = (eigen.eigenvalues[order[1]] / around.len() as f64).sqrt() / 2.0;
    let lean = normal.cross(&sight).norm();
    Some(Piece { at, normal, step, lean, point: i, row: points.row[i] })
}

/// The first scan: some of its pieces, sorted into cells. A walk leads from the nearest of them to the nearest of all
/// points.
pub(super) struct Surface<'a> {
    points: &'a Ordered,
    pieces: &'a [Piece],
    cells: HashMap<[i32; 3], Vec<usize>>,
}

impl<'a> Surface<'a> {
    pub fn key(p: &Vec3) -> [i32; 3] {
        [p.x, p.y, p.z].map(|v| (v / FARTHEST).floor() as i32)
    }
    pub fn new(points: &'a Ordered, pieces: &'a [Piece]) -> Surface<'a> {
        let mut cells = HashMap::<_, Vec<usize>>::new();
        pieces.iter().enumerate().for_each(|(i, p)| cells.entry(Surface::key(&p.at)).or_default().push(i));
        Surface { points, pieces, cells }
    }
    /// The flat piece around the nearest point within `gate` that faces like `normal`. The pieces in cells lie
    /// millimetres apart: over that distance a plane leaves a curved surface by more than the error that is sought.
    /// With `among_all` false, the search stops at the nearest piece in the cells: from afar that attracts over a wider
    /// range.
    pub fn nearest(&self, p: &Vec3, normal: &Vec3, gate: f64, among_all: bool) -> Option<Piece> {
        let [x, y, z] = Surface::key(p);
        let around = (-1..=1).flat_map(|a| (-1..=1).flat_map(move |b| (-1..=1).map(move |c| [x + a, y + b, z + c])));
        let near = around.filter_map(|k| self.cells.get(&k)).flatten().map(|&i| &self.pieces[i]);
        let close = near.filter(|q| (q.at - p).norm() < gate && faces(q, normal));
        let from = close.min_by(|a, b| (a.at - p).norm_squared().total_cmp(&(b.at - p).norm_squared()))?;
        if !among_all {
            return Some(*from);
        }
        let found = piece(self.points, self.walk(from.point, p)).filter(|q| faces(q, normal));
        Some(found.unwrap_or(*from))
    }
    /// Walks from a point to the nearest one, neighbour by neighbour.
    fn walk(&self, from: usize, to: &Vec3) -> usize {
        let off = |i: usize| (self.points.points[i] - to).norm_squared();
        let mut here = from;
        loop {
            let (row, column) = (i64::from(self.points.row[here]), i64::from(self.points.column[here]));
            let beside = (-BESIDE..=BESIDE)
                .flat_map(|r| (-BESIDE..=BESIDE).filter_map(move |c| self.points.at(row + r, column + c)));
            match beside.min_by(|&a, &b| off(a).total_cmp(&off(b))) {
                Some(next) if off(next) < off(here) => here = next,
                _ => return here,
            }
        }
    }
}

fn faces(q: &Piece, normal: &Vec3) -> bool {
    q.normal.dot(normal).abs() > FACING
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::{Along, CloudPoint, Shots};
    use glam::Vec3 as Point;

    /// The top of a ball of 9 mm in steps of 0.02 mm: the planes of the pieces in cells leave it, those around the
    /// nearest points do not.
    #[test]
    fn the_nearest_piece_lies_on_the_curved_surface_beside_a_place() {
        const RADIUS: f32 = 4.5;
        let place = |row: u32, column: u32| {
            let (x, y) = (0.02 * column as f32 - 2.0, 0.02 * row as f32 - 2.0);
            Point::new(x, y, (RADIUS * RADIUS - x * x - y * y).sqrt())
        };
        let cloud: Vec<CloudPoint> = (0..200)
            .flat_map(|row| (0..200).map(move |column| (row, column)))
            .map(|(row, column)| CloudPoint {
                position: place(row, column),
                sigma_mm: 0.01,
                intensity: 100.0,
                quality: 1.0,
                shot: row,
                u: column as f32,
                v: 100.0,
            })
            .collect();
        let points = Ordered::new(&cloud, &Shots::unplaced(Along::U)).unwrap();
        // As few pieces as a scan a hundred times as long has for such a ball.
        let some: Vec<Piece> = pieces(&points).into_iter().step_by(97).collect();
        let surface = Surface::new(&points, &some);
        let (mut all, mut few): (f64, f64) = (0.0, 0.0);
        for (row, column) in (10..190).step_by(7).flat_map(|r| (10..190).step_by(7).map(move |c| (r, c))) {
            let p = Vec3::from(place(row, column).as_dvec3().to_array());
            let off = |q: Piece| q.normal.dot(&(p - q.at)).abs();
            all = all.max(off(surface.nearest(&p, &p.normalize(), 1.5, true).unwrap()));
            few = few.max(off(surface.nearest(&p, &p.normalize(), 1.5, false).unwrap()));
        }
        println!("planes lie {all:.5} mm beside the ball, those of some pieces {few:.5} mm");
        assert!(all < 1e-3 && few > 5e-3, "{all} {few}");
    }
}
