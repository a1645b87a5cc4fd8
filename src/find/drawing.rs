//! In: a drawing (TOML): rectangles, circles, polygons, lines, arcs and grids of them, each on a surface.
//! Out: faces (level surfaces with holes) and samples of their edges with outward normals.
//! Frame and unit: the part's frame (x along the long axis, z out of the part); mm.

use crate::fault::{Fault, Result};

/// The kinds of shape a drawing knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    Rectangle,
    Circle,
    Polygon,
    Line,
    Arc,
}

/// Which side of an edge is the higher (brighter) one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// The inside of a closed shape is material. Of a line or an arc (walked from start to end): the left side.
    #[default]
    High,
    /// The inside is a hole in the surface at `z_mm`. Of a line or an arc: the right side is the high one.
    Low,
    /// Not known; the direction of the edge's contrast is ignored.
    Either,
}

/// A rectangular array about the shape's own place.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Number along x and y, at least 1.
    pub count: [u32; 2],
    /// Distance between neighbours along x and y, mm.
    pub pitch: [f64; 2],
}

/// One shape of a drawing. Which keys are needed depends on `kind`.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    pub kind: Form,
    /// A name by which constructions refer to it: `name`, or `name[column,row]` in a grid, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// rectangle, circle, arc: mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 2]>,
    /// rectangle: full width and height, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// circle, arc: mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// rectangle: turn about its centre, degrees. Default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// arc: from where to where, counter-clockwise, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub span_deg: Option<[f64; 2]>,
    /// polygon: corners; line: its two ends; mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<[f64; 2]>>,
    #[serde(default)]
    pub inside: Inside,
    /// Height of the surface that the shape is (high) or cuts into (low), mm. Default 0, the datum.
    #[serde(default)]
    pub z_mm: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<Grid>,
    /// Used by the search for the part. Default true.
    #[serde(default = "yes")]
    pub search: bool,
    /// Its edges are measured on the points. Default true.
    #[serde(default = "yes")]
    pub measure: bool,
    /// Its edges locate the part. False for what is measured by itself only, such as contacts whose
    /// springs and lips blur their edges. Default true.
    #[serde(default = "yes")]
    pub locates: bool,
}

fn yes() -> bool {
    true
}

/// A drawing: the shapes of a part.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drawing {
    pub shape: Vec<Shape>,
}

/// A polyline with what it bounds.
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

/// A place on an edge of the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSample {
    pub x: f64,
    pub y: f64,
    /// Unit normal, away from the material (the high side).
    pub nx: f64,
    pub ny: f64,
    /// Height of the high side.
    pub z: f64,
    /// Direction of contrast unknown.
    pub either: bool,
    /// Size of the shape that the edge belongs to.
    pub extent: f64,
    pub search: bool,
    pub measure: bool,
    pub locates: bool,
    /// Index of the shape, and of the element of its grid (row by row).
    pub shape: usize,
    pub element: usize,
    /// 1 / radius of a circle or an arc, positive where the material is inside, 1/mm; 0 for straight edges.
    pub curvature: f64,
}

/// A level surface: union of the high shapes less the low ones at one height.
#[derive(Clone, Debug)]
pub struct Face {
    pub z: f64,
    high: Vec<Vec<[f64; 2]>>,
    low: Vec<Vec<[f64; 2]>>,
}

impl Face {
    /// True where the surface exists.
    pub fn material(&self, x: f64, y: f64) -> bool {
        self.high.iter().any(|l| contains(l, x, y)) && !self.low.iter().any(|l| contains(l, x, y))
    }
}

impl Drawing {
    pub fn parse(text: &str) -> Result<Drawing> {
        let drawing: Drawing = toml::from_str(text).map_err(|e| {
            Fault::input(format!("is not a drawing: {}", e.message()))
                .cause("a misspelt key or a missing entry")
                .next("compare it with docs/file-formats.md, Drawing")
        })?;
        drawing.check()?;
        Ok(drawing)
    }

    /// Refuses shapes whose keys do not fit their kind and sizes that are not positive.
    pub fn check(&self) -> Result<()> {
        if self.shape.is_empty() {
            return Err(Fault::input("the drawing has no shapes").next("add at least one [[shape]]"));
        }
        for (i, s) in self.shape.iter().enumerate() {
            s.check().map_err(|e| e.at(format!("shape {}", i + 1)))?;
        }
        Ok(())
    }

    /// The level surfaces that measuring shapes bound, one a height, in the order of the drawing.
    pub fn faces(&self) -> Vec<Face> {
        let contours = self.contours();
        let mut faces: Vec<Face> = Vec::new();
        for c in contours.iter().filter(|c| c.closed && c.inside != Inside::Either) {
            let at = faces.iter().position(|f| f.z == c.z).unwrap_or_else(|| {
                faces.push(Face { z: c.z, high: vec![], low: vec![] });
                faces.len() - 1
            });
            let list = if c.inside == Inside::High { &mut faces[at].high } else { &mut faces[at].low };
            list.push(c.points.clone());
        }
        faces
    }

    /// Places along all edges, about `spacing` apart. An edge of one shape that lies inside another of
    /// the same surface (both sides material, or neither) is no edge and is left out.
    pub fn samples(&self, spacing: f64) -> Vec<EdgeSample> {
        let faces = self.faces();
        let mut out = Vec::new();
        for c in self.contours() {
            let face = faces.iter().find(|f| f.z == c.z);
            let n = c.points.len();
            let mut carry = 0.5 * spacing;
            for i in 0..if c.closed { n } else { n - 1 } {
                let (a, b) = (c.points[i], c.points[(i + 1) % n]);
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let length = dx.hypot(dy);
                // Right of the direction of travel.
                let (rx, ry) = (dy / length, -dx / length);
                while carry < length {
                    let (x, y) = (a[0] + dx * carry / length, a[1] + dy * carry / length);
                    carry += spacing;
                    let sign = match (c.closed && c.inside != Inside::Either, face) {
                        (true, Some(f)) => {
                            const STEP: f64 = 1e-6;
                            let right = f.material(x + STEP * rx, y + STEP * ry);
                            let left = f.material(x - STEP * rx, y - STEP * ry);
                            if right == left {
                                continue;
                            }
                            if right { -1.0 } else { 1.0 }
                        }
                        _ if c.inside == Inside::Low => -1.0,
                        _ => 1.0,
                    };
                    let either = c.inside == Inside::Either;
                    let (extent, search, measure) = (c.extent, c.search, c.measure && c.closed && !either);
                    let s = &self.shape[c.shape];
                    let round = s.radius.filter(|_| matches!(s.kind, Form::Circle | Form::Arc));
                    let curvature = round.map_or(0.0, |r| {
                        let [cx, cy] = self.centre_of(c.shape, c.element);
                        (sign * (rx * (x - cx) + ry * (y - cy))).signum() / r
                    });
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

    /// Nominal centre of `name` or `name[column,row]`, with the indices of its shape and element.
    pub fn named(&self, reference: &str) -> Result<(usize, usize, [f64; 2])> {
        let unknown = |why: String| {
            let names: Vec<&str> = self.shape.iter().filter_map(|s| s.name.as_deref()).collect();
            Fault::input(format!("'{reference}' names no shape: {why}"))
                .cause("a misspelt name, or an element outside its grid")
                .next(format!("named shapes are: {}", names.join(", ")))
        };
        let (name, element) = match reference.split_once('[') {
            None => (reference, None),
            Some((name, rest)) => {
                let numbers: Vec<u32> =
                    rest.trim_end_matches(']').split(',').filter_map(|n| n.trim().parse().ok()).collect();
                let [column, row] = numbers[..] else { return Err(unknown("wanted name[column,row]".into())) };
                (name, Some([column, row]))
            }
        };
        let found = self.shape.iter().position(|s| s.name.as_deref() == Some(name));
        let index = found.ok_or_else(|| unknown("no shape has that name".into()))?;
        let s = &self.shape[index];
        let count = s.grid.map_or([1, 1], |g| g.count);
        let [column, row] = element.unwrap_or([1, 1]);
        if element.is_none() && count != [1, 1] {
            return Err(unknown(format!("it is a grid of {} x {}, name an element", count[0], count[1])));
        }
        if column < 1 || row < 1 || column > count[0] || row > count[1] {
            return Err(unknown(format!("its grid has {} x {} elements", count[0], count[1])));
        }
        let element = ((row - 1) * count[0] + column - 1) as usize;
        Ok((index, element, self.centre_of(index, element)))
    }

    /// Nominal centre of an element of a shape.
    pub fn centre_of(&self, shape: usize, element: usize) -> [f64; 2] {
        let s = &self.shape[shape];
        let points = s.outline().0;
        let n = points.len() as f64;
        let own = s
            .centre
            .unwrap_or([points.iter().map(|p| p[0]).sum::<f64>() / n, points.iter().map(|p| p[1]).sum::<f64>() / n]);
        let Some(g) = s.grid else { return own };
        let at = [element as u32 % g.count[0], element as u32 / g.count[0]];
        std::array::from_fn(|k| own[k] + (f64::from(at[k]) - 0.5 * f64::from(g.count[k] - 1)) * g.pitch[k])
    }

    /// Smallest box around all edges: x0, y0, x1, y1.
    pub fn bounds(&self) -> [f64; 4] {
        let mut b = [f64::MAX, f64::MAX, f64::MIN, f64::MIN];
        for p in self.contours().iter().flat_map(|c| &c.points) {
            b = [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])];
        }
        b
    }

    /// The polylines of the drawing, for pictures: points and whether closed.
    pub fn polylines(&self) -> Vec<(Vec<[f64; 2]>, bool)> {
        self.contours().into_iter().map(|c| (c.points, c.closed)).collect()
    }

    fn contours(&self) -> Vec<Contour> {
        let mut out = Vec::new();
        for (shape, s) in self.shape.iter().enumerate() {
            let (base, closed) = s.outline();
            let g = s.grid.unwrap_or(Grid { count: [1, 1], pitch: [0.0, 0.0] });
            let extent = base
                .iter()
                .flat_map(|a| base.iter().map(move |b| (a[0] - b[0]).hypot(a[1] - b[1])))
                .fold(0.0, f64::max);
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

impl Shape {
    fn check(&self) -> Result<()> {
        let needs = |ok: bool, what: &str| {
            if ok { Ok(()) } else { Err(Fault::input(format!("a {:?} needs {what}", self.kind).to_lowercase())) }
        };
        let has = [
            ("centre", self.centre.is_some(), [Form::Rectangle, Form::Circle, Form::Arc].contains(&self.kind)),
            ("size", self.size.is_some(), self.kind == Form::Rectangle),
            ("radius", self.radius.is_some(), [Form::Circle, Form::Arc].contains(&self.kind)),
            ("span_deg", self.span_deg.is_some(), self.kind == Form::Arc),
            ("points", self.points.is_some(), [Form::Polygon, Form::Line].contains(&self.kind)),
        ];
        for (name, there, wanted) in has {
            needs(there || !wanted, name)?;
            if there && !wanted {
                return Err(Fault::input(format!("a {:?} has no {name}", self.kind).to_lowercase())
                    .cause("a key of another kind of shape"));
            }
        }
        if self.angle_deg.is_some() && self.kind != Form::Rectangle {
            return Err(Fault::input("angle_deg turns rectangles only"));
        }
        let numbers = [self.centre, self.size, self.span_deg].into_iter().flatten().flatten().chain(self.radius);
        let all: Vec<f64> = numbers.chain(self.points.iter().flatten().flatten().copied()).chain([self.z_mm]).collect();
        needs(all.iter().all(|v| v.is_finite() && v.abs() < 1e5), "numbers below 100000 mm")?;
        needs(self.size.is_none_or(|s| s[0] > 0.0 && s[1] > 0.0), "a size above 0")?;
        needs(self.radius.is_none_or(|r| r > 0.0), "a radius above 0")?;
        needs(self.span_deg.is_none_or(|s| s[1] > s[0]), "a span_deg whose end is above its start")?;
        let want = if self.kind == Form::Line { 2 } else { 3 };
        let n = self.points.as_ref().map_or(want, Vec::len);
        needs(if self.kind == Form::Line { n == 2 } else { n >= 3 }, "2 points (line) or at least 3 (polygon)")?;
        if let Some(g) = self.grid {
            needs(g.count[0] >= 1 && g.count[1] >= 1 && g.count[0] * g.count[1] <= 10_000, "a grid of 1 to 10000")?;
            needs((0..2).all(|i| g.count[i] == 1 || g.pitch[i] > 0.0), "a pitch above 0")?;
        }
        Ok(())
    }

    /// Corner points, counter-clockwise for closed shapes, and whether it is closed. Curves are cut so
    /// finely that they stay within 0.5 per mille of their radius.
    fn outline(&self) -> (Vec<[f64; 2]>, bool) {
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

fn area(p: &[[f64; 2]]) -> f64 {
    (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()])).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum()
}

/// Even-odd rule.
fn contains(p: &[[f64; 2]], x: f64, y: f64) -> bool {
    let mut inside = false;
    for i in 0..p.len() {
        let (a, b) = (p[i], p[(i + 1) % p.len()]);
        if (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0] {
            inside = !inside;
        }
    }
    inside
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
    fn wrong_keys_are_refused() {
        for (text, word) in [
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\n", "radius"),
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = -1\n", "above 0"),
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = 1\nsize = [1, 1]\n", "size"),
            ("[[shape]]\nkind = \"circle\"\ncentre = [0, 0]\nradius = 1\ncolour = 3\n", "colour"),
            ("[[shape]]\nkind = \"line\"\npoints = [[0, 0]]\n", "2 points"),
            ("shape = []", "no shapes"),
        ] {
            let e = Drawing::parse(text).unwrap_err();
            assert!(e.what.contains(word), "{text}: {}", e.what);
        }
    }

    #[test]
    fn an_arc_has_its_high_side_on_the_left() {
        let text = "[[shape]]\nkind = \"arc\"\ncentre = [0, 0]\nradius = 5\nspan_deg = [0, 90]\n";
        for s in Drawing::parse(text).unwrap().samples(0.1) {
            assert!(s.nx * s.x + s.ny * s.y > 4.9 && !s.measure);
        }
    }
}
