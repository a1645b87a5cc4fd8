//! In: the entities of a DXF file. Out: its curves as polylines and circles, with inserted blocks expanded, in one
//! plane seen from above.
//! Frame and unit: the drawing's own x y z and its own unit; angles in degrees in the file.

use super::entity::{ellipse, heavy, level, light, mirrored, point, size, turn, wide};
use super::flatten::{arc, bent};
use super::spline::Spline;
use super::tags::{Entity, File, Tag, key};
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

/// The curves that were read, and counts of what was skipped or is doubtful.
#[derive(Debug, Default)]
pub struct Curves {
    pub curves: Vec<Curve>,
    /// Skipped entities, such as annotation and hidden ones, counted by kind and reason.
    pub passed_over: BTreeMap<String, usize>,
    /// Edges whose linetype is not continuous, counted by linetype. Centre lines and hidden edges are drawn this way.
    pub broken: BTreeMap<String, usize>,
    /// Number of polylines with a width: their middle line is read.
    pub wide: usize,
}

/// Limits against a file that nests blocks in blocks many times.
const MOST_POINTS: usize = 400_000;
const DEEPEST: usize = 16;
/// Entities that annotate edges but are not edges themselves.
const ANNOTATION: &[&str] = &[
    "TEXT",
    "MTEXT",
    "DIMENSION",
    "ARC_DIMENSION",
    "LARGE_RADIAL_DIMENSION",
    "LEADER",
    "MULTILEADER",
    "MLEADER",
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
    "PDFUNDERLAY",
];

/// Where a block is placed: an affine map of the plane, and a scale and shift along z.
#[derive(Clone, Copy)]
struct Placed {
    x: [f64; 2],
    y: [f64; 2],
    origin: [f64; 2],
    z: f64,
    /// Scale along z, negative where the block is seen from below.
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

    /// The composition: `inner` is applied first, then `self`.
    fn after(&self, inner: &Placed) -> Placed {
        let turn = |v: [f64; 2]| std::array::from_fn(|k| self.x[k] * v[0] + self.y[k] * v[1]);
        let (z, rise) = (self.height(inner.z), self.rise * inner.rise);
        Placed { x: turn(inner.x), y: turn(inner.y), origin: self.point(inner.origin), z, rise }
    }

    /// The largest stretch of any direction: the larger singular value of the two axes. Nested blocks of unequal scales
    /// shear, and then it is beyond the length of either axis.
    fn growth(&self) -> f64 {
        let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        let (p, q, r) = (dot(self.x, self.x), dot(self.y, self.y), dot(self.x, self.y));
        (0.5 * (p + q + (p - q).hypot(2.0 * r))).sqrt()
    }

    /// The scale if circles stay circles; `None` otherwise.
    fn scale(&self) -> Option<f64> {
        let (a, b) = (self.x[0].hypot(self.x[1]), self.y[0].hypot(self.y[1]));
        let square = (self.x[0] * self.y[0] + self.x[1] * self.y[1]).abs();
        ((a - b).abs() < 1e-9 * a && square < 1e-9 * a * b).then_some(a)
    }
}

/// The curves of all layers, or of the named ones; each polyline lies within `flat` of the curve it approximates.
/// Refuses a named layer that holds nothing, and edges that cannot be read.
pub fn curves(file: &File, layers: &[String], flat: f64) -> Result<Curves> {
    let wanted = layers.iter().map(|l| key(l)).collect();
    let out = Curves::default();
    let mut reader = Reader { file, wanted, flat, out, layers: BTreeMap::new(), unread: BTreeMap::new(), points: 0 };
    reader.list(&file.entities, &Placed::HERE, "0", &mut BTreeSet::new())?;
    if let Some(missing) = layers.iter().find(|l| !reader.layers.contains_key(&key(l))) {
        let names: Vec<&str> = reader.layers.values().map(String::as_str).collect();
        return Err(Fault::usage(format!("--layer {missing}: nothing in the drawing lies on it"))
            .cause("a misspelt name")
            .next(format!("name one of its {} layers: {}", names.len(), names.join(", "))));
    }
    if !reader.unread.is_empty() {
        let list: Vec<String> =
            reader.unread.iter().map(|(kind, (n, line))| format!("{n} {kind} (line {line})")).collect();
        return Err(Fault::input(format!("holds edges that are not read: {}", list.join(", ")))
            .cause("the drawing has filled areas, solids or a program's own objects")
            .next("explode them to lines and arcs, or name the layers of the part's edges with --layer"));
    }
    Ok(reader.out)
}

struct Reader<'a> {
    file: &'a File,
    /// Keys of the layers that the user named; empty: all visible layers.
    wanted: BTreeSet<String>,
    /// How far a polyline may lie from its curve, in the drawing's unit.
    flat: f64,
    out: Curves,
    /// Every layer that holds an entity, spelled as in the file, by its key.
    layers: BTreeMap<String, String>,
    unread: BTreeMap<String, (usize, usize)>,
    points: usize,
}

impl Reader<'_> {
    fn list(&mut self, list: &[Entity], placed: &Placed, parent: &str, open: &mut BTreeSet<String>) -> Result<()> {
        let mut i = 0;
        while let Some(e) = list.get(i) {
            i += 1;
            // The vertices of an old-style POLYLINE follow it.
            let vertices = list[i..].iter().take_while(|v| e.kind == "POLYLINE" && v.kind == "VERTEX").count();
            let vertices = &list[i..i + vertices];
            i += vertices.len();
            // SEQEND ends a list of vertices or of a block's texts.
            if e.kind == "SEQEND" {
                continue;
            }
            // An entity on layer 0 of a block takes the layer of the block's insertion.
            let layer = if e.layer() == "0" { parent } else { e.layer() };
            self.layers.entry(key(layer)).or_insert_with(|| layer.to_owned());
            if let Some(why) = self.passed(e, layer)? {
                *self.out.passed_over.entry(why).or_default() += 1;
            } else if e.kind == "INSERT" {
                self.insert(e, placed, layer, open)?;
            } else {
                self.curve(e, vertices, placed, layer)?;
            }
        }
        Ok(())
    }

    /// Why an entity is skipped, in words; `None` if it is read.
    fn passed(&self, e: &Entity, layer: &str) -> Result<Option<String>> {
        let named = self.wanted.contains(&key(layer));
        let table = self.file.layers.get(&key(layer));
        let (off, frozen) = table.map_or((false, false), |l| (l.off, l.frozen));
        // A block's entities on other layers stay visible where the insertion's layer is off, but not where it is
        // frozen.
        let block = e.kind == "INSERT";
        let why = if ANNOTATION.contains(&e.kind.as_str()) {
            String::new()
        } else if e.whole(67, 0)? != 0 {
            " in paper space".into()
        } else if e.whole(60, 0)? != 0 {
            ", invisible".into()
        } else if !self.wanted.is_empty() && !named && !block {
            format!(" on layer {layer}, which is not asked for")
        } else if frozen && !named {
            format!(" on layer {layer}, which is frozen")
        } else if off && !named && !block {
            format!(" on layer {layer}, which is off")
        } else if key(layer) == "DEFPOINTS" && !named && !block {
            format!(" on layer {layer}, which is never plotted")
        } else if ["CIRCLE", "ARC"].contains(&e.kind.as_str()) && e.number(40, 1.0)? == 0.0 {
            " of radius 0".into()
        } else {
            return Ok(None);
        };
        Ok(Some(e.kind.clone() + &why))
    }

    fn insert(&mut self, e: &Entity, placed: &Placed, layer: &str, open: &mut BTreeSet<String>) -> Result<()> {
        let name = e.text(2).unwrap_or_default().to_owned();
        let block = self.file.blocks.get(&key(&name));
        // Bits 4 and 8: the block's content is in another file.
        let Some(block) = block.filter(|b| b.head.whole(70, 0).is_ok_and(|flags| flags & 12 == 0)) else {
            let what = if block.is_some() { "which is in another file" } else { "which is not a block" };
            return Err(e.fault(format!("it inserts '{name}', {what}")).next("bind external references"));
        };
        if open.len() >= DEEPEST || !open.insert(key(&name)) {
            return Err(e.fault(format!("block '{name}' lies in itself, or {DEEPEST} blocks deep")).next("explode it"));
        }
        let mirror = mirrored(e)?;
        let (sx, sy) = (e.number(41, 1.0)?, e.number(42, 1.0)?);
        if sx == 0.0 || sy == 0.0 {
            return Err(e.fault(format!("it inserts '{name}' scaled by {sx} and {sy}, wanted other than 0")));
        }
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
        open.remove(&key(&name));
        Ok(())
    }

    fn curve(&mut self, e: &Entity, vertices: &[Entity], placed: &Placed, layer: &str) -> Result<()> {
        use std::f64::consts::TAU;
        let flat = self.flat / placed.growth();
        // These are given in the drawing's own axes; their normal states only the direction of extrusion.
        let flags = e.whole(70, 0)?;
        let own = ["LINE", "ELLIPSE", "SPLINE"].contains(&e.kind.as_str()) || (e.kind == "POLYLINE" && flags & 8 != 0);
        let mirror = if own { 1.0 } else { mirrored(e)? };
        let mut z = e.number(30, 0.0)?;
        let round = |centre: [f64; 2], radius: f64| match placed.scale() {
            Some(k) => Form::Circle { centre: placed.point([mirror * centre[0], centre[1]]), radius: radius * k },
            None => path(placed, mirror, &arc(centre, radius, 0.0, TAU, flat), true),
        };
        let form = match e.kind.as_str() {
            "LINE" => {
                level(e, z, e.number(31, 0.0)?)?;
                path(placed, 1.0, &[point(e)?, [e.needed(11)?, e.needed(21)?]], false)
            }
            "CIRCLE" => round(point(e)?, size(e, 40)?),
            "ARC" => {
                let (from, to) = (e.needed(50)?.to_radians(), e.needed(51)?.to_radians());
                match turn(from, to) {
                    Some(span) => path(placed, mirror, &arc(point(e)?, size(e, 40)?, from, from + span, flat), false),
                    None => round(point(e)?, size(e, 40)?),
                }
            }
            "ELLIPSE" => {
                let (points, closed) = ellipse(e, flat)?;
                path(placed, 1.0, &points, closed)
            }
            "LWPOLYLINE" => {
                z = e.number(38, 0.0)?;
                self.out.wide += usize::from(wide(e)?);
                path(placed, mirror, &bent(&light(e)?, flags & 1 != 0, flat), flags & 1 != 0)
            }
            "POLYLINE" => {
                if flags & (16 | 64) != 0 {
                    return self.skip("POLYLINE mesh", e);
                }
                self.out.wide += usize::from(wide(e)?);
                let corners = heavy(vertices, flags, &mut z)?;
                path(placed, mirror, &bent(&corners, flags & 1 != 0, flat), flags & 1 != 0)
            }
            "SPLINE" => {
                let Some(spline) = Spline::of(e)? else { return self.skip("SPLINE of fit points alone", e) };
                let heights = e.tags.iter().filter(|t| t.code == 30);
                heights.map(Tag::number).try_for_each(|h| level(e, z, h?))?;
                path(placed, 1.0, &spline.flat(flat), false)
            }
            other => return self.skip(other, e),
        };
        self.count_broken(e, layer);
        self.add(layer, placed.height(mirror * z), form)
    }

    /// Counts an edge whose linetype is not continuous.
    fn count_broken(&mut self, e: &Entity, layer: &str) {
        let table = self.file.layers.get(&key(layer)).map(|l| l.linetype.as_str());
        let linetype = e.text(6).filter(|t| key(t) != "BYLAYER").or(table).unwrap_or_default();
        if !["", "CONTINUOUS", "BYBLOCK", "BYLAYER"].contains(&key(linetype).as_str()) {
            *self.out.broken.entry(linetype.trim().to_owned()).or_default() += 1;
        }
    }

    /// Records an edge that cannot be read: the drawing will be refused, and the error names all such edges.
    fn skip(&mut self, kind: &str, e: &Entity) -> Result<()> {
        self.unread.entry(kind.to_owned()).or_insert((0, e.line)).0 += 1;
        Ok(())
    }

    fn add(&mut self, layer: &str, z: f64, form: Form) -> Result<()> {
        self.points += if let Form::Path { points, .. } = &form { points.len() } else { 1 };
        if self.points > MOST_POINTS {
            return Err(Fault::input(format!("has more than {MOST_POINTS} points of edges"))
                .cause("a whole assembly, or blocks inserted in blocks")
                .next("export the part alone, or name its layers with --layer"));
        }
        self.out.curves.push(Curve { layer: layer.to_owned(), z, form });
        Ok(())
    }
}

fn path(placed: &Placed, mirror: f64, points: &[[f64; 2]], closed: bool) -> Form {
    Form::Path { points: points.iter().map(|p| placed.point([mirror * p[0], p[1]])).collect(), closed }
}

#[cfg(test)]
mod tests {
    use super::Placed;

    #[test]
    fn a_nested_block_grows_by_its_largest_stretch() {
        // Three times as long, then turned by 45 degrees, then three times as long again.
        let long = Placed { x: [3.0, 0.0], ..Placed::HERE };
        let h = 0.5_f64.sqrt();
        let turned = Placed { x: [h, h], y: [-h, h], ..Placed::HERE };
        let all = long.after(&turned).after(&long);
        let length = |v: [f64; 2]| v[0].hypot(v[1]);
        let by_hand = (0..3600).map(|i| f64::from(i) * 1e-3).map(|a| {
            let [c, s] = [a.cos(), a.sin()];
            length([all.x[0] * c + all.y[0] * s, all.x[1] * c + all.y[1] * s])
        });
        let most = by_hand.fold(0.0, f64::max);
        assert!((all.growth() - most).abs() < 1e-5 && most > 1.03 * length(all.x).max(length(all.y)), "{most}");
    }
}
