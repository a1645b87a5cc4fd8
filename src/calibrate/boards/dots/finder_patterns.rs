//! In: the marks of a plate with hexagonally arranged marks and finder patterns, as a lattice. Out: which mark is
//! which.
//! Frame and unit: lattice steps: along a row, and at 60 degrees from it to the lower right; features as in
//! `BoardSpec::features()`.

use super::lattice::{Blob, Lattice, Node};
use crate::geometry::Vec2;
use crate::recording::{OriginMark, hexagonal_node};
use std::collections::{HashMap, HashSet};

/// Fewest marks with a hole that have to agree with the plate: those of one finder pattern.
const LEAST: usize = 4;

/// The marks that are in view, without those that have a hole: feature to blob. `None` if the holes do not show one
/// place of the lattice on the plate.
pub fn by_finder_patterns(
    lattice: &Lattice,
    blobs: &[Blob],
    [nx, ny]: [i32; 2],
    at: &[[u32; 2]],
) -> Option<Vec<(usize, usize)>> {
    let holes: HashSet<Node> = OriginMark::holes(at).into_iter().map(|[i, j]| hexagonal_node(i, j)).collect();
    let features: HashMap<Node, usize> = (0..nx * ny).map(|k| (hexagonal_node(k % nx, k / nx), k as usize)).collect();
    let seen = sheared(lattice, blobs);
    let mut best: Option<(usize, Node, usize)> = None;
    let mut second = 0;
    for sixth in 0..6 {
        let nodes: Vec<(Node, usize)> = seen.iter().map(|(n, b)| (sixth_turned(*n, sixth), *b)).collect();
        let mut votes: HashMap<Node, usize> = HashMap::new();
        for (n, _) in nodes.iter().filter(|(_, b)| blobs[*b].hole) {
            for m in &holes {
                *votes.entry((m.0 - n.0, m.1 - n.1)).or_default() += 1;
            }
        }
        for (shift, count) in votes.into_iter().filter(|v| v.1 >= LEAST) {
            let wrong = |(n, b): &&(Node, usize)| {
                let on = (n.0 + shift.0, n.1 + shift.1);
                !features.contains_key(&on) || holes.contains(&on) != blobs[*b].hole
            };
            // A mark may be dirty, or a hole too small to be seen.
            let wrong = nodes.iter().filter(wrong).count();
            let good = count.saturating_sub(4 * wrong);
            if good >= LEAST && best.is_none_or(|b| good > b.0) {
                second = best.map_or(0, |b| b.0);
                best = Some((good, shift, sixth));
            } else {
                second = second.max(good);
            }
        }
    }
    let (good, shift, sixth) = best?;
    if second >= good {
        return None;
    }
    let placed = seen.iter().filter(|(_, b)| !blobs[*b].hole).filter_map(|(n, b)| {
        let n = sixth_turned(*n, sixth);
        Some((*features.get(&(n.0 + shift.0, n.1 + shift.1))?, *b))
    });
    let mut dots: Vec<(usize, usize)> = placed.collect();
    dots.sort_unstable();
    Some(dots)
}

/// The lattice with its second step 60 degrees to the right of the first one. Lattices are grown with either 60 or 120
/// degrees between both.
fn sheared(lattice: &Lattice, blobs: &[Blob]) -> Vec<(Node, usize)> {
    let step = |from: usize, to: Option<&usize>| to.map(|b| blobs[*b].centre - blobs[from].centre);
    let obtuse: f64 = lattice
        .iter()
        .filter_map(|(n, b)| {
            let u: Vec2 = step(*b, lattice.get(&(n.0 + 1, n.1)))?;
            Some(u.dot(&step(*b, lattice.get(&(n.0, n.1 + 1)))?) / u.norm_squared())
        })
        .sum();
    let moved = |n: &Node| if obtuse < 0.0 { (n.0 - n.1, n.1) } else { *n };
    lattice.iter().map(|(n, b)| (moved(n), *b)).collect()
}

/// A node after turns by 60 degrees.
fn sixth_turned(node: Node, sixth: usize) -> Node {
    (0..sixth).fold(node, |(a, b), _| (-b, a + b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_turns_are_none_and_rows_are_straight() {
        assert_eq!(sixth_turned((3, -1), 6), (3, -1));
        assert_eq!(sixth_turned((1, 0), 1), (0, 1));
        // Even rows begin half a step to the right of odd ones.
        assert_eq!([(0, 0), (0, 1), (0, 2)].map(|(i, j)| hexagonal_node(i, j)), [(0, 0), (-1, 1), (-1, 2)]);
    }
}
