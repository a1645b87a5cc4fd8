//! In: closed loops and open chains of a drawing. Out: shapes: an outline bounds material, a loop inside it a hole, and
//! so on inwards.
//! Frame and unit: part frame; mm.

use super::curves::{Curve, Form as Drawn};
use super::loops::Loop;
use crate::find::model::outline::{area, bounds, contains};
use crate::find::model::shape::{Form, Grid, Inside, Shape};

/// Rounds a length to a micrometre, so that a drawing in inches stays readable.
fn micrometre(v: f64) -> f64 {
    (v * 1000.0).round() / 1000.0 + 0.0
}

/// For each loop, the smallest larger loop around it at the same height. Loops are sorted by size, the largest first.
fn parents(loops: &[Loop]) -> Vec<Option<usize>> {
    let boxes: Vec<[f64; 4]> = loops.iter().map(|l| bounds(&l.points)).collect();
    (0..loops.len())
        .map(|i| {
            let inner = inside_of(&loops[i].points);
            (0..i).rev().find(|&k| {
                let [x0, y0, x1, y1] = boxes[k];
                let near = (x0..=x1).contains(&inner[0]) && (y0..=y1).contains(&inner[1]);
                near && (loops[k].z - loops[i].z).abs() < 1e-6 && contains(&loops[k].points, inner[0], inner[1])
            })
        })
        .collect()
}

/// Joins each island, which is material inside a hole, to the hole's outline through a slit without width.
fn bridge_islands(loops: &mut [Loop], parents: &[Option<usize>], depth: &[usize]) {
    let mut islands: Vec<usize> = (0..loops.len()).filter(|&i| depth[i] >= 2 && depth[i].is_multiple_of(2)).collect();
    islands.sort_by_key(|&i| depth[i]);
    for i in islands {
        let island = loops[i].points.clone();
        let hole = &mut loops[parents[i].expect("its depth is above 0")];
        let bridge = hole.points[0];
        hole.circle = None;
        hole.points.push(bridge);
        hole.points.extend(&island);
        hole.points.push(island[0]);
    }
}

/// The shapes, the largest outline first: it lies on the datum surface.
pub fn shapes(mut loops: Vec<Loop>, open: &[Curve]) -> Vec<Shape> {
    loops.sort_by(|a, b| area(&b.points).abs().total_cmp(&area(&a.points).abs()));
    let datum = loops.first().map_or(0.0, |l| l.z);
    let parents = parents(&loops);
    let mut depth = vec![0usize; loops.len()];
    for i in 0..loops.len() {
        depth[i] = parents[i].map_or(0, |p| depth[p] + 1);
    }
    bridge_islands(&mut loops, &parents, &depth);
    let mut out = Vec::new();
    let mut circles: Vec<(&Loop, Inside, [f64; 2], f64)> = Vec::new();
    for (l, depth) in loops.iter().zip(&depth) {
        let inside = if depth % 2 == 0 { Inside::High } else { Inside::Low };
        if depth % 2 == 0 && *depth > 0 {
            continue;
        }
        match l.circle {
            Some((centre, radius)) => circles.push((l, inside, centre, radius)),
            None => out.push(straight(l, inside, l.z - datum)),
        }
        // The largest outline's shape stays the first.
        if out.is_empty() {
            let (l, inside, centre, radius) = circles.pop().expect("the first loop is one or the other");
            out.push(round(l, inside, l.z - datum, centre, radius, None));
        }
    }
    grids(&mut out, circles, datum);
    for c in open {
        let Drawn::Path { points, .. } = &c.form else { continue };
        for ends in points.windows(2).filter(|w| w[0] != w[1]) {
            let points = Some(ends.iter().map(|p| p.map(micrometre)).collect());
            out.push(Shape { points, ..blank(Form::Line, Inside::Either, c.z - datum) });
        }
    }
    named(&mut out);
    out
}

/// Most sides at which a point just inside an outline is searched: almost every side yields one.
const TRIED: usize = 64;

/// A point just inside an outline; its first corner if none is found.
fn inside_of(p: &[[f64; 2]]) -> [f64; 2] {
    for i in (0..p.len()).step_by(p.len().div_ceil(TRIED).max(1)) {
        let (a, b) = (p[i], p[(i + 1) % p.len()]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        for side in [1e-4, -1e-4] {
            let q = [0.5 * (a[0] + b[0]) - side * dy, 0.5 * (a[1] + b[1]) + side * dx];
            if contains(p, q[0], q[1]) {
                return q;
            }
        }
    }
    p[0]
}

fn blank(kind: Form, inside: Inside, z: f64) -> Shape {
    Shape { z_mm: micrometre(z), ..Shape::new(kind, inside) }
}

/// A rectangle if the loop is one, otherwise a polygon.
fn straight(l: &Loop, inside: Inside, z: f64) -> Shape {
    let name = Some(l.layer.clone());
    if let [a, b, c, d] = l.points[..] {
        let side = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
        let (u, v, w) = (side(a, b), side(b, c), side(d, c));
        let (lu, lv) = (u[0].hypot(u[1]), v[0].hypot(v[1]));
        let even = (u[0] - w[0]).hypot(u[1] - w[1]) < 1e-4 && (u[0] * v[0] + u[1] * v[1]).abs() < 1e-4 * lu.max(lv);
        if even {
            // The angle is kept within 45 deg of zero, so that a rectangle along the axes has its sizes along x and y.
            let turn = u[1].atan2(u[0]).to_degrees().rem_euclid(180.0);
            let (size, turn) = if (45.0 - 1e-9..135.0 - 1e-9).contains(&turn) {
                ([lv, lu], turn - 90.0)
            } else {
                ([lu, lv], if turn > 90.0 { turn - 180.0 } else { turn })
            };
            let centre = Some([0, 1].map(|k| micrometre(0.5 * (a[k] + c[k]))));
            let angle_deg = Some((turn * 1e4).round() / 1e4).filter(|t| *t != 0.0);
            let size = Some(size.map(micrometre));
            return Shape { name, centre, size, angle_deg, ..blank(Form::Rectangle, inside, z) };
        }
    }
    let points = Some(l.points.iter().map(|p| p.map(micrometre)).collect());
    Shape { name, points, ..blank(Form::Polygon, inside, z) }
}

fn round(l: &Loop, inside: Inside, z: f64, centre: [f64; 2], radius: f64, grid: Option<Grid>) -> Shape {
    let (centre, radius) = (Some(centre.map(micrometre)), Some(micrometre(radius)));
    Shape { name: Some(l.layer.clone()), centre, radius, grid, ..blank(Form::Circle, inside, z) }
}

/// Equal circles of a layer that fill a rectangular array become one shape with a grid; the others become single
/// shapes.
fn grids(out: &mut Vec<Shape>, mut circles: Vec<(&Loop, Inside, [f64; 2], f64)>, datum: f64) {
    while let Some(&(first, inside, _, radius)) = circles.first() {
        let alike = |c: &(&Loop, Inside, [f64; 2], f64)| {
            c.0.layer == first.layer && c.1 == inside && c.0.z == first.z && (c.3 - radius).abs() < 1e-3
        };
        let (group, rest): (Vec<_>, Vec<_>) = circles.into_iter().partition(alike);
        circles = rest;
        let axes = [0, 1].map(|k| {
            let mut all: Vec<f64> = group.iter().map(|c| c.2[k]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup_by(|a, b| (*a - *b).abs() < 1e-2);
            let pitch = if all.len() > 1 { (all[all.len() - 1] - all[0]) / (all.len() - 1) as f64 } else { 0.0 };
            let even = all.iter().enumerate().all(|(i, v)| (v - all[0] - pitch * i as f64).abs() < 1e-2);
            (all, pitch, even)
        });
        let [(x, px, even_x), (y, py, even_y)] = &axes;
        if group.len() > 1 && *even_x && *even_y && x.len() * y.len() == group.len() {
            let centre = [0.5 * (x[0] + x[x.len() - 1]), 0.5 * (y[0] + y[y.len() - 1])];
            let grid = Grid { count: [x.len() as u32, y.len() as u32], pitch: [*px, *py].map(micrometre) };
            out.push(round(first, inside, first.z - datum, centre, radius, Some(grid)));
        } else {
            out.extend(group.into_iter().map(|(l, i, centre, r)| round(l, i, l.z - datum, centre, r, None)));
        }
    }
}

/// Names the shapes after their layers and numbers repeated names. On layer 0 the name is `part` or `hole`.
fn named(shapes: &mut [Shape]) {
    let mut count = std::collections::HashMap::<String, usize>::new();
    let bare = |s: &Shape| {
        let layer = s.name.as_deref().unwrap_or("0");
        let what = if s.inside == Inside::High { "part" } else { "hole" };
        if layer == "0" { what.to_owned() } else { layer.replace(['[', ']', ','], "_") }
    };
    shapes.iter().filter(|s| s.kind != Form::Line).for_each(|s| *count.entry(bare(s)).or_default() += 1);
    let mut next = std::collections::HashMap::<String, usize>::new();
    for s in shapes.iter_mut().filter(|s| s.kind != Form::Line) {
        let name = bare(s);
        let k = next.entry(name.clone()).or_default();
        *k += 1;
        s.name = Some(if count[&name] > 1 { format!("{name}{k}") } else { name });
    }
}
