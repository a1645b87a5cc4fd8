//! In: polylines. Out: area, length, bounds and diameter of one, arcs as polylines, whether a place lies inside.
//! Frame and unit: the part's frame; mm.

pub(in crate::find) fn arc(c: [f64; 2], r: f64, from: f64, to: f64, steps: usize) -> Vec<[f64; 2]> {
    (0..=steps)
        .map(|i| {
            let (s, k) = (from + (to - from) * i as f64 / steps as f64).sin_cos();
            [c[0] + r * k, c[1] + r * s]
        })
        .collect()
}

/// Signed area of an outline, positive where it runs counter-clockwise.
pub(in crate::find) fn area(p: &[[f64; 2]]) -> f64 {
    (0..p.len()).map(|i| (p[i], p[(i + 1) % p.len()])).map(|(a, b)| 0.5 * (a[0] * b[1] - b[0] * a[1])).sum()
}

/// Smallest box around points: x0, y0, x1, y1.
pub(in crate::find) fn bounds<'a>(points: impl IntoIterator<Item = &'a [f64; 2]>) -> [f64; 4] {
    let grown = |b: [f64; 4], p: &[f64; 2]| [b[0].min(p[0]), b[1].min(p[1]), b[2].max(p[0]), b[3].max(p[1])];
    points.into_iter().fold([f64::MAX, f64::MAX, f64::MIN, f64::MIN], grown)
}

/// True where the side from `a` to `b` runs across the ray from a place to the right.
pub(in crate::find) fn crosses(a: [f64; 2], b: [f64; 2], x: f64, y: f64) -> bool {
    (a[1] > y) != (b[1] > y) && x < (b[0] - a[0]) * (y - a[1]) / (b[1] - a[1]) + a[0]
}

/// Whether a place lies inside, by the even-odd rule.
pub(in crate::find) fn contains(p: &[[f64; 2]], x: f64, y: f64) -> bool {
    (0..p.len()).filter(|&i| crosses(p[i], p[(i + 1) % p.len()], x, y)).count() % 2 == 1
}

/// Length of an outline's sides; a closed outline includes the side from its last point to its first.
pub(in crate::find) fn length(p: &[[f64; 2]], closed: bool) -> f64 {
    let side = |i: usize| (p[(i + 1) % p.len()][0] - p[i][0]).hypot(p[(i + 1) % p.len()][1] - p[i][1]);
    (0..if closed { p.len() } else { p.len().saturating_sub(1) }).map(side).sum()
}

/// Largest distance between two points. It is found among opposite corners of their convex hull (rotating calipers,
/// Shamos 1978).
pub(in crate::find) fn diameter(points: &[[f64; 2]]) -> f64 {
    let hull = hull(points);
    let n = hull.len();
    let apart = |i: usize, k: usize| (hull[i % n][0] - hull[k % n][0]).hypot(hull[i % n][1] - hull[k % n][1]);
    if n < 3 {
        return if n == 2 { apart(0, 1) } else { 0.0 };
    }
    let (mut most, mut k) = (0.0f64, 1);
    for i in 0..n {
        let far = |k: usize| cross(hull[i], hull[(i + 1) % n], hull[k % n]);
        while far(k + 1) > far(k) {
            k += 1;
        }
        // The next corner too: where sides are parallel it may lie as far.
        most = most.max(apart(i, k)).max(apart(i + 1, k)).max(apart(i, k + 1)).max(apart(i + 1, k + 1));
    }
    most
}

/// Twice the area of a triangle, positive where it runs counter-clockwise.
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Convex hull, counter-clockwise (monotone chain, Andrew 1979).
fn hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut out: Vec<[f64; 2]> = Vec::new();
    let mut half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let first = out.len();
        for p in points {
            while out.len() >= first + 2 && cross(out[out.len() - 2], out[out.len() - 1], p) <= 0.0 {
                out.pop();
            }
            out.push(p);
        }
        out.pop();
    };
    half(&mut sorted.iter().copied());
    half(&mut sorted.iter().rev().copied());
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    #[test]
    fn the_diameter_is_that_of_all_pairs() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let check = |points: &[[f64; 2]]| {
            let pairs = points.iter().flat_map(|a| points.iter().map(move |b| (a[0] - b[0]).hypot(a[1] - b[1])));
            let want = pairs.fold(0.0, f64::max);
            let got = diameter(points);
            assert!((got - want).abs() <= 1e-12 * want, "{got} {want} {points:?}");
        };
        for case in 0..600 {
            let n = rng.random_range(1..40);
            let lattice = case % 3 == 0;
            let points: Vec<[f64; 2]> = (0..n)
                .map(|_| {
                    [0, 1]
                        .map(|_| if lattice { f64::from(rng.random_range(-2..3)) } else { rng.random_range(-1.0..1.0) })
                })
                .collect();
            check(&points);
        }
        check(&arc([3.0, 4.0], 7.0, 0.0, std::f64::consts::TAU, 100));
        check(&[[-10.0, -5.0], [10.0, -5.0], [10.0, 5.0], [-10.0, 5.0]]);
    }
}
