//! In: a drawing. Out: its measurable edges in buckets, in which the nearest edge to a place is found quickly.
//! Frame and unit: part frame, mm.

use super::drawing::Drawing;
use super::drawn_edges::EdgeSample;

/// Edge samples in buckets.
pub struct EdgeIndex {
    samples: Vec<EdgeSample>,
    /// The recipe's unit of length, mm (`MeasureOptions::unit`).
    unit: f64,
    /// The samples' places by rows of buckets, and in a row by buckets.
    places: Vec<Place>,
    /// The rows that have samples: number, first place.
    rows: Vec<(i32, usize)>,
}

/// Where a sample is.
#[derive(Clone, Copy)]
struct Place {
    /// Bucket in its row.
    bucket: i32,
    sample: u32,
    at: [f64; 2],
}

/// Distance between samples, in units of the recipe.
const SPACING: f64 = 0.05;
/// Length of an edge piece whose samples share errors that are not modelled, in units. It is about three widths of the
/// sheet's light and a few samples, over which walls, chamfers and pixels change.
const PIECE: f64 = 4.0;

/// The bucket of a place along an axis: one unit wide.
fn key(unit: f64, v: f64) -> i32 {
    (v / unit).floor() as i32
}

impl EdgeIndex {
    /// The measurable edges of a drawing; `unit` is the recipe's unit of length, mm.
    pub fn new(drawing: &Drawing, unit: f64) -> EdgeIndex {
        let samples = drawing.samples(SPACING * unit).into_iter().filter(|s| s.measure).collect();
        EdgeIndex::of(samples, unit)
    }
    fn of(samples: Vec<EdgeSample>, unit: f64) -> EdgeIndex {
        let row = |at: [f64; 2]| key(unit, at[1]);
        let place = |(i, s): (usize, &EdgeSample)| Place { bucket: key(unit, s.x), sample: i as u32, at: [s.x, s.y] };
        let mut places: Vec<Place> = samples.iter().enumerate().map(place).collect();
        places.sort_by_key(|p| (row(p.at), p.bucket));
        let mut rows: Vec<(i32, usize)> = Vec::new();
        for (first, p) in places.iter().enumerate() {
            if rows.last().is_none_or(|last| last.0 != row(p.at)) {
                rows.push((row(p.at), first));
            }
        }
        EdgeIndex { samples, unit, places, rows }
    }
    /// The recipe's unit of length, mm.
    pub fn unit(&self) -> f64 {
        self.unit
    }
    /// The places in the buckets that a square of this half size touches, row by row.
    fn around(&self, [x, y]: [f64; 2], half: f64) -> impl Iterator<Item = &[Place]> {
        let [left, right, low, high] = [x - half, x + half, y - half, y + half].map(|v| key(self.unit, v));
        let first = self.rows.partition_point(|row| row.0 < low);
        let rows = (first..self.rows.len()).take_while(move |&r| self.rows[r].0 <= high);
        rows.map(move |r| {
            let end = self.rows.get(r + 1).map_or(self.places.len(), |next| next.1);
            let row = &self.places[self.rows[r].1..end];
            let from = row.partition_point(|p| p.bucket < left);
            &row[from..from + row[from..].partition_point(|p| p.bucket <= right)]
        })
    }
    /// The nearest sample within `gate` that passes `good`.
    pub fn nearest(&self, x: f64, y: f64, gate: f64, good: impl Fn(&EdgeSample) -> bool) -> Option<&EdgeSample> {
        let mut best: Option<&EdgeSample> = None;
        let mut least = gate * gate;
        // The place's own buckets first: most often the nearest sample is there, and few other buckets are looked at.
        for half in [0.0, gate] {
            let half = half.min(least.sqrt());
            for p in self.around([x, y], half).flatten() {
                let (dx, dy) = (p.at[0] - x, p.at[1] - y);
                let d2 = dx * dx + dy * dy;
                if (d2 < least || (best.is_none() && d2 <= least)) && good(&self.samples[p.sample as usize]) {
                    (least, best) = (d2, Some(&self.samples[p.sample as usize]));
                }
            }
        }
        best
    }
    /// The nearest edge at height `z`, if that edge locates the part.
    pub fn nearest_locating(&self, x: f64, y: f64, gate: f64, z: f64) -> Option<&EdgeSample> {
        self.nearest(x, y, gate, |s| s.z == z).filter(|s| s.locates)
    }
    /// The piece of edge to which a place beside it belongs: shape, element, direction, position along the edge.
    pub fn piece(&self, s: &EdgeSample, x: f64, y: f64) -> (usize, usize, i32, i32) {
        let direction = (s.ny.atan2(s.nx) / std::f64::consts::FRAC_PI_4).round() as i32;
        (s.shape, s.element, direction, ((s.nx * y - s.ny * x) / (PIECE * self.unit)).floor() as i32)
    }
    /// True where the drawing has no measurable edge.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }
    /// Samples of all measurable edges, 0.05 units apart.
    pub fn samples(&self) -> &[EdgeSample] {
        &self.samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    /// Places on both sides of zero, in clusters and far apart, at gates from nothing to all of them.
    #[test]
    fn the_index_gives_what_a_walk_over_all_samples_gives() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(7);
        let mut found = [0; 2];
        for case in 0..60 {
            let far = [1.0, 8.0, 1e6][case % 3];
            let sample = |_| {
                let [x, y] = [0, 1].map(|_| far * f64::from(rng.random_range(-1..=1)) + rng.random_range(-4.0..4.0));
                let z = f64::from(rng.random_range(0..2));
                EdgeSample {
                    x,
                    y,
                    nx: 1.0,
                    ny: 0.0,
                    z,
                    either: false,
                    extent: 1.0,
                    search: true,
                    measure: true,
                    locates: true,
                    shape: 0,
                    element: 0,
                    curvature: 0.0,
                }
            };
            let index = EdgeIndex::of((0..case * 9).map(sample).collect(), [0.3, 1.0, 2.5][case % 7 % 3]);
            for _ in 0..200 {
                let [x, y] = [0, 1].map(|_| far * f64::from(rng.random_range(-1..=1)) + rng.random_range(-5.0..5.0));
                let gate = [0.0, 0.4, 1.0, 2.9, 9.0][rng.random_range(0..5)];
                let apart = |s: &EdgeSample| (s.x - x).hypot(s.y - y);
                let good = |s: &EdgeSample| s.z == 1.0;
                let all = index.samples().iter().filter(|s| good(s) && apart(s) <= gate).map(apart);
                let (plain, indexed) = (all.min_by(f64::total_cmp), index.nearest(x, y, gate, good).map(apart));
                assert_eq!(plain, indexed, "case {case}, at {x} {y}, gate {gate}");
                found[usize::from(plain.is_some())] += 1;
            }
        }
        assert!(found.iter().all(|n| *n > 1000), "{found:?} were without and with a sample");
    }
}
