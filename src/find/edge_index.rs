//! In: a drawing. Out: its measurable edges in buckets, so that the one nearest to a place is found at once.
//! Frame and unit: part frame, mm.

use super::drawing::{Drawing, EdgeSample};
use std::collections::HashMap;

/// Edge samples in buckets.
pub struct EdgeIndex {
    samples: Vec<EdgeSample>,
    /// No edge of another direction is near: not at a corner or beside another shape.
    straight: Vec<bool>,
    buckets: HashMap<(i32, i32), Vec<u32>>,
}

/// Edge length of a bucket, mm; no gate reaches farther than three of them.
const BUCKET: f64 = 1.0;
const SPACING: f64 = 0.05;
/// Edges nearer than this to another one are not measured by light, which the two share, mm.
const APART: f64 = 0.7;
/// Length of edge whose samples have what is not modelled in common, mm: about three widths of the sheet's light and a
/// few samples, over which walls, chamfers and pixels change.
const PIECE: f64 = 4.0;

impl EdgeIndex {
    pub fn new(drawing: &Drawing) -> EdgeIndex {
        let samples: Vec<EdgeSample> = drawing.samples(SPACING).into_iter().filter(|s| s.measure).collect();
        let mut buckets: HashMap<(i32, i32), Vec<u32>> = HashMap::new();
        for (i, s) in samples.iter().enumerate() {
            buckets.entry(Self::key(s.x, s.y)).or_default().push(i as u32);
        }
        let mut index = EdgeIndex { samples, straight: vec![], buckets };
        let lone = |s: &EdgeSample| {
            let other = |o: &EdgeSample| o.z == s.z && o.nx * s.nx + o.ny * s.ny < 0.8;
            index.nearest(s.x, s.y, APART, other).is_none()
        };
        index.straight = index.samples.iter().map(lone).collect();
        index
    }
    fn key(x: f64, y: f64) -> (i32, i32) {
        ((x / BUCKET).floor() as i32, (y / BUCKET).floor() as i32)
    }
    /// The nearest sample within `gate` that passes `good`.
    pub fn nearest(&self, x: f64, y: f64, gate: f64, good: impl Fn(&EdgeSample) -> bool) -> Option<&EdgeSample> {
        self.nearest_index(x, y, gate, good).map(|i| &self.samples[i])
    }
    /// The nearest edge at height `z` if it locates the part, and whether it is straight there.
    pub fn nearest_locating(&self, x: f64, y: f64, gate: f64, z: f64) -> Option<(&EdgeSample, bool)> {
        let i = self.nearest_index(x, y, gate, |s| s.z == z)?;
        self.samples[i].locates.then_some((&self.samples[i], self.straight[i]))
    }
    /// Which piece of which edge a place beside it belongs to: shape, element, direction, place along it.
    pub fn piece(&self, s: &EdgeSample, x: f64, y: f64) -> (usize, usize, i32, i32) {
        let direction = (s.ny.atan2(s.nx) / std::f64::consts::FRAC_PI_4).round() as i32;
        (s.shape, s.element, direction, ((s.nx * y - s.ny * x) / PIECE).floor() as i32)
    }
    fn nearest_index(&self, x: f64, y: f64, gate: f64, good: impl Fn(&EdgeSample) -> bool) -> Option<usize> {
        let (kx, ky) = Self::key(x, y);
        let reach = (gate / BUCKET).ceil() as i32;
        let mut best: Option<(f64, usize)> = None;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                for &i in self.buckets.get(&(kx + dx, ky + dy)).into_iter().flatten() {
                    let s = &self.samples[i as usize];
                    let d = (s.x - x).hypot(s.y - y);
                    if d <= gate && best.is_none_or(|b| d < b.0) && good(s) {
                        best = Some((d, i as usize));
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
