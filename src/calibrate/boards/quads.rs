//! In: a picture. Out: dark quadrilaterals on bright ground, and their corners to a few hundredths of a pixel with
//! sigma, from straight lines fitted to the edges near each corner.
//! Frame and unit: pixels (centres at integers); corners run clockwise in the picture.

use super::refine::Grey;
use crate::geometry::Vec2;
use nalgebra::Matrix2;

/// A corner as the intersection of two fitted lines.
#[derive(Clone, Copy, Debug)]
pub struct QuadCorner {
    pub pixel: Vec2,
    /// Standard deviation per axis, px.
    pub sigma_px: f64,
}

/// Smallest share of a quadrilateral that the convex hull of its patch must fill; a disc fills 0.79 of its own.
const FILLED: f64 = 0.88;
/// Shortest side, px: the cells of a marker with six cells per side are then 1.5 px wide.
const SHORTEST: f64 = 9.0;
/// Longest part of an edge from a corner that its line is fitted to, px: over a longer one the lens bends the edge
/// measurably.
const LONGEST: f64 = 40.0;

/// Quadrilaterals that are dark inside their rim and surrounded by brighter ground; corners accurate to a pixel or
/// two.
pub fn quads(mask: &[bool], width: usize, height: usize) -> Vec<[Vec2; 4]> {
    let mut seen = vec![false; mask.len()];
    let (mut found, mut stack) = (Vec::new(), Vec::new());
    for first in 0..mask.len() {
        if seen[first] || !mask[first] {
            continue;
        }
        stack.push(first);
        seen[first] = true;
        // The hull needs only the leftmost and rightmost pixel of each row.
        let mut rows: std::collections::BTreeMap<usize, [usize; 2]> = std::collections::BTreeMap::new();
        let mut border = false;
        while let Some(k) = stack.pop() {
            let (x, y) = (k % width, k / width);
            let row = rows.entry(y).or_insert([x, x]);
            *row = [row[0].min(x), row[1].max(x)];
            border |= x == 0 || y == 0 || x + 1 == width || y + 1 == height;
            let neighbours = [
                (x > 0, k.wrapping_sub(1)),
                (x + 1 < width, k + 1),
                (y > 0, k.wrapping_sub(width)),
                (y + 1 < height, k + width),
            ];
            for (inside, m) in neighbours {
                if inside && mask[m] && !seen[m] {
                    seen[m] = true;
                    stack.push(m);
                }
            }
        }
        if border || (rows.len() as f64) < 0.7 * SHORTEST {
            continue;
        }
        let points: Vec<Vec2> = rows.iter().flat_map(|(y, xs)| xs.map(|x| Vec2::new(x as f64, *y as f64))).collect();
        found.extend(quadrilateral(&hull(points)));
    }
    found
}

/// Convex hull, clockwise in the picture (y down) \[andrew79\].
fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let turn = |a: &Vec2, b: &Vec2, c: &Vec2| (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    let half = |points: &mut dyn Iterator<Item = Vec2>| {
        let mut out: Vec<Vec2> = Vec::new();
        for p in points {
            while out.len() > 1 && turn(&out[out.len() - 2], &out[out.len() - 1], &p) <= 0.0 {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
        out
    };
    let mut all = half(&mut points.iter().copied());
    all.extend(half(&mut points.iter().rev().copied()));
    all
}

fn area(p: &[Vec2]) -> f64 {
    let n = p.len();
    (0..n).map(|i| p[i].x * p[(i + 1) % n].y - p[i].y * p[(i + 1) % n].x).sum::<f64>() / 2.0
}

/// The four corners of a hull, if it is a quadrilateral. Pixels cut its corners off, so that each consists of two or
/// three points of the hull. The longest edge between two corners is a side; adjacent sides are extended until they
/// intersect.
fn quadrilateral(hull: &[Vec2]) -> Option<[Vec2; 4]> {
    let near = largest(hull)?;
    let sides: [[Vec2; 2]; 4] = std::array::from_fn(|k| {
        let (from, to) = (near[k], near[(k + 1) % 4]);
        let count = (to + hull.len() - from) % hull.len();
        let edges = (from..from + count).map(|m| [hull[m % hull.len()], hull[(m + 1) % hull.len()]]);
        edges.max_by(|a, b| (a[1] - a[0]).norm().total_cmp(&(b[1] - b[0]).norm())).expect("four different points")
    });
    let mut four = [Vec2::zeros(); 4];
    for k in 0..4 {
        four[k] = meet(&sides[(k + 3) % 4], &sides[k])?;
    }
    let lengths = (0..4).map(|i| (four[(i + 1) % 4] - four[i]).norm());
    let good = lengths.fold(f64::INFINITY, f64::min) >= SHORTEST && area(hull) >= FILLED * area(&four).abs();
    // The hull runs through the centres of the pixels, so half a pixel is missing on each side.
    let middle = four.iter().sum::<Vec2>() / 4.0;
    good.then(|| four.map(|p| p + (p - middle).normalize() * std::f64::consts::FRAC_1_SQRT_2))
}

/// Intersection of the lines through two pairs of points.
fn meet(a: &[Vec2; 2], b: &[Vec2; 2]) -> Option<Vec2> {
    let (u, v) = (a[1] - a[0], b[1] - b[0]);
    let cross = u.x * v.y - u.y * v.x;
    let between = b[0] - a[0];
    // Lines within half a degree of each other have no usable intersection.
    (cross.abs() > 0.01 * u.norm() * v.norm()).then(|| a[0] + u * ((between.x * v.y - between.y * v.x) / cross))
}

/// Indices of the four points of a convex hull that enclose the largest area: for every diagonal, the farthest point
/// on each side. These points advance with the diagonal's end, so the search for one start point takes linear time.
fn largest(hull: &[Vec2]) -> Option<[usize; 4]> {
    let n = hull.len();
    let (mut best, mut most) = (None, 0.0);
    for i in 0..n {
        let at = |k: usize| hull[(i + k) % n];
        let triangle = |j: usize, k: usize| area(&[at(0), at(j), at(k)]).abs();
        let farther = |j: usize, k: usize| triangle(j, k + 1) > triangle(j, k);
        let (mut near, mut far) = (1, 3);
        for j in 2..n.saturating_sub(1) {
            while near + 1 < j && farther(j, near) {
                near += 1;
            }
            far = far.max(j + 1);
            while far + 1 < n && farther(j, far) {
                far += 1;
            }
            let both = triangle(j, near) + triangle(j, far);
            if both > most {
                (best, most) = (Some([0, near, j, far].map(|k| (i + k) % n)), both);
            }
        }
    }
    best
}

/// The corners of a quadrilateral by lines along its edges. `clear`: width beside an edge, on both sides, without
/// other structures, as a share of the length of the adjacent side.
pub fn refined(grey: &Grey, quad: &[Vec2; 4], clear: f64) -> Option<[QuadCorner; 4]> {
    let mut now = *quad;
    let mut out = None;
    // The second round starts from the edges that the first one found.
    for _ in 0..2 {
        let mut corners = Vec::new();
        for k in 0..4 {
            let (before, here, after) = (now[(k + 3) % 4], now[k], now[(k + 1) % 4]);
            // The edge along the side to `after` is searched in the direction of the side to `before`, and vice
            // versa.
            let first = line(grey, &here, &after, clear * (before - here).norm())?;
            let second = line(grey, &here, &before, clear * (after - here).norm())?;
            corners.push(crossing(&first, &second)?);
        }
        for k in 0..4 {
            if (corners[k].pixel - quad[k]).norm() > 0.25 * (quad[k] - quad[(k + 1) % 4]).norm() + 2.0 {
                return None;
            }
            now[k] = corners[k].pixel;
        }
        out = <[QuadCorner; 4]>::try_from(corners).ok();
    }
    out
}

/// A line near a corner: its points are origin + s along + (a + b s) normal.
struct Line {
    origin: Vec2,
    along: Vec2,
    normal: Vec2,
    a: f64,
    b: f64,
    /// Variance of a.
    variance: f64,
}

/// Fits the edge from `corner` towards `end`.
fn line(grey: &Grey, corner: &Vec2, end: &Vec2, clear_px: f64) -> Option<Line> {
    let length = (end - corner).norm();
    let along = (end - corner) / length;
    let normal = Vec2::new(-along.y, along.x);
    let reach = clear_px.clamp(1.5, 5.0);
    // The tip of the corner is rounded by blur, and the other edge reaches into it.
    let (from, to) = ((0.12 * length).clamp(1.5, 6.0), (0.6 * length).min(LONGEST));
    let places: Vec<(f64, f64)> = (0..)
        .map(|i| from + f64::from(i))
        .take_while(|s| *s <= to)
        .filter_map(|s| Some((s, edge(grey, &(corner + along * s), &normal, reach)?)))
        .collect();
    if places.len() < 4 {
        return None;
    }
    let n = places.len() as f64;
    let fit = |w: &[f64]| {
        let sum = |f: &dyn Fn(&(f64, f64)) -> f64| places.iter().zip(w).map(|(p, w)| w * f(p)).sum::<f64>();
        let (s0, s1, s2) = (sum(&|_| 1.0), sum(&|p| p.0), sum(&|p| p.0 * p.0));
        let (d0, d1) = (sum(&|p| p.1), sum(&|p| p.0 * p.1));
        let det = s0 * s2 - s1 * s1;
        (det > 1e-9).then(|| ((s2 * d0 - s1 * d1) / det, (s0 * d1 - s1 * d0) / det, s2 / det))
    };
    let mut weights = vec![1.0; places.len()];
    let (mut a, mut b, mut gain) = fit(&weights)?;
    for _ in 0..3 {
        let residuals: Vec<f64> = places.iter().map(|p| p.1 - a - b * p.0).collect();
        let mut sorted: Vec<f64> = residuals.iter().map(|r| r.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let sigma = (1.4826 * sorted[sorted.len() / 2]).max(0.01);
        weights = residuals.iter().map(|r| (2.0 * sigma / r.abs().max(1e-9)).min(1.0)).collect();
        (a, b, gain) = fit(&weights)?;
    }
    let residuals: Vec<f64> = places.iter().map(|p| p.1 - a - b * p.0).collect();
    let square = residuals.iter().map(|r| r * r).sum::<f64>();
    // Positions one pixel apart share pixels, so their errors are correlated.
    let shared = residuals.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square.max(1e-12);
    let variance = square / (n - 2.0) * (1.0 + 2.0 * shared.clamp(0.0, 1.0)) * gain;
    Some(Line { origin: *corner, along, normal, a, b, variance })
}

/// Signed distance along `normal` from `at` to the edge, which is the centroid of the intensity's slope.
fn edge(grey: &Grey, at: &Vec2, normal: &Vec2, reach: f64) -> Option<f64> {
    const STEP: f64 = 0.5;
    let half = (reach / STEP).round() as i32;
    let light =
        (-half..=half).map(|k| grey.at(&(at + normal * (f64::from(k) * STEP)))).collect::<Option<Vec<f64>>>()?;
    // The edge's position is the mean of the slope, which a symmetric blur does not change.
    let slopes: Vec<f64> = light.windows(2).map(|w| w[1] - w[0]).collect();
    let total: f64 = slopes.iter().sum();
    let place = |i: usize| (i as f64 + 0.5 - f64::from(half)) * STEP;
    let mean = slopes.iter().enumerate().map(|(i, s)| s * place(i)).sum::<f64>() / total;
    let rough: f64 = slopes.iter().map(|s| s.abs()).sum();
    // If the intensity rises and falls again, or hardly changes, there is no edge.
    (total.abs() > 0.5 * rough && total.abs() > 4.0 && mean.abs() < reach).then_some(mean)
}

/// Intersection of two lines, with the sigma that follows from their sigmas.
fn crossing(p: &Line, q: &Line) -> Option<QuadCorner> {
    // A point x is on a line if n·(x − origin) = a + b (along·(x − origin)).
    let row = |l: &Line| l.normal - l.along * l.b;
    let (r1, r2) = (row(p), row(q));
    let m = Matrix2::new(r1.x, r1.y, r2.x, r2.y).try_inverse()?;
    let pixel = m * Vec2::new(r1.dot(&p.origin) + p.a, r2.dot(&q.origin) + q.a);
    let variance = m.column(0).norm_squared() * p.variance + m.column(1).norm_squared() * q.variance;
    pixel.iter().all(|v| v.is_finite()).then(|| QuadCorner { pixel, sigma_px: (variance / 2.0).sqrt().max(1e-3) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hull_of_a_square_is_its_corners_and_a_disc_is_no_quadrilateral() {
        let square: Vec<Vec2> = (0..400).map(|k| Vec2::new(f64::from(k % 20), f64::from(k / 20))).collect();
        let four = quadrilateral(&hull(square)).unwrap();
        assert!(area(&four) > 0.0, "clockwise in a picture whose y points down");
        assert!((area(&four) - 400.0).abs() < 1e-9, "the pixels themselves, not their centres");
        let disc: Vec<Vec2> = (0..60)
            .map(|k| Vec2::new(20.0 * (f64::from(k) * 0.105).cos(), 20.0 * (f64::from(k) * 0.105).sin()))
            .collect();
        assert!(quadrilateral(&hull(disc)).is_none());
    }

    /// Squares of 12 to 40 px in pixels, at many rotations and sub-pixel positions.
    #[test]
    fn corners_that_pixels_cut_off_are_where_they_are() {
        let (mut worst, mut sum) = (0.0f64, 0.0);
        for k in 0..2000 {
            let (side, angle) = (12.0 + f64::from(k % 29), f64::from(k) * 0.0371);
            let (sin, cos) = angle.sin_cos();
            let middle = Vec2::new(40.0 + f64::from(k % 7) / 7.0, 40.0 + f64::from(k % 11) / 11.0);
            let along = |p: Vec2| Vec2::new(cos * p.x + sin * p.y, cos * p.y - sin * p.x) / side;
            let seen = (0..6400).map(|p| Vec2::new(f64::from(p % 80), f64::from(p / 80)));
            let patch = seen.filter(|p| along(p - middle).amax() < 0.5).collect();
            let four = quadrilateral(&hull(patch)).unwrap_or_else(|| panic!("side {side}, angle {angle}"));
            for corner in four {
                let q = along(corner - middle);
                let off = (q - q.map(|v| v.signum() / 2.0)).norm() * side;
                worst = worst.max(off);
                sum += off * off;
            }
        }
        let rms = (sum / 8000.0f64).sqrt();
        println!("corners off by {rms:.2} px rms, {worst:.2} px at most");
        // `refined` searches at least 1.5 px on both sides of an edge.
        assert!(rms < 1.0 && worst < 2.5, "{rms:.2} px, {worst:.2} px");
    }
}
