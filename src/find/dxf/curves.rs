//! In: the entities of a DXF file. Out: its curves as polylines and circles, blocks inserted, in one plane seen from above.
//! Frame and unit: the drawing's own x y z and its own unit; angles in degrees in the file.

use super::tags::{Entity, File, Tag};
use crate::fault::{Fault, Result};
use std::collections::{BTreeMap, BTreeSet};

/// A curve of the drawing.
#[derive(Clone, Debug)]
pub struct Curve {
    pub layer: String,
    pub z: f64,
    pub form: Form,
}

#[derive(Clone, Debug)]
pub enum Form {
    Circle { centre: [f64; 2], radius: f64 },
    Path { points: Vec<[f64; 2]>, closed: bool },
}

/// What was read, and what was passed over.
#[derive(Debug, Default)]
pub struct Curves {
    pub curves: Vec<Curve>,
    /// Annotation and hidden entities, by what they are.
    pub passed_over: BTreeMap<String, usize>,
}

/// Limits against a file that inserts blocks in blocks in blocks.
const MOST_POINTS: usize = 400_000;
const DEEPEST: usize = 16;
/// Turn between two points of a flattened curve, rad: the polyline stays within 0.5 per mille of the radius.
const STEP: f64 = std::f64::consts::TAU / 100.0;
/// Entities that say something about edges but are none.
const ANNOTATION: &[&str] = &[
    "TEXT",
    "MTEXT",
    "DIMENSION",
    "ARC_DIMENSION",
    "LEADER",
    "MULTILEADER",
    "HATCH",
    "POINT",
    "ATTRIB",
    "ATTDEF",
    "VIEWPORT",
    "TOLERANCE",
    "WIPEOUT",
    "IMAGE",
    "XLINE",
    "RAY",
    "ACAD_TABLE",
    "OLE2FRAME",
];

/// A similarity or a stretch of the plane, and a shift along z.
#[derive(Clone, Copy)]
struct Placed {
    x: [f64; 2],
    y: [f64; 2],
    origin: [f64; 2],
    z: f64,
    /// Scale along z, negative where it is seen from below.
    rise: f64,
}

impl Placed {
    const HERE: Placed = Placed { x: [1.0, 0.0], y: [0.0, 1.0], origin: [0.0; 2], z: 0.0, rise: 1.0 };

    fn point(&self, p: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|k| self.x[k] * p[0] + self.y[k] * p[1] + self.origin[k])
    }

    fn height(&self, z: f64) -> f64 {
        self.z + self.rise * z
    }

    /// First `inner`, then this one.
    fn after(&self, inner: &Placed) -> Placed {
        let turn = |v: [f64; 2]| std::array::from_fn(|k| self.x[k] * v[0] + self.y[k] * v[1]);
        let (z, rise) = (self.height(inner.z), self.rise * inner.rise);
        Placed { x: turn(inner.x), y: turn(inner.y), origin: self.point(inner.origin), z, rise }
    }

    /// The scale where circles stay circles.
    fn scale(&self) -> Option<f64> {
        let (a, b) = (self.x[0].hypot(self.x[1]), self.y[0].hypot(self.y[1]));
        let square = (self.x[0] * self.y[0] + self.x[1] * self.y[1]).abs();
        ((a - b).abs() < 1e-9 * a && square < 1e-9 * a * b).then_some(a)
    }
}

/// The curves of all layers, or of the named ones.
pub fn curves(file: &File, layers: &[String]) -> Result<Curves> {
    let mut reader = Reader { file, layers, out: Curves::default(), unread: BTreeMap::new(), points: 0 };
    reader.list(&file.entities, &Placed::HERE, "0", &mut BTreeSet::new())?;
    if !reader.unread.is_empty() {
        let list: Vec<String> =
            reader.unread.iter().map(|(kind, (n, line))| format!("{n} {kind} (line {line})")).collect();
        return Err(Fault::input(format!("holds edges that are not read: {}", list.join(", ")))
            .cause("the drawing has free-form curves, solids or a program's own objects")
            .next("explode them to lines and arcs, or name the layers of the part's edges with --layer"));
    }
    Ok(reader.out)
}

struct Reader<'a> {
    file: &'a File,
    layers: &'a [String],
    out: Curves,
    unread: BTreeMap<String, (usize, usize)>,
    points: usize,
}

impl Reader<'_> {
    fn list(&mut self, list: &[Entity], placed: &Placed, parent: &str, open: &mut BTreeSet<String>) -> Result<()> {
        let mut i = 0;
        while let Some(e) = list.get(i) {
            i += 1;
            // The vertices of an old polyline follow it.
            let vertices = list[i..].iter().take_while(|v| e.kind == "POLYLINE" && v.kind == "VERTEX").count();
            let vertices = &list[i..i + vertices];
            i += vertices.len();
            // Ends a list of vertices or of a block's texts.
            if e.kind == "SEQEND" {
                continue;
            }
            // What lies on layer 0 of a block lies on the layer of its insertion.
            let layer = if e.layer() == "0" { parent } else { e.layer() };
            let wanted = self.layers.is_empty() || self.layers.iter().any(|l| l == layer) || e.kind == "INSERT";
            let shown = !self.file.hidden.contains(layer) && e.whole(60, 0)? == 0 && e.whole(67, 0)? == 0;
            if ANNOTATION.contains(&e.kind.as_str()) || !wanted || !shown {
                let what = if wanted && shown { e.kind.clone() } else { format!("{} on layer {layer}", e.kind) };
                *self.out.passed_over.entry(what).or_default() += 1;
            } else if e.kind == "INSERT" {
                self.insert(e, placed, layer, open)?;
            } else {
                self.curve(e, vertices, placed, layer)?;
            }
        }
        Ok(())
    }

    fn insert(&mut self, e: &Entity, placed: &Placed, layer: &str, open: &mut BTreeSet<String>) -> Result<()> {
        let name = e.text(2).unwrap_or_default().to_owned();
        let Some(block) = self.file.blocks.get(&name) else {
            return Err(e.fault(format!("it inserts '{name}', which is no block")).next("bind external references"));
        };
        if open.len() >= DEEPEST || !open.insert(name.clone()) {
            return Err(e.fault(format!("block '{name}' lies in itself, or {DEEPEST} blocks deep")).next("explode it"));
        }
        let mirror = mirrored(e)?;
        let (sx, sy) = (e.number(41, 1.0)?, e.number(42, 1.0)?);
        let (s, c) = e.number(50, 0.0)?.to_radians().sin_cos();
        let [columns, rows] = [e.whole(70, 1)?.max(1), e.whole(71, 1)?.max(1)];
        if columns.saturating_mul(rows) > 10_000 {
            return Err(e.fault(format!("an array of {columns} x {rows}, at most 10000 are read")));
        }
        let (base, at) = (point(&block.head)?, point(e)?);
        for k in 0..columns * rows {
            let step = [(k % columns) as f64 * e.number(44, 0.0)?, (k / columns) as f64 * e.number(45, 0.0)?];
            let moved = [step[0] - sx * base[0], step[1] - sy * base[1]];
            let own = Placed {
                x: [mirror * sx * c, sx * s],
                y: [mirror * -sy * s, sy * c],
                origin: [mirror * (at[0] + c * moved[0] - s * moved[1]), at[1] + s * moved[0] + c * moved[1]],
                z: mirror * e.number(30, 0.0)?,
                rise: mirror * e.number(43, 1.0)?,
            };
            self.list(&block.entities, &placed.after(&own), layer, open)?;
        }
        open.remove(&name);
        Ok(())
    }

    fn curve(&mut self, e: &Entity, vertices: &[Entity], placed: &Placed, layer: &str) -> Result<()> {
        let mut mirror = mirrored(e)?;
        let mut z = e.number(30, 0.0)?;
        let (points, closed) = match e.kind.as_str() {
            "LINE" => {
                // A line's ends are given in the drawing's own axes.
                mirror = 1.0;
                let to = [e.needed(11)?, e.needed(21)?];
                level(e, z, e.number(31, 0.0)?)?;
                (vec![point(e)?, to], false)
            }
            "CIRCLE" => {
                let (centre, radius) = (point(e)?, size(e, 40)?);
                if let Some(k) = placed.scale() {
                    let centre = placed.point([mirror * centre[0], centre[1]]);
                    return self.add(layer, placed.height(mirror * z), Form::Circle { centre, radius: radius * k }, 1);
                }
                (arc(centre, radius, 0.0, std::f64::consts::TAU), true)
            }
            "ARC" => {
                let (from, to) = (e.needed(50)?.to_radians(), e.needed(51)?.to_radians());
                let span = (to - from).rem_euclid(std::f64::consts::TAU);
                let span = if span < 1e-9 { std::f64::consts::TAU } else { span };
                (arc(point(e)?, size(e, 40)?, from, from + span), false)
            }
            "ELLIPSE" => {
                let (c, a) = (point(e)?, [e.needed(11)?, e.needed(21)?]);
                let flip = std::mem::replace(&mut mirror, 1.0);
                let b = [-a[1] * flip * size(e, 40)?, a[0] * flip * size(e, 40)?];
                let from = e.number(41, 0.0)?;
                let span = (e.number(42, std::f64::consts::TAU)? - from).rem_euclid(std::f64::consts::TAU);
                let closed = !(1e-6..std::f64::consts::TAU - 1e-6).contains(&span);
                let span = if closed { std::f64::consts::TAU } else { span };
                let unit = arc([0.0; 2], 1.0, from, from + span);
                (unit.iter().map(|p| std::array::from_fn(|k| c[k] + p[0] * a[k] + p[1] * b[k])).collect(), closed)
            }
            "LWPOLYLINE" => {
                z = e.number(38, 0.0)?;
                (light(e)?, e.whole(70, 0)? & 1 != 0)
            }
            "POLYLINE" => {
                let flags = e.whole(70, 0)?;
                if flags & (16 | 64) != 0 {
                    self.unread.entry("POLYLINE mesh".into()).or_insert((0, e.line)).0 += 1;
                    return Ok(());
                }
                let mut corners = Vec::new();
                // Bit 16: a control point that the curve does not pass.
                for v in vertices {
                    if v.whole(70, 0)? & 16 == 0 {
                        let height = v.number(30, 0.0)?;
                        z = if corners.is_empty() && flags & 8 != 0 { height } else { z };
                        level(v, if flags & 8 != 0 { z } else { height }, height)?;
                        corners.push((point(v)?, v.number(42, 0.0)?));
                    }
                }
                (bent(&corners, flags & 1 != 0), flags & 1 != 0)
            }
            other => {
                self.unread.entry(other.to_owned()).or_insert((0, e.line)).0 += 1;
                return Ok(());
            }
        };
        let points: Vec<[f64; 2]> = points.into_iter().map(|p| placed.point([mirror * p[0], p[1]])).collect();
        let n = points.len();
        self.add(layer, placed.height(mirror * z), Form::Path { points, closed }, n)
    }

    fn add(&mut self, layer: &str, z: f64, form: Form, points: usize) -> Result<()> {
        self.points += points;
        if self.points > MOST_POINTS {
            return Err(Fault::input(format!("has more than {MOST_POINTS} points of edges"))
                .cause("a whole assembly, or blocks inserted in blocks")
                .next("export the part alone, or name its layers with --layer"));
        }
        self.out.curves.push(Curve { layer: layer.to_owned(), z, form });
        Ok(())
    }
}

fn point(e: &Entity) -> Result<[f64; 2]> {
    Ok([e.needed(10)?, e.needed(20)?])
}

fn size(e: &Entity, code: i32) -> Result<f64> {
    let value = e.needed(code)?;
    if value > 0.0 { Ok(value) } else { Err(e.fault(format!("group {code} is {value}, wanted above 0"))) }
}

/// Edges lie in level planes: what rises has no place in a height map's drawing.
fn level(e: &Entity, a: f64, b: f64) -> Result<()> {
    if (a - b).abs() <= 1e-6 * (1.0 + a.abs()) {
        return Ok(());
    }
    Err(e
        .fault(format!("it rises from z = {a} to {b}; only flat drawings are read"))
        .cause("a wire frame in three dimensions")
        .next("export a view of the part from above"))
}

/// 1, or -1 where the entity is seen from below: its x axis then points the other way.
fn mirrored(e: &Entity) -> Result<f64> {
    let n = [e.number(210, 0.0)?, e.number(220, 0.0)?, e.number(230, 1.0)?];
    if n[0].abs() < 1e-6 && n[1].abs() < 1e-6 && n[2] != 0.0 {
        return Ok(n[2].signum());
    }
    Err(e
        .fault(format!("it lies in a plane with normal {n:?}; only flat drawings are read"))
        .cause("a drawing in three dimensions")
        .next("export a view of the part from above"))
}

fn arc(centre: [f64; 2], radius: f64, from: f64, to: f64) -> Vec<[f64; 2]> {
    let steps = ((to - from).abs() / STEP).ceil().max(2.0) as usize;
    (0..=steps)
        .map(|i| {
            let (s, c) = (from + (to - from) * i as f64 / steps as f64).sin_cos();
            [centre[0] + radius * c, centre[1] + radius * s]
        })
        .collect()
}

/// The corners of a light polyline: 10 starts one, 20 and 42 belong to the last.
fn light(e: &Entity) -> Result<Vec<[f64; 2]>> {
    let mut corners: Vec<([f64; 2], f64)> = Vec::new();
    for t in &e.tags {
        match (t.code, corners.last_mut()) {
            (10, _) => corners.push(([t.number()?, f64::NAN], 0.0)),
            (20, Some(c)) => c.0[1] = t.number()?,
            (42, Some(c)) => c.1 = t.number()?,
            _ => {}
        }
    }
    let told = e.whole(90, corners.len() as i64)?;
    if told != corners.len() as i64 || corners.iter().any(|c| c.0[1].is_nan()) {
        return Err(e.fault(format!("{} corners, {told} are announced", corners.len())).cause("a damaged file"));
    }
    Ok(bent(&corners, e.tags.iter().find(|t| t.code == 70).map_or(Ok(0), Tag::whole)? & 1 != 0))
}

/// A polyline whose pieces may be arcs: the bulge is the tangent of a quarter of the arc's angle, positive to the left.
fn bent(corners: &[([f64; 2], f64)], closed: bool) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for (i, &(a, bulge)) in corners.iter().enumerate() {
        out.push(a);
        let Some(&(b, _)) = corners.get(i + 1).or(corners.first().filter(|_| closed)) else { continue };
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let chord = dx.hypot(dy);
        if bulge.abs() < 1e-9 || chord == 0.0 {
            continue;
        }
        let rise = (1.0 - bulge * bulge) / (4.0 * bulge);
        let centre = [0.5 * (a[0] + b[0]) - dy * rise, 0.5 * (a[1] + b[1]) + dx * rise];
        let from = (a[1] - centre[1]).atan2(a[0] - centre[0]);
        let radius = (a[0] - centre[0]).hypot(a[1] - centre[1]);
        let bow = arc(centre, radius, from, from + 4.0 * bulge.atan());
        out.extend(&bow[1..bow.len() - 1]);
    }
    out
}
