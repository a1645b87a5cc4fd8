//! In: a picture and a circle grid. Out: the images of the dots' centres with their ids, corrected for the offset
//! between an ellipse's centre and the image of the circle's centre; or the reason for a failure.
//! Frame and unit: pixels; ids row by row as in `BoardSpec::features()`.

use super::ellipse::{Dot, dot};
use super::refine::Grey;
use super::{BoardPoint, BoardView, FindOptions};
use crate::calibrate::homography::{apply, homography};
use crate::fault::{Fault, Result};
use crate::geometry::{Mat3, Vec2, Vec3};
use crate::raster::Image;
use crate::recording::BoardSpec;
use nalgebra::Matrix2;
use std::collections::{HashMap, VecDeque};

/// A connected patch of elliptic shape.
struct Blob {
    centre: Vec2,
    /// A of the ellipse qᵀAq = 1, 1/px².
    shape: Matrix2<f64>,
}

/// A lattice coordinate.
type Node = (i32, i32);

/// Finds a grid that is completely in view, with dark dots on bright ground or bright ones on dark.
pub fn find(image: &Image, board: &BoardSpec, _options: &FindOptions) -> Result<BoardView> {
    let BoardSpec::Circles { dots: [nx, ny], asymmetric, diameter_mm, .. } = board else {
        return Err(Fault::usage("the board is not a circle grid").next("describe it as type circles"));
    };
    let grey = Grey::new(image);
    let features = board.features();
    let nodes: Vec<Node> = (0..*ny as i32)
        .flat_map(|j| (0..*nx as i32).map(move |i| (i, j)))
        .map(|(i, j)| {
            let (x, y) = if *asymmetric { (2 * i + j % 2, j) } else { (i, j) };
            // Asymmetric dots form a square lattice that is rotated by 45 degrees.
            if *asymmetric { ((x + y).div_euclid(2), (y - x).div_euclid(2)) } else { (x, y) }
        })
        .collect();
    // Of an asymmetric lattice only the points with even x + y exist, so both sums are even.
    let mut most = 0;
    for dark in [true, false] {
        let blobs = blobs(&grey, dark);
        most = most.max(blobs.len());
        let Some((chosen, ambiguous)) = labelled(&blobs, &nodes) else { continue };
        let dots: Option<Vec<Dot>> = chosen.iter().map(|&b| dot(&grey, &blobs[b].centre, &blobs[b].shape)).collect();
        let Some(dots) = dots else { continue };
        let (points, radius) = centred(&dots, &features, diameter_mm.map(|d| d / 2.0))?;
        let dot_diameter = diameter_mm.is_none().then_some(2.0 * radius);
        return Ok(BoardView { points, ambiguous, dot_diameter, ..BoardView::default() });
    }
    Err(Fault::refused(format!("no grid of {nx}x{ny} dots was found; {most} round spots are in the picture"))
        .cause(if most < features.len() {
            "dots are cut off, covered, out of focus, smaller than 5 px, or badly lit"
        } else {
            "the grid has another size or kind than described"
        })
        .next("keep all dots in view and compare the board with its description"))
}

/// Elliptic patches darker (or brighter) than their surroundings.
fn blobs(grey: &Grey, dark: bool) -> Vec<Blob> {
    let (w, h) = (grey.width, grey.height);
    let mask = mask(grey, dark);
    let mut seen = vec![false; w * h];
    let mut found = Vec::new();
    let mut stack = Vec::new();
    for first in 0..w * h {
        if seen[first] || !mask[first] {
            continue;
        }
        stack.push(first);
        seen[first] = true;
        let (mut n, mut sum, mut square, mut border) = (0.0, Vec2::zeros(), Matrix2::zeros(), false);
        while let Some(k) = stack.pop() {
            let (x, y) = (k % w, k / w);
            let p = Vec2::new(x as f64, y as f64);
            n += 1.0;
            sum += p;
            square += p * p.transpose();
            border |= x == 0 || y == 0 || x + 1 == w || y + 1 == h;
            let neighbours =
                [(x > 0, k.wrapping_sub(1)), (x + 1 < w, k + 1), (y > 0, k.wrapping_sub(w)), (y + 1 < h, k + w)];
            for (inside, m) in neighbours {
                if inside && mask[m] && !seen[m] {
                    seen[m] = true;
                    stack.push(m);
                }
            }
        }
        if border || !(16.0..0.05 * (w * h) as f64).contains(&n) {
            continue;
        }
        let centre = sum / n;
        // The second moments of a filled ellipse are a quarter of its squared semi-axes; 1/12 is the pixel's own
        // moment.
        let moments = square / n - centre * centre.transpose();
        let axes = moments.symmetric_eigenvalues();
        let area = 4.0 * std::f64::consts::PI * (axes[0] * axes[1]).max(0.0).sqrt();
        let Some(inverse) = (moments * 4.0).try_inverse() else { continue };
        // The area of a filled ellipse follows from its moments; squares deviate by 5 %, crosses and rings by more.
        if (area / n - 1.0).abs() < 0.08 && axes.max() < 16.0 * axes.min() {
            found.push(Blob { centre, shape: inverse });
        }
    }
    found
}

/// Pixels that differ from the mean of their surroundings (an eighth of the picture) by a fifth of that mean.
pub(super) fn mask(grey: &Grey, dark: bool) -> Vec<bool> {
    let (w, h) = (grey.width, grey.height);
    let mut sums = vec![0.0f64; (w + 1) * (h + 1)];
    for y in 0..h {
        let mut row = 0.0;
        for x in 0..w {
            row += f64::from(grey.levels[y * w + x]);
            sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
        }
    }
    let half = (w.max(h) / 16).max(4);
    let mut mask = vec![false; w * h];
    for y in 0..h {
        let (y0, y1) = (y.saturating_sub(half), (y + half + 1).min(h));
        for x in 0..w {
            let (x0, x1) = (x.saturating_sub(half), (x + half + 1).min(w));
            let at = |x: usize, y: usize| sums[y * (w + 1) + x];
            let mean = (at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)) / ((x1 - x0) * (y1 - y0)) as f64;
            let level = f64::from(grey.levels[y * w + x]);
            mask[y * w + x] = if dark { level < 0.8 * mean } else { level > 1.25 * mean };
        }
    }
    mask
}

/// Blobs in the order of the nodes, and whether another rotation fits too. Lattices are grown from the blobs closest
/// to the middle, because at the rim the first steps may be diagonals.
fn labelled(blobs: &[Blob], nodes: &[Node]) -> Option<(Vec<usize>, bool)> {
    let middle = blobs.iter().map(|b| b.centre).sum::<Vec2>() / blobs.len().max(1) as f64;
    let mut seeds: Vec<usize> = (0..blobs.len()).collect();
    let far = |i: &usize| (blobs[*i].centre - middle).norm();
    seeds.sort_by(|a, b| far(a).total_cmp(&far(b)));
    seeds.into_iter().take(30).find_map(|seed| matching(&grow(blobs, seed), nodes, blobs))
}

/// Blobs reached from a seed by steps between neighbours: lattice coordinate to blob.
fn grow(blobs: &[Blob], seed: usize) -> HashMap<Node, usize> {
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

/// Rotation and shift that assign a blob to every node. Second: whether another rotation fits too.
fn matching(lattice: &HashMap<Node, usize>, nodes: &[Node], blobs: &[Blob]) -> Option<(Vec<usize>, bool)> {
    if lattice.len() != nodes.len() {
        return None;
    }
    let turned = |(x, y): Node, quarter: usize| match quarter {
        0 => (x, y),
        1 => (-y, x),
        2 => (-x, -y),
        _ => (y, -x),
    };
    let mut found: Vec<Vec<usize>> = (0..4)
        .filter_map(|quarter| {
            let moved: Vec<Node> = nodes.iter().map(|n| turned(*n, quarter)).collect();
            let low =
                |of: &mut dyn Iterator<Item = Node>| of.fold((i32::MAX, i32::MAX), |a, n| (a.0.min(n.0), a.1.min(n.1)));
            let (a, b) = (low(&mut moved.iter().copied()), low(&mut lattice.keys().copied()));
            moved.iter().map(|n| lattice.get(&(n.0 - a.0 + b.0, n.1 - a.1 + b.1)).copied()).collect()
        })
        .collect();
    let ambiguous = found.len() > 1;
    let first = |ids: &Vec<usize>| blobs[ids[0]].centre.x + blobs[ids[0]].centre.y;
    found.sort_by(|a, b| first(a).total_cmp(&first(b)));
    found.into_iter().next().map(|ids| (ids, ambiguous))
}

/// The image of a circle's centre is not the centre of the circle's image. With the board's homography H the circle's
/// conic C becomes H⁻ᵀCH⁻¹, whose centre gives the difference (docs/math.md, Corners (5)). A radius that is not
/// stated is measured. Second: the radius.
fn centred(dots: &[Dot], features: &[Vec3], stated: Option<f64>) -> Result<(Vec<BoardPoint>, f64)> {
    let plane: Vec<Vec2> = features.iter().map(|f| f.xy()).collect();
    let mut pixels: Vec<Vec2> = dots.iter().map(|d| d.pixel).collect();
    let mut radius = stated.unwrap_or(0.0);
    for _ in 0..3 {
        let h = homography(&plane, &pixels).ok_or_else(|| {
            Fault::refused("no board was found: the dots lie on a line").cause("an edge-on board").next("tilt it less")
        })?;
        if stated.is_none() {
            radius = measured_radius(&h, dots, &plane);
        }
        for ((p, d), x) in pixels.iter_mut().zip(dots).zip(&plane) {
            *p = d.pixel - eccentricity(&h, x, radius);
        }
    }
    let points = dots.iter().zip(pixels).enumerate();
    Ok((
        points.map(|(feature_id, (d, pixel))| BoardPoint { feature_id, pixel, sigma_px: d.sigma_px }).collect(),
        radius,
    ))
}

/// The radius at which the circles' images are as large as the ellipses, median over the dots. For small dots, areas
/// change by the homography's determinant at the dot; the circle's exact image gives the remaining correction.
fn measured_radius(h: &Mat3, dots: &[Dot], plane: &[Vec2]) -> f64 {
    let mut all: Vec<f64> = dots
        .iter()
        .zip(plane)
        .map(|(dot, x)| {
            let seen = 1.0 / dot.shape.determinant().max(1e-12).sqrt();
            let w = (h * Vec3::new(x.x, x.y, 1.0)).z;
            (seen * w.abs().powi(3) / h.determinant().abs().max(1e-300)).sqrt()
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Centre of the circle's image minus the image of its centre, px.
fn eccentricity(h: &Mat3, x: &Vec2, radius: f64) -> Vec2 {
    let shift = Mat3::new(1.0, 0.0, x.x, 0.0, 1.0, x.y, 0.0, 0.0, 1.0);
    let g = h * shift;
    // The dual conic maps forward: its last column is the centre's homogeneous coordinates.
    let dual = g * Mat3::from_diagonal(&Vec3::new(radius * radius, radius * radius, -1.0)) * g.transpose();
    Vec2::new(dual[(0, 2)] / dual[(2, 2)], dual[(1, 2)] / dual[(2, 2)]) - apply(h, x)
}
