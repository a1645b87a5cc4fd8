//! In: a drawing (TOML): rectangles, circles, polygons, lines, arcs and grids of them, each on a surface.
//! Out: the same, checked, and where its named shapes stand; drawn_edges.rs makes faces and edges of it.
//! Frame and unit: the part's frame (x along the long axis, z out of the part); mm.

use super::outline::length;
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

impl Shape {
    /// A shape on the datum surface without its dimensions; all else as where a file names nothing.
    pub fn new(kind: Form, inside: Inside) -> Shape {
        Shape {
            kind,
            name: None,
            centre: None,
            size: None,
            radius: None,
            angle_deg: None,
            span_deg: None,
            points: None,
            inside,
            z_mm: 0.0,
            grid: None,
            search: yes(),
            measure: yes(),
            locates: yes(),
        }
    }
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

/// Limits of a drawing. They keep the memory of a search below 512 MB and its time to some seconds; a part of that size
/// lies before no sensor of this kind. Corners count those by which circles and arcs are cut into lines.
const MOST_CORNERS: f64 = 1.2e6;
const MOST_EDGE_MM: f64 = 1e5;
const MOST_HEIGHTS: f64 = 100.0;
const MOST_LENGTH_MM: f64 = 1e4;
const MOST_BOX_MM2: f64 = 4e6;
/// Most elements of a grid.
const MOST_ELEMENTS: u64 = 10_000;

impl Drawing {
    pub fn parse(text: &str) -> Result<Drawing> {
        let drawing: Drawing = toml::from_str(text).map_err(|e| {
            Fault::input(format!("is not a drawing: {}", e.message()))
                .cause(crate::files::slip_at(text, e.span().map_or(0, |s| s.start), "a misspelt key or a missing entry"))
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
        self.check_size()
    }

    /// Refuses what no part is and no search ends with: a slipped decimal point, a whole assembly.
    fn check_size(&self) -> Result<()> {
        let corners: usize = self.shape.iter().map(|s| s.outline().0.len() * s.elements()).sum();
        let mut heights: Vec<f64> = self.shape.iter().map(|s| s.z_mm).collect();
        heights.sort_by(f64::total_cmp);
        heights.dedup();
        let limit = |what: &str, value: f64, most: f64| {
            if value <= most {
                return Ok(());
            }
            Err(Fault::input(format!("the drawing has {value:.0} {what}, limit {most:.0}"))
                .cause("a slipped decimal point, another unit, or more than one part")
                .next("correct the sizes, or draw only what the scan is to be compared with"))
        };
        limit("corners", corners as f64, MOST_CORNERS)?;
        limit("mm of edges", self.edge_length(), MOST_EDGE_MM)?;
        limit("heights", heights.len() as f64, MOST_HEIGHTS)?;
        let [x0, y0, x1, y1] = self.bounds();
        limit("mm from end to end", (x1 - x0).max(y1 - y0), MOST_LENGTH_MM)?;
        limit("mm² in the box around it", (x1 - x0) * (y1 - y0), MOST_BOX_MM2)
    }

    /// Length of all edges, mm.
    pub fn edge_length(&self) -> f64 {
        let of = |s: &Shape| {
            let (points, closed) = s.outline();
            length(&points, closed) * s.elements() as f64
        };
        self.shape.iter().map(of).sum()
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
}

impl Shape {
    /// How often its grid repeats it.
    pub fn elements(&self) -> usize {
        self.grid.map_or(1, |g| g.count[0] as usize * g.count[1] as usize)
    }

    fn check(&self) -> Result<()> {
        const NEXT: &str = "compare it with docs/file-formats.md, Drawing";
        let needs = |ok: bool, what: &str| {
            if ok {
                return Ok(());
            }
            Err(Fault::input(format!("a {:?} needs {what}", self.kind).to_lowercase()).next(NEXT))
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
                    .cause("a key of another kind of shape")
                    .next(NEXT));
            }
        }
        if self.angle_deg.is_some() && self.kind != Form::Rectangle {
            return Err(Fault::input("angle_deg turns rectangles only").next("take it out, or draw a polygon"));
        }
        let numbers = [self.centre, self.size, self.span_deg].into_iter().flatten().flatten().chain(self.radius);
        let all: Vec<f64> = numbers
            .chain(self.points.iter().flatten().flatten().copied())
            .chain(self.angle_deg)
            .chain([self.z_mm])
            .collect();
        needs(all.iter().all(|v| v.is_finite() && v.abs() < 1e5), "numbers below 100000 mm")?;
        needs(self.size.is_none_or(|s| s[0] > 0.0 && s[1] > 0.0), "a size above 0")?;
        needs(self.radius.is_none_or(|r| r > 0.0), "a radius above 0")?;
        needs(self.span_deg.is_none_or(|s| s[1] > s[0]), "a span_deg whose end is above its start")?;
        let want = if self.kind == Form::Line { 2 } else { 3 };
        let n = self.points.as_ref().map_or(want, Vec::len);
        needs(if self.kind == Form::Line { n == 2 } else { n >= 3 }, "2 points (line) or at least 3 (polygon)")?;
        if let Some(g) = self.grid {
            let elements = u64::from(g.count[0]) * u64::from(g.count[1]);
            if !(1..=MOST_ELEMENTS).contains(&elements) {
                return Err(Fault::input(format!("its grid has {elements} elements, limit 1 to {MOST_ELEMENTS}"))
                    .cause("a slip in count")
                    .next("correct count in the drawing"));
            }
            let reach = |i: usize| f64::from(g.count[i] - 1) * g.pitch[i];
            needs((0..2).all(|i| g.count[i] == 1 || g.pitch[i] > 0.0), "a pitch above 0")?;
            needs((0..2).all(|i| g.pitch[i].is_finite() && reach(i) < 1e5), "a grid below 100000 mm")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
