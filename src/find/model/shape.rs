//! In: one shape of a drawing, as the user wrote it. Out: the shape, checked; its outline as a polyline,
//! counter-clockwise if it is closed.
//! Frame and unit: the part's frame; mm.

use super::outline::{arc, area};
use crate::fault::{Fault, Result};

/// Most elements of a grid.
const MOST_ELEMENTS: u64 = 10_000;

/// The kinds of shape in a drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// Closed; has centre, size and turn.
    Rectangle,
    /// Closed; has centre and radius.
    Circle,
    /// Closed; has three corners or more.
    Polygon,
    /// Open; has two ends.
    Line,
    /// Open; has centre, radius and span.
    Arc,
}

/// Which side of an edge is the higher (brighter) one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inside {
    /// The inside of a closed shape is material. For a line or an arc (from start to end), the left side is the high
    /// one.
    #[default]
    High,
    /// The inside is a hole in the surface at `z_mm`. For a line or an arc, the right side is the high one.
    Low,
    /// Unknown; the direction of the edge's contrast is ignored.
    Either,
}

/// A rectangular array about the shape's own position.
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
    /// Kind of the shape; it states which of the other keys are needed.
    pub kind: Form,
    /// Name by which constructions refer to it: `name`, or `name[column,row]` in a grid, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// rectangle, circle, arc: centre, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre: Option<[f64; 2]>,
    /// rectangle: full width and height, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<[f64; 2]>,
    /// circle, arc: radius, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// rectangle: turn about its centre, degrees. Default 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_deg: Option<f64>,
    /// arc: start and end, counter-clockwise, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub span_deg: Option<[f64; 2]>,
    /// polygon: corners; line: its two ends; mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points: Option<Vec<[f64; 2]>>,
    /// Which side of its edges is the higher one. Default high.
    #[serde(default)]
    pub inside: Inside,
    /// Height of the surface that the shape forms (high) or cuts into (low), mm. Default 0, the datum.
    #[serde(default)]
    pub z_mm: f64,
    /// Repeats the shape about its own position. Default once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<Grid>,
    /// Used by the search for the part. Default true.
    #[serde(default = "yes")]
    pub search: bool,
    /// Its edges are measured on the points. Default true.
    #[serde(default = "yes")]
    pub measure: bool,
    /// Its edges locate the part. False for shapes that are only measured separately, such as contacts whose springs
    /// and lips blur their edges. Default true.
    #[serde(default = "yes")]
    pub locates: bool,
}

impl Shape {
    /// A shape on the datum surface without its dimensions; all else has its default value.
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

impl Shape {
    /// Number of elements of its grid; 1 without a grid.
    pub fn elements(&self) -> usize {
        self.grid.map_or(1, |g| g.count[0] as usize * g.count[1] as usize)
    }

    pub(in crate::find) fn check(&self) -> Result<()> {
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

impl Shape {
    /// Corner points, counter-clockwise for closed shapes, and whether it is closed. Curves are divided so finely that
    /// chords stay within 0.5 per mille of the radius.
    pub(in crate::find) fn outline(&self) -> (Vec<[f64; 2]>, bool) {
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
