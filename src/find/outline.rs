//! In: a shape of a drawing. Out: its outline as a polyline, counter-clockwise where it is closed; the area of one, and
//! whether a place lies in it.
//! Frame and unit: the part's frame; mm.

use super::drawing::{Form, Shape};

impl Shape {
    /// Corner points, counter-clockwise for closed shapes, and whether it is closed. Curves are cut so
    /// finely that they stay within 0.5 per mille of their radius.
    pub(super) fn outline(&self) -> (Vec<[f64; 2]>, bool) {
        let c = self.centre.unwrap_or([0.0, 0.0]);
        let r = self.radius.unwrap_or(0.0);
        match self.kind {
            Form::Rectangle => {
                let [w, h] = self.size.unwrap_or([0.0, 0.0]).map(|v| 0.5 * v);
                let (s, k) = self.angle_deg.unwrap_or(0.0).to_radians().sin_cos();
                let corner = |x: f64, y: f64| [c[0] + k * x - s * y, c[1] + s * x + k * y];
                (vec![corner(-w, -h), corner(w, -h), corner(w, h), corner(-w, h)], true)
            }
            Form::Circle => (arc(c, r, 0.0, std::f64::consts::TAU, 100)[..100].to_vec(), true),
            Form::Polygon => {
                let mut p = self.points.clone().unwrap_or_default();
                if area(&p) < 0.0 {
                    p.reverse();
                }
                (p, true)
            }
            Form::Line => (self.points.clone().unwrap_or_default(), false),
            Form::Arc => {
                let [a, b] = self.span_deg.unwrap_or([0.0, 360.0]).map(f64::to_radians);
                (arc(c, r, a, b, ((b - a) / 0.0628).ceil().max(2.0) as usize), false)
            }
        }
    }
}

fn arc(c: [f64; 2], r: f64, from: f64, to: f64, steps: usize) -> Vec<[f64; 2]> {
    (0..=steps)
        .map(|i| {
            let (s, k) = (from + (to - from) * i as f64 / steps as f64).sin_cos();
            [c[0] + r * k, c[1] + r * s]
        })
        .collect()
}

/// Area to the left of an outline.
pub(super) fn area(p: &[[f64; 2]]) -> f64 {
    (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()])).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum()
}

/// Even-odd rule.
pub(super) fn contains(p: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut inside = false;
    for i in 0..p.len() {
        let (a, b) = (p[i], p[(i + 1) % p.len()]);
        if (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0] {
            inside = !inside;
        }
    }
    inside
}
