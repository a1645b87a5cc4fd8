//! In: a drawing.
//! Out: faces (level surfaces with holes) and samples of their edges with outward normals.
//! Frame and unit: the part's frame (x along the long axis, z out of the part); mm.

use super::drawing::Drawing;
use super::face::Face;
use super::outline::{bounds, diameter};
use super::shape::{Form, Grid, Inside};
use crate::geometry::Vec3;

/// A polyline and what it bounds.
#[derive(Clone, Debug)]
struct Contour {
    points: Vec<[f64; 2]>,
    closed: bool,
    inside: Inside,
    z: f64,
    search: bool,
    measure: bool,
    locates: bool,
    extent: f64,
    shape: usize,
    element: usize,
}

/// -1 where the material lies right of the contour at a place, 1 where it lies left or is unknown; `None` where it lies
/// on both sides or on neither. `r` points right.
fn side(c: &Contour, face: Option<&Face>, [x, y]: [f64; 2], [rx, ry]: [f64; 2]) -> Option<f64> {
    let sign = match (c.closed && c.inside != Inside::Either, face) {
        (true, Some(f)) => {
            const STEP: f64 = 1e-6;
            let right = f.material(x + STEP * rx, y + STEP * ry);
            let left = f.material(x - STEP * rx, y - STEP * ry);
            if right == left {
                return None;
            }
            if right { -1.0 } else { 1.0 }
        }
        _ if c.inside == Inside::Low => -1.0,
        _ => 1.0,
    };
    Some(sign)
}

/// A point on an edge of the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSample {
    /// Along the part's x, mm.
    pub x: f64,
    /// Along the part's y, mm.
    pub y: f64,
    /// Unit normal, away from the material (the high side).
    pub nx: f64,
    /// y of that normal.
    pub ny: f64,
    /// Height of the high side, mm.
    pub z: f64,
    /// True where the direction of contrast is unknown.
    pub either: bool,
    /// Diameter of the shape that the edge belongs to, mm.
    pub extent: f64,
    /// Used by the search for the part.
    pub search: bool,
    /// Measured on the points: only edges of closed shapes whose high side is known.
    pub measure: bool,
    /// True where it takes part in locating the part.
    pub locates: bool,
    /// Index of the shape that the edge belongs to.
    pub shape: usize,
    /// Element of that shape's grid, row by row, from 0.
    pub element: usize,
    /// 1 / radius of a circle or an arc, positive where the material is inside, 1/mm; 0 for straight edges.
    pub curvature: f64,
}

impl Drawing {
    /// The level surfaces that closed shapes bound, one for each height, in the order of the drawing.
    pub fn faces(&self) -> Vec<Face> {
        let mut faces: Vec<(f64, Vec<_>, Vec<_>)> = Vec::new();
        for c in self.contours().into_iter().filter(|c| c.closed && c.inside != Inside::Either) {
            let at = faces.iter().position(|f| f.0 == c.z).unwrap_or_else(|| {
                faces.push((c.z, vec![], vec![]));
                faces.len() - 1
            });
            let list = if c.inside == Inside::High { &mut faces[at].1 } else { &mut faces[at].2 };
            list.push(c.points);
        }
        faces.into_iter().map(|(z, high, low)| Face::new(z, high, low)).collect()
    }

    /// Points along all edges, about `spacing` apart. An edge of one shape that lies inside another of the same surface
    /// (material on both sides, or on neither) is no edge and is skipped.
    pub fn samples(&self, spacing: f64) -> Vec<EdgeSample> {
        let faces = self.faces();
        let mut out = Vec::new();
        for c in self.contours() {
            let face = faces.iter().find(|f| f.z == c.z);
            let n = c.points.len();
            let mut carry = 0.5 * spacing;
            let s = &self.shape[c.shape];
            let round = s.radius.filter(|_| matches!(s.kind, Form::Circle | Form::Arc));
            let round = round.map(|r| (r, self.centre_of(c.shape, c.element)));
            for i in 0..if c.closed { n } else { n - 1 } {
                let (a, b) = (c.points[i], c.points[(i + 1) % n]);
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let length = dx.hypot(dy);
                // Right of the direction of travel.
                let (rx, ry) = (dy / length, -dx / length);
                while carry < length {
                    let (x, y) = (a[0] + dx * carry / length, a[1] + dy * carry / length);
                    carry += spacing;
                    let Some(sign) = side(&c, face, [x, y], [rx, ry]) else { continue };
                    let either = c.inside == Inside::Either;
                    let (extent, search, measure) = (c.extent, c.search, c.measure && c.closed && !either);
                    let curvature =
                        round.map_or(0.0, |(r, [cx, cy])| (sign * (rx * (x - cx) + ry * (y - cy))).signum() / r);
                    out.push(EdgeSample {
                        x,
                        y,
                        nx: sign * rx,
                        ny: sign * ry,
                        z: c.z,
                        either,
                        extent,
                        search,
                        measure,
                        shape: c.shape,
                        element: c.element,
                        locates: c.locates,
                        curvature,
                    });
                }
                carry -= length;
            }
        }
        out
    }

    /// Smallest box around all edges: x0, y0, x1, y1.
    pub fn bounds(&self) -> [f64; 4] {
        bounds(self.contours().iter().flat_map(|c| &c.points))
    }

    /// The polylines of the drawing, for pictures: points and whether closed.
    pub fn polylines(&self) -> Vec<(Vec<[f64; 2]>, bool)> {
        self.contours().into_iter().map(|c| (c.points, c.closed)).collect()
    }

    /// All outlines at the heights of their shapes, part frame, mm; closed ones end where they begin.
    pub fn outlines(&self) -> Vec<Vec<Vec3>> {
        let line = |c: Contour| {
            let again = c.points.first().copied().filter(|_| c.closed);
            c.points.iter().chain(&again).map(|p| Vec3::new(p[0], p[1], c.z)).collect()
        };
        self.contours().into_iter().map(line).collect()
    }

    fn contours(&self) -> Vec<Contour> {
        let mut out = Vec::new();
        for (shape, s) in self.shape.iter().enumerate() {
            let (base, closed) = s.outline();
            let g = s.grid.unwrap_or(Grid { count: [1, 1], pitch: [0.0, 0.0] });
            let extent = diameter(&base);
            for iy in 0..g.count[1] {
                for ix in 0..g.count[0] {
                    let dx = (f64::from(ix) - 0.5 * f64::from(g.count[0] - 1)) * g.pitch[0];
                    let dy = (f64::from(iy) - 0.5 * f64::from(g.count[1] - 1)) * g.pitch[1];
                    out.push(Contour {
                        points: base.iter().map(|p| [p[0] + dx, p[1] + dy]).collect(),
                        closed,
                        inside: s.inside,
                        z: s.z_mm,
                        search: s.search,
                        measure: s.measure,
                        locates: s.locates,
                        extent,
                        shape,
                        element: (iy * g.count[0] + ix) as usize,
                    });
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOCKET: &str = r#"
        [[shape]]
        kind = "rectangle"
        centre = [0, 0]
        size = [20, 10]
        [[shape]]
        kind = "circle"
        inside = "low"
        centre = [-10, 0]
        radius = 2
        [[shape]]
        kind = "circle"
        inside = "low"
        centre = [0, 0]
        radius = 0.5
        grid = { count = [4, 2], pitch = [3, 6] }
    "#;

    #[test]
    fn a_notch_replaces_the_edge_that_it_cuts() {
        let drawing = Drawing::parse(SOCKET).unwrap();
        let samples = drawing.samples(0.05);
        // Outline 60 less the 4 mm under the notch, half a circle of the notch, eight holes.
        let length = samples.len() as f64 * 0.05;
        let want = 60.0 - 4.0 + std::f64::consts::PI * 2.0 + 8.0 * std::f64::consts::PI;
        assert!((length - want).abs() < 0.3, "{length} {want}");
        assert!(samples.iter().all(|s| s.x >= -10.0 - 1e-9));
        let face = &drawing.faces()[0];
        for s in &samples {
            assert!(!face.material(s.x + 1e-3 * s.nx, s.y + 1e-3 * s.ny));
            assert!(face.material(s.x - 1e-3 * s.nx, s.y - 1e-3 * s.ny));
        }
        assert_eq!(drawing.bounds(), [-12.0, -5.0, 10.0, 5.0]);
    }

    #[test]
    fn an_arc_has_its_high_side_on_the_left() {
        let text = "[[shape]]\nkind = \"arc\"\ncentre = [0, 0]\nradius = 5\nspan_deg = [0, 90]\n";
        for s in Drawing::parse(text).unwrap().samples(0.1) {
            assert!(s.nx * s.x + s.ny * s.y > 4.9 && !s.measure);
        }
    }
}
