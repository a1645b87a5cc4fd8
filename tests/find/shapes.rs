//! In: a place in a drawn shape's frame. Out: its distance to the shape's outline, negative inside, and the share of a
//! pixel there that a blurred edge covers.
//! Frame and unit: px.

/// Blur of the drawn edges, px.
pub const BLUR: f64 = 0.8;

/// Signed distance to a box, negative inside.
pub fn boxed(x: f64, y: f64, cx: f64, cy: f64, hw: f64, hh: f64) -> f64 {
    let (dx, dy) = ((x - cx).abs() - hw, (y - cy).abs() - hh);
    dx.max(0.0).hypot(dy.max(0.0)) + dx.max(dy).min(0.0)
}

pub fn disc(x: f64, y: f64, cx: f64, cy: f64, r: f64) -> f64 {
    (x - cx).hypot(y - cy) - r
}

/// A bracket: a plate with a foot, two holes and a slot; no symmetry.
pub fn part(x: f64, y: f64) -> f64 {
    let plate = boxed(x, y, 0.0, 0.0, 34.0, 18.0).min(boxed(x, y, 26.0, 22.0, 8.0, 14.0));
    let holes = disc(x, y, -20.0, 4.0, 6.0).min(disc(x, y, 2.0, -6.0, 4.0)).min(boxed(x, y, 18.0, 2.0, 9.0, 2.5));
    plate.max(-holes)
}

/// Share of a blurred edge at a signed distance: the integral of a Gaussian, by the logistic form that
/// stays within 1e-2 of it and, like it, is symmetric about the edge.
pub fn cover(distance: f64) -> f64 {
    1.0 / (1.0 + (1.702 * distance / BLUR).exp())
}
