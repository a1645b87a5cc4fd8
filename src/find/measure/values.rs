//! In: points and lines with their sigmas. Out: values built from them: middles, lines, intersections, offsets.
//! Frame and unit: the part frame; mm, rad.

use crate::fault::{Fault, Result};

/// The result of a construction: a point, with a direction for a line or a lattice.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Value {
    /// Along the part's x, mm.
    pub x: f64,
    /// Along the part's y, mm.
    pub y: f64,
    /// Direction from the part's x, rad; `None` for a bare point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<f64>,
    /// Standard deviation of the point, mm (per axis).
    pub sigma_mm: f64,
}

/// Mean of some points.
pub(super) fn middle(values: impl Iterator<Item = Value> + Clone) -> Value {
    let n = values.clone().count() as f64;
    let sum = |f: fn(&Value) -> f64| values.clone().map(|v| f(&v)).sum::<f64>();
    Value {
        x: sum(|v| v.x) / n,
        y: sum(|v| v.y) / n,
        direction: None,
        sigma_mm: sum(|v| v.sigma_mm * v.sigma_mm).sqrt() / n,
    }
}

/// The line of total least squares; it points from the first point towards the last.
pub(super) fn line_through(points: &[Value]) -> Result<Value> {
    let m = middle(points.iter().copied());
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        let (dx, dy) = (p.x - m.x, p.y - m.y);
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
    }
    if xx + yy < 1e-9 {
        return Err(Fault::input("a line through points that coincide")
            .cause("an impossible construction")
            .next("name points that lie apart in 'of'"));
    }
    let mut angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (first, last) = (points[0], points[points.len() - 1]);
    if (last.x - first.x) * angle.cos() + (last.y - first.y) * angle.sin() < 0.0 {
        angle += std::f64::consts::PI;
    }
    Ok(Value { direction: Some(angle), ..m })
}

fn direction(v: &Value) -> Result<f64> {
    v.direction.ok_or_else(|| {
        Fault::input("a point where a line or a lattice is needed")
            .cause("an impossible construction")
            .next("name a line or a lattice there")
    })
}

/// Where two lines meet.
pub(super) fn meet(a: &Value, b: &Value) -> Result<Value> {
    let ((sa, ca), (sb, cb)) = (direction(a)?.sin_cos(), direction(b)?.sin_cos());
    let det = sa * cb - ca * sb;
    if det.abs() < 0.05 {
        return Err(Fault::input("two lines that are parallel to within 3 degrees do not meet")
            .cause("an impossible construction")
            .next("name lines that cross at more than 3 degrees in 'of'"));
    }
    let (dx, dy) = (b.x - a.x, b.y - a.y);
    let s = (dy * cb - dx * sb) / det;
    Ok(Value { x: a.x + s * ca, y: a.y + s * sa, direction: None, sigma_mm: a.sigma_mm.hypot(b.sigma_mm) / det.abs() })
}

/// A point moved by `by` along and across the direction of `d`, mm.
pub(super) fn moved(p: &Value, d: &Value, by: [f64; 2]) -> Result<Value> {
    let angle = direction(d)?;
    let (s, c) = angle.sin_cos();
    Ok(Value { x: p.x + c * by[0] - s * by[1], y: p.y + s * by[0] + c * by[1], direction: Some(angle), ..*p })
}
