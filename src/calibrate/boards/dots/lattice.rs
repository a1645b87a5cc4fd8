//! In: round spots of a picture. Out: the square lattices that they form, and the assignment of a grid's dots to them.
//! Frame and unit: pixels; lattice steps.

use crate::geometry::Vec2;
use nalgebra::Matrix2;
use std::collections::{HashMap, VecDeque};

/// A connected patch of elliptic shape.
pub struct Blob {
    pub centre: Vec2,
    /// A of the ellipse qᵀAq = 1, 1/px².
    pub shape: Matrix2<f64>,
    /// Whether it has a hole in its middle.
    pub hole: bool,
}

/// A lattice coordinate.
pub type Node = (i32, i32);
/// Blobs by their lattice coordinates.
pub type Lattice = HashMap<Node, usize>;

/// Blobs in the order of the nodes, once for each rotation that fits.
pub fn labelled(blobs: &[Blob], nodes: &[Node]) -> Option<Vec<Vec<usize>>> {
    seeds(blobs).find_map(|seed| matching(&grow(blobs, seed, nodes.len()), nodes, blobs))
}

/// The blobs from which lattices are grown: those closest to the middle, because at the rim the first steps may be
/// diagonals.
pub fn seeds(blobs: &[Blob]) -> impl Iterator<Item = usize> + use<> {
    let middle = blobs.iter().map(|b| b.centre).sum::<Vec2>() / blobs.len().max(1) as f64;
    let mut seeds: Vec<usize> = (0..blobs.len()).collect();
    let far = |i: &usize| (blobs[*i].centre - middle).norm();
    seeds.sort_by(|a, b| far(a).total_cmp(&far(b)));
    seeds.into_iter().take(30)
}

/// Blobs reached from a seed by steps between neighbours: lattice coordinate to blob. It ends with more than `most` of
/// them: grain of a background has thousands.
pub fn grow(blobs: &[Blob], seed: usize, most: usize) -> Lattice {
    let nearest = |p: &Vec2, without: usize| {
        let others = blobs.iter().enumerate().filter(|(i, _)| *i != without);
        others.map(|(i, b)| (i, (b.centre - p).norm())).min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let origin = blobs[seed].centre;
    let mut near: Vec<Vec2> = blobs.iter().map(|b| b.centre - origin).filter(|d| d.norm() > 0.0).collect();
    near.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
    let cross = |a: &Vec2, b: &Vec2| a.x * b.y - a.y * b.x;
    let Some(&u) = near.first() else { return HashMap::new() };
    // The second step points to the right of the first, at an angle of 37 to 143 degrees.
    let Some(&v) = near.iter().take(8).find(|d| cross(&u, d) > 0.6 * u.norm() * d.norm()) else {
        return HashMap::new();
    };
    let mut map = HashMap::from([((0, 0), seed)]);
    let mut queue = VecDeque::from([((0, 0), u, v)]);
    while let Some(((i, j), u, v)) = queue.pop_front() {
        if map.len() > most {
            break;
        }
        let here = blobs[map[&(i, j)]].centre;
        for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let node = (i + di, j + dj);
            if map.contains_key(&node) {
                continue;
            }
            let step = u * f64::from(di) + v * f64::from(dj);
            let Some((b, off)) = nearest(&(here + step), map[&(i, j)]) else { continue };
            if off > 0.25 * step.norm() || map.values().any(|&m| m == b) {
                continue;
            }
            let seen = (blobs[b].centre - here) * f64::from(di + dj);
            // The steps are updated to follow the perspective.
            let (nu, nv) = if di != 0 { (seen, v) } else { (u, seen) };
            map.insert(node, b);
            queue.push_back((node, nu, nv));
        }
    }
    map
}

/// A node after quarter turns.
pub fn quarter_turned((x, y): Node, quarter: usize) -> Node {
    match quarter {
        0 => (x, y),
        1 => (-y, x),
        2 => (-x, -y),
        _ => (y, -x),
    }
}

/// The blobs of the nodes, once for each rotation (with its shift) that assigns one to every node. The one whose first
/// blob lies at the upper left comes first.
fn matching(lattice: &Lattice, nodes: &[Node], blobs: &[Blob]) -> Option<Vec<Vec<usize>>> {
    if lattice.len() != nodes.len() {
        return None;
    }
    let mut found: Vec<Vec<usize>> = (0..4)
        .filter_map(|quarter| {
            let moved: Vec<Node> = nodes.iter().map(|n| quarter_turned(*n, quarter)).collect();
            let low =
                |of: &mut dyn Iterator<Item = Node>| of.fold((i32::MAX, i32::MAX), |a, n| (a.0.min(n.0), a.1.min(n.1)));
            let (a, b) = (low(&mut moved.iter().copied()), low(&mut lattice.keys().copied()));
            moved.iter().map(|n| lattice.get(&(n.0 - a.0 + b.0, n.1 - a.1 + b.1)).copied()).collect()
        })
        .collect();
    let first = |ids: &Vec<usize>| blobs[ids[0]].centre.x + blobs[ids[0]].centre.y;
    found.sort_by(|a, b| first(a).total_cmp(&first(b)));
    (!found.is_empty()).then_some(found)
}
