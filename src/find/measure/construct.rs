//! In: named shapes measured one by one, and a recipe's constructions. Out: points, lines and lattices
//! built from them, each beside its nominal value.
//! Frame and unit: the part frame of the measured pose; mm, rad.

use super::options::MeasureOptions;
use super::surface_ends::Observation;
pub use super::values::Value;
use super::values::{line_through, meet, middle, moved};
use crate::fault::{Fault, Result};
use crate::find::model::drawing::Drawing;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::collections::BTreeMap;

/// The kinds of construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Build {
    /// Middle of two or more points.
    Midpoint,
    /// Line through two or more points (the least-squares line).
    Line,
    /// Where two lines meet.
    Intersection,
    /// A point moved by `by_mm` along and across the line or lattice `along`.
    Offset,
    /// Position and turn of all seen elements of a named grid.
    Lattice,
}

/// One construction of a recipe.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Construction {
    /// Name by which the insertion and later constructions refer to it.
    pub name: String,
    /// What is built.
    pub kind: Build,
    /// Shapes (`name`, `name[column,row]`) or earlier constructions.
    pub of: Vec<String>,
    /// For an offset: the shift along and across (a quarter turn counter-clockwise), mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_mm: Option<[f64; 2]>,
    /// For an offset: the line or lattice that gives the direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<String>,
}

/// A construction's outcome.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Built {
    /// The construction's name in the recipe.
    pub name: String,
    /// Built from the measured shapes; part frame.
    pub measured: Value,
    /// Built from the drawing; part frame, sigma 0.
    pub nominal: Value,
    /// Measured less nominal position, mm.
    pub deviation_mm: [f64; 2],
    /// Measured less nominal direction, degrees, -180 to 180; `None` for a bare point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation_deg: Option<f64>,
    /// Number of measured shapes that were used.
    pub shapes: usize,
}

/// A measured shape: its offset from the drawing.
#[derive(Clone, Copy, Debug)]
pub struct Feature {
    /// Measured less drawn centre along the part's x and y, mm.
    pub offset: [f64; 2],
    /// Standard deviation of the offset per axis, mm.
    pub sigma: f64,
}

/// Least number of edges in each of two directions for a shape to be measured separately.
const MIN_EDGES: usize = 2;

/// Measures every element of every named closed shape that is seen well enough: by least squares on its own edges, less
/// the surface growth of the whole part.
pub fn features(
    observations: &[Observation],
    growth: [f64; 2],
    options: &MeasureOptions,
) -> BTreeMap<(usize, usize), Feature> {
    // Least standard deviation of an end, even where its few neighbours agree better.
    let least = 0.03 * options.unit();
    let mut groups: BTreeMap<(usize, usize), Vec<&Observation>> = BTreeMap::new();
    for o in observations.iter().filter(|o| o.weight > 0.0) {
        groups.entry((o.shape, o.element)).or_default().push(o);
    }
    let mut out = BTreeMap::new();
    for (key, list) in groups {
        let along = |axis: usize| list.iter().filter(|o| o.axis == axis).count();
        if along(0) < MIN_EDGES || along(1) < MIN_EDGES {
            continue;
        }
        let (mut a, mut b) = (Matrix2::zeros(), Vector2::zeros());
        for o in &list {
            let n = Vector2::new(o.nx, o.ny);
            a += n * n.transpose();
            b += n * (o.residual - growth[o.axis]);
        }
        // Edges with parallel normals do not determine the offset along them.
        let eigen = a.symmetric_eigenvalues();
        if eigen.min() < 0.1 * eigen.max() {
            continue;
        }
        let Some(inverse) = a.try_inverse() else { continue };
        let t = inverse * b;
        let sum: f64 = list.iter().map(|o| (o.residual - growth[o.axis] - o.nx * t.x - o.ny * t.y).powi(2)).sum();
        let s2 = (sum / (list.len() as f64 - 2.0).max(1.0)).max(least * least);
        out.insert(key, Feature { offset: [t.x, t.y], sigma: (0.5 * inverse.trace() * s2).sqrt() });
    }
    out
}

/// The constructions evaluated on the drawing: measured and nominal are the same.
///
/// # Errors
/// One that refers to nothing, has too few inputs, or cannot be built.
pub fn nominal(list: &[Construction], drawing: &Drawing) -> Result<Vec<Built>> {
    let measured = drawing.shape.iter().enumerate().flat_map(|(shape, s)| {
        let n = s.elements();
        (0..n).map(move |element| ((shape, element), Feature { offset: [0.0, 0.0], sigma: 0.0 }))
    });
    build(list, drawing, &measured.collect(), &MeasureOptions::default())
}

/// Refuses constructions that refer to nothing, have too few inputs, or cannot be built.
pub fn check(list: &[Construction], drawing: &Drawing) -> Result<()> {
    for (i, c) in list.iter().enumerate() {
        if list[..i].iter().any(|o| o.name == c.name) || drawing.named(&c.name).is_ok() || c.name == "pose" {
            return Err(Fault::input(format!("the name '{}' is used twice", c.name)).next("rename one of them"));
        }
    }
    nominal(list, drawing).map(|_| ())
}

/// Evaluates the constructions on measured shapes, in their order. Refuses one that cannot be built.
pub fn build(
    list: &[Construction],
    drawing: &Drawing,
    measured: &BTreeMap<(usize, usize), Feature>,
    options: &MeasureOptions,
) -> Result<Vec<Built>> {
    let mut out: Vec<Built> = Vec::new();
    for c in list {
        let built = one(c, drawing, measured, &out, options).map_err(|e| e.at(format!("construction '{}'", c.name)))?;
        out.push(built);
    }
    Ok(out)
}

/// Measured value, nominal value, and number of shapes that were used.
type Pair = (Value, Value, usize);

fn one(
    c: &Construction,
    drawing: &Drawing,
    measured: &BTreeMap<(usize, usize), Feature>,
    earlier: &[Built],
    options: &MeasureOptions,
) -> Result<Built> {
    if (c.by_mm.is_some() || c.along.is_some()) != (c.kind == Build::Offset) {
        return Err(Fault::input("by_mm and along belong to an offset, and an offset needs both")
            .next("give both, or another kind of construction"));
    }
    let (m, n, shapes) = pair(c, drawing, measured, earlier, options)?;
    let turn = m.direction.zip(n.direction).map(|(a, b)| {
        let d = (a - b).to_degrees().rem_euclid(360.0);
        if d > 180.0 { d - 360.0 } else { d }
    });
    Ok(Built {
        name: c.name.clone(),
        measured: m,
        nominal: n,
        deviation_mm: [m.x - n.x, m.y - n.y],
        deviation_deg: turn,
        shapes,
    })
}

fn pair(
    c: &Construction,
    drawing: &Drawing,
    measured: &BTreeMap<(usize, usize), Feature>,
    earlier: &[Built],
    options: &MeasureOptions,
) -> Result<Pair> {
    let point = |name: &String| named(name, drawing, measured, earlier);
    Ok(match c.kind {
        Build::Midpoint => {
            needs(c, 2, 64)?;
            let all = c.of.iter().map(point).collect::<Result<Vec<_>>>()?;
            (middle(all.iter().map(|p| p.0)), middle(all.iter().map(|p| p.1)), all.iter().map(|p| p.2).sum())
        }
        Build::Line => {
            needs(c, 2, 64)?;
            let all = c.of.iter().map(point).collect::<Result<Vec<_>>>()?;
            let line = |v: Vec<Value>| line_through(&v);
            let (a, b) = (line(all.iter().map(|p| p.0).collect())?, line(all.iter().map(|p| p.1).collect())?);
            (a, b, all.iter().map(|p| p.2).sum())
        }
        Build::Intersection => {
            needs(c, 2, 2)?;
            let (a, b) = (point(&c.of[0])?, point(&c.of[1])?);
            (meet(&a.0, &b.0)?, meet(&a.1, &b.1)?, a.2 + b.2)
        }
        Build::Offset => {
            needs(c, 1, 1)?;
            let (Some(along), Some(by)) = (&c.along, c.by_mm) else {
                return Err(Fault::input(format!("construction '{}' does not say how far along what", c.name))
                    .cause("an offset without 'along' or 'by_mm'")
                    .next("add both: the line to go along, and the millimetres"));
            };
            let (p, d) = (point(&c.of[0])?, point(along)?);
            (moved(&p.0, &d.0, by)?, moved(&p.1, &d.1, by)?, p.2)
        }
        Build::Lattice => {
            needs(c, 1, 1)?;
            lattice(&c.of[0], drawing, measured, options)?
        }
    })
}

fn needs(c: &Construction, least: usize, most: usize) -> Result<()> {
    if (least..=most).contains(&c.of.len()) {
        return Ok(());
    }
    Err(Fault::input(format!("a {:?} of {} things; allowed: {least} to {most}", c.kind, c.of.len()).to_lowercase())
        .cause("an impossible construction")
        .next("correct 'of' in the recipe"))
}

/// An earlier construction, or a shape of the drawing.
fn named(
    name: &String,
    drawing: &Drawing,
    measured: &BTreeMap<(usize, usize), Feature>,
    earlier: &[Built],
) -> Result<Pair> {
    if let Some(b) = earlier.iter().find(|b| b.name == *name) {
        return Ok((b.measured, b.nominal, b.shapes));
    }
    let (shape, element, [x, y]) = drawing.named(name)?;
    let f = measured.get(&(shape, element)).ok_or_else(|| {
        Fault::refused(format!("'{name}' was not seen well enough to be measured"))
            .cause("it is hidden, filled, or between two shots")
            .next("scan with finer steps, or construct on other pins")
    })?;
    let at = |x, y, sigma_mm| Value { x, y, direction: None, sigma_mm };
    Ok((at(x + f.offset[0], y + f.offset[1], f.sigma), at(x, y, 0.0), 1))
}

/// Rigid fit of all measured elements of a grid to their nominal places.
fn lattice(
    name: &str,
    drawing: &Drawing,
    measured: &BTreeMap<(usize, usize), Feature>,
    options: &MeasureOptions,
) -> Result<Pair> {
    let shape = drawing.shape.iter().position(|s| s.name.as_deref() == Some(name));
    let shape = shape.ok_or_else(|| {
        Fault::input(format!("'{name}' names no shape"))
            .cause("a misspelt name")
            .next("name a shape of the recipe that has a grid")
    })?;
    let elements = drawing.shape[shape].elements();
    if elements < 2 {
        return Err(Fault::input(format!("a lattice of '{name}', which has {elements} element, needs at least 2"))
            .cause("an impossible construction")
            .next("give the shape a grid"));
    }
    let seen: Vec<([f64; 2], Feature)> =
        (0..elements).filter_map(|e| measured.get(&(shape, e)).map(|f| (drawing.centre_of(shape, e), *f))).collect();
    if seen.len() < 2 {
        return Err(Fault::refused(format!(
            "{} of {elements} elements of '{name}' were seen well enough, a lattice needs 2",
            seen.len()
        ))
        .cause("they are hidden, filled, or between two shots")
        .next("scan with finer steps"));
    }
    let Moved { step: t, inverse, sigma: s, used } = moved_by(&seen, options);
    let centre = drawing.shape[shape].centre.unwrap_or([0.0, 0.0]);
    let nominal = Value { x: centre[0], y: centre[1], direction: Some(0.0), sigma_mm: 0.0 };
    let value = Value {
        x: centre[0] + t.x - t.z * centre[1],
        y: centre[1] + t.y + t.z * centre[0],
        direction: Some(t.z),
        sigma_mm: s * (0.5 * (inverse[(0, 0)] + inverse[(1, 1)])).sqrt(),
    };
    Ok((value, nominal, used))
}

/// How a grid lies as a whole: its position and turn relative to the drawing.
struct Moved {
    /// Along the part's x and y, mm; turn about its origin, rad.
    step: Vector3<f64>,
    /// Covariance of `step` for elements that scatter by 1 mm.
    inverse: Matrix3<f64>,
    /// Scatter of the elements, mm.
    sigma: f64,
    used: usize,
}

/// Least squares on elements at their nominal places, in two rounds.
fn moved_by(seen: &[([f64; 2], Feature)], options: &MeasureOptions) -> Moved {
    // The second round excludes elements that lie 3 robust sigmas off.
    let (mut t, mut inverse, mut limit) = (Vector3::zeros(), Matrix3::zeros(), f64::MAX);
    let mut used = seen.len();
    for _ in 0..2 {
        let (mut a, mut b) = (Matrix3::zeros(), Vector3::zeros());
        let off = |p: &[f64; 2], f: &Feature, t: &Vector3<f64>| {
            (f.offset[0] - t.x + t.z * p[1], f.offset[1] - t.y - t.z * p[0])
        };
        used = 0;
        for (p, f) in seen {
            let (rx, ry) = off(p, f, &t);
            if rx.hypot(ry) > limit {
                continue;
            }
            used += 1;
            for (j, r) in [(Vector3::new(1.0, 0.0, -p[1]), f.offset[0]), (Vector3::new(0.0, 1.0, p[0]), f.offset[1])] {
                a += j * j.transpose();
                b += j * r;
            }
        }
        let Some(inv) = a.try_inverse() else { break };
        inverse = inv;
        t = inverse * b;
        let mut size: Vec<f64> = seen.iter().map(|(p, f)| off(p, f, &t)).map(|r| r.0.hypot(r.1)).collect();
        size.sort_unstable_by(f64::total_cmp);
        limit = (3.0 * size[size.len() / 2]).max(0.05 * options.unit());
    }
    Moved { step: t, inverse, sigma: limit / 3.0, used }
}
