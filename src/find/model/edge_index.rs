//! In: a drawing. Out: its measurable edges in buckets, in which the nearest edge to a place is found quickly.
//! Frame and unit: part frame, mm.

use super::drawing::Drawing;
use super::drawn_edges::EdgeSample;
use std::collections::HashMap;

/// Edge samples in buckets.
pub struct EdgeIndex {
    samples: Vec<EdgeSample>,
    /// The recipe's unit of length, mm (`MeasureOptions::unit`).
    unit: f64,
    buckets: HashMap<(i32, i32), Vec<u32>>,
}

/// Distance between samples, in units of the recipe.
const SPACING: f64 = 0.05;
/// Length of an edge piece whose samples share errors that are not modelled, in units. It is about three widths of the
/// sheet's light and a few samples, over which walls, chamfers and pixels change.
const PIECE: f64 = 4.0;

/// The bucket of a place, one unit wide; no gate reaches farther than three buckets.
fn key(unit: f64, x: f64, y: f64) -> (i32, i32) {
    ((x / unit).floor() as i32, (y / unit).floor() as i32)
}

impl EdgeIndex {
    /// The measurable edges of a drawing; `unit` is the recipe's unit of length, mm.
    pub fn new(drawing: &Drawing, unit: f64) -> EdgeIndex {
        let samples: Vec<EdgeSample> = drawing.samples(SPACING * unit).into_iter().filter(|s| s.measure).collect();
        let mut buckets: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
        for (i, s) in samples.iter().enumerate() {
            buckets.entry(key(unit, s.x, s.y)).or_default().push(i as u32);
        }
        EdgeIndex { samples, unit, buckets }
    }
    /// The recipe's unit of length, mm.
    pub fn unit(&self) -> f64 {
        self.unit
    }
    /// The nearest sample within `gate` that passes `good`.
    pub fn nearest(&self, x: f64, y: f64, gate: f64, good: impl Fn(&EdgeSample) -> bool) -> Option<&EdgeSample> {
        let (kx, ky) = key(self.unit, x, y);
        let reach = (gate / self.unit).ceil() as i32;
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
