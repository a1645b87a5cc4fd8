//! In: curves of a drawing. Out: closed loops, joined end to end, and the chains that could not be closed.
//! Frame and unit: the drawing's x y z, mm.

use super::curves::{Curve, Form};
use super::flatten::{FLAT, arc};
use crate::find::model::outline::area;
use std::collections::{HashMap, HashSet};

/// A closed edge.
#[derive(Clone, Debug)]
pub struct Loop {
    pub layer: String,
    pub z: f64,
    pub points: Vec<[f64; 2]>,
    /// Centre and radius of a circle that was drawn as one.
    pub circle: Option<([f64; 2], f64)>,
}

#[derive(Debug, Default)]
pub struct Joined {
    pub loops: Vec<Loop>,
    /// Chains that close no loop, and loops without area.
    pub open: Vec<Curve>,
    /// Number of places at which more than two edges end: no chain runs through them.
    pub forks: usize,
    pub duplicates: usize,
}

/// Ends closer together than this are one place, mm.
pub const JOIN: f64 = 0.01;

/// Nodes, each shared by the ends that lie together; they are found through the cells of a grid.
#[derive(Default)]
struct Nodes {
    cells: HashMap<[i64; 3], Vec<usize>>,
    places: Vec<[f64; 3]>,
}

impl Nodes {
    fn at(&mut self, p: [f64; 2], z: f64) -> usize {
        let q = [p[0], p[1], z];
        let cell = q.map(|v| (v / JOIN).floor() as i64);
        for k in 0..27 {
            // A damaged drawing's coordinates can exceed all cell indices: they saturate at the last cell.
            let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
            let near = [0, 1, 2].map(|i| cell[i].saturating_add(step[i]));
            let known = self.cells.get(&near).into_iter().flatten().copied();
            let found = known.into_iter().find(|&n| (0..3).all(|i| (self.places[n][i] - q[i]).abs() <= JOIN));
            if let Some(n) = found {
                return n;
            }
        }
        self.places.push(q);
        self.cells.entry(cell).or_default().push(self.places.len() - 1);
        self.places.len() - 1
    }
}

/// Joins the curves; an edge that is drawn twice counts once.
pub fn join(curves: &[Curve]) -> Joined {
    let mut out = Joined::default();
    let pieces = pieces(curves, &mut out);
    let mut at: HashMap<usize, Vec<usize>> = HashMap::new();
    for (i, p) in pieces.iter().enumerate() {
        p.ends.iter().for_each(|&n| at.entry(n).or_default().push(i));
    }
    out.forks = at.values().filter(|list| list.len() > 2).count();
    let through = |node: usize, from: usize| -> Option<usize> {
        let list = &at[&node];
        if list.len() == 2 { list.iter().copied().find(|&i| i != from) } else { None }
    };
    let mut used = vec![false; pieces.len()];
    for start in 0..pieces.len() {
        if used[start] {
            continue;
        }
        // Walk back to a free end or a fork, or once around.
        let (mut piece, mut end) = (start, 0);
        while let Some(next) = through(pieces[piece].ends[end], piece).filter(|&n| n != start) {
            end = usize::from(pieces[next].ends[0] == pieces[piece].ends[end]);
            piece = next;
        }
        let first = pieces[piece].ends[end];
        let mut points: Vec<[f64; 2]> = Vec::new();
        let (mut here, mut current) = (first, Some(piece));
        while let Some(i) = current {
            used[i] = true;
            let (ends, list) = (pieces[i].ends, pieces[i].points);
            let forward = ends[0] == here;
            let skip = usize::from(!points.is_empty());
            if forward {
                points.extend(list.iter().skip(skip));
            } else {
                points.extend(list.iter().rev().skip(skip));
            }
            here = ends[usize::from(forward)];
            current = through(here, i).filter(|&n| !used[n]);
        }
        let c = pieces[piece].curve;
        if here == first && points.len() > 3 {
            push(&mut out, c, points);
        } else {
            let form = Form::Path { points, closed: false };
            out.open.push(Curve { layer: c.layer.clone(), z: c.z, form });
        }
    }
    out
}

/// An edge between two places.
struct Piece<'a> {
    /// Nodes at its two ends.
    ends: [usize; 2],
    curve: &'a Curve,
    points: &'a [[f64; 2]],
}

/// The open edges that are to be joined. Closed edges, and the count of edges drawn twice, go to `out`.
fn pieces<'a>(curves: &'a [Curve], out: &mut Joined) -> Vec<Piece<'a>> {
    let mut nodes = Nodes::default();
    let mut seen = HashSet::new();
    let mut pieces = Vec::new();
    for c in curves {
        match &c.form {
            Form::Circle { centre, radius } => {
                let key = [nodes.at(*centre, c.z), nodes.at([centre[0] + radius, centre[1]], c.z), usize::MAX];
                if seen.insert(key) {
                    let mut points = arc(*centre, *radius, 0.0, std::f64::consts::TAU, FLAT);
                    points.pop();
                    let circle = Some((*centre, *radius));
                    out.loops.push(Loop { layer: c.layer.clone(), z: c.z, points, circle });
                } else {
                    out.duplicates += 1;
                }
            }
            Form::Path { points, closed } => {
                let (Some(&first), Some(&last)) = (points.first(), points.last()) else { continue };
                let ends = [nodes.at(first, c.z), nodes.at(last, c.z)];
                let half = points[points.len() / 2];
                let half = if points.len() == 2 { [0, 1].map(|k| 0.5 * (first[k] + last[k])) } else { half };
                let key = [ends[0].min(ends[1]), ends[0].max(ends[1]), nodes.at(half, c.z)];
                if !seen.insert(key) {
                    out.duplicates += 1;
                } else if *closed || (ends[0] == ends[1] && points.len() > 2) {
                    push(out, c, points.clone());
                } else if ends[0] != ends[1] {
                    pieces.push(Piece { ends, curve: c, points });
                }
            }
        }
    }
    pieces
}

/// Adds a closed loop without repeated points. One without area (a line drawn there and back, a bow tie) is still an
/// edge: it goes to `open`.
fn push(out: &mut Joined, c: &Curve, mut points: Vec<[f64; 2]>) {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) > 1e-6;
    points.dedup_by(|a, b| !apart(a, b));
    while points.len() > 1 && !apart(&points[0], &points[points.len() - 1]) {
        points.pop();
    }
    if points.len() > 2 && area(&points).abs() > JOIN * JOIN {
        let circle = circle(&points);
        out.loops.push(Loop { layer: c.layer.clone(), z: c.z, points, circle });
    } else if points.len() > 1 {
        points.extend(points.first().copied().filter(|_| points.len() > 2));
        out.open.push(Curve { layer: c.layer.clone(), z: c.z, form: Form::Path { points, closed: false } });
    }
}

/// Centre and radius where arcs, bulges or a spline draw a full circle.
fn circle(points: &[[f64; 2]]) -> Option<([f64; 2], f64)> {
    let n = points.len();
    if n < 32 {
        return None;
    }
    let (a, b, c) = (points[0], points[n / 3], points[2 * n / 3]);
    let (u, v) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
    let twice = 2.0 * (u[0] * v[1] - u[1] * v[0]);
    let (uu, vv) = (u[0] * u[0] + u[1] * u[1], v[0] * v[0] + v[1] * v[1]);
    let centre = [a[0] + (v[1] * uu - u[1] * vv) / twice, a[1] + (u[0] * vv - v[0] * uu) / twice];
    let off = |p: [f64; 2]| (p[0] - centre[0]).hypot(p[1] - centre[1]);
    let radius = off(a);
    // The corners lie on the circle, and the chords are as close to it as those of a flattened arc. The sides of a
    // polygon are not.
    let near = |i: usize| {
        let (p, q) = (points[i], points[(i + 1) % n]);
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        (off(p) - radius).abs() <= FLAT && radius - off(middle) <= FLAT.max(6e-4 * radius)
    };
    (radius.is_finite() && (0..n).all(near)).then_some((centre, radius))
}
