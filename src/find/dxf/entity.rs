//! In: one entity of a DXF file. Out: what its tags state: positions, sizes, corners, whether it is level and whether
//! it is seen from below.
//! Frame and unit: the entity's own x y z, the drawing's own unit; angles in rad.

use super::flatten::arc;
use super::tags::Entity;
use crate::fault::Result;

/// Its position, or its start point.
pub(super) fn point(e: &Entity) -> Result<[f64; 2]> {
    Ok([e.needed(10)?, e.needed(20)?])
}

/// A length, which must be above 0.
pub(super) fn size(e: &Entity, code: i32) -> Result<f64> {
    let value = e.needed(code)?;
    if value > 0.0 { Ok(value) } else { Err(e.fault(format!("group {code} is {value}; allowed: above 0"))) }
}

/// Refuses an entity that rises from `a` to `b`: the edges of a height map's drawing lie in level planes.
pub(super) fn level(e: &Entity, a: f64, b: f64) -> Result<()> {
    if (a - b).abs() <= 1e-6 * (1.0 + a.abs()) {
        return Ok(());
    }
    Err(e
        .fault(format!("it rises from z = {a} to {b}; only flat drawings are read"))
        .cause("a wire frame in three dimensions")
        .next("export a view of the part from above"))
}

/// 1, or -1 where the entity is seen from below: its x axis then points the other way. Refuses a tilted normal.
pub(super) fn mirrored(e: &Entity) -> Result<f64> {
    let n = [e.number(210, 0.0)?, e.number(220, 0.0)?, e.number(230, 1.0)?];
    if n[0].abs() < 1e-6 && n[1].abs() < 1e-6 && n[2] != 0.0 {
        return Ok(n[2].signum());
    }
    Err(e
        .fault(format!("it lies in a plane with normal {n:?}; only flat drawings are read"))
        .cause("a drawing in three dimensions")
        .next("export a view of the part from above"))
}

/// The angle counter-clockwise from one angle to the other, rad; `None` for a full turn.
pub(super) fn turn(from: f64, to: f64) -> Option<f64> {
    let span = (to - from).rem_euclid(std::f64::consts::TAU);
    (1e-6..std::f64::consts::TAU - 1e-6).contains(&span).then_some(span)
}

/// Whether a polyline has a width.
pub(super) fn wide(e: &Entity) -> Result<bool> {
    let mut widths = e.tags.iter().filter(|t| [40, 41, 43].contains(&t.code));
    widths.try_fold(false, |any, t| Ok(any || t.number()? != 0.0))
}

/// The corners of a light polyline and their bulges: group 10 starts a corner, groups 20 and 42 belong to the last one.
pub(super) fn light(e: &Entity) -> Result<Vec<([f64; 2], f64)>> {
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
    Ok(corners)
}

/// The corners of an old polyline and their bulges. A polyline in three dimensions takes its height from its first
/// corner.
pub(super) fn heavy(vertices: &[Entity], flags: i64, z: &mut f64) -> Result<Vec<([f64; 2], f64)>> {
    let mut corners = Vec::new();
    // Bit 16 marks a control point, which the curve does not pass through.
    for v in vertices {
        if v.whole(70, 0)? & 16 == 0 {
            let height = v.number(30, 0.0)?;
            *z = if corners.is_empty() && flags & 8 != 0 { height } else { *z };
            level(v, if flags & 8 != 0 { *z } else { height }, height)?;
            corners.push((point(v)?, v.number(42, 0.0)?));
        }
    }
    Ok(corners)
}

/// The points of an ellipse or an elliptical arc, and whether it is closed.
pub(super) fn ellipse(e: &Entity, flat: f64) -> Result<(Vec<[f64; 2]>, bool)> {
    use std::f64::consts::TAU;
    let (c, a) = (point(e)?, [e.needed(11)?, e.needed(21)?]);
    let ratio = mirrored(e)? * size(e, 40)?;
    let b = [-a[1] * ratio, a[0] * ratio];
    let from = e.number(41, 0.0)?;
    let span = turn(from, e.number(42, TAU)?);
    let unit = arc([0.0; 2], 1.0, from, from + span.unwrap_or(TAU), flat / a[0].hypot(a[1]));
    let points = unit.iter().map(|p| std::array::from_fn(|k| c[k] + p[0] * a[k] + p[1] * b[k])).collect();
    Ok((points, span.is_none()))
}
