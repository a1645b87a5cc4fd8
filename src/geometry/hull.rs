//! In: points in a plane. Out: the corners of their convex hull.
//! Frame and unit: the caller's.

use super::Vec2;

/// The convex hull's corners \[andrew79\], from x to y: anticlockwise where y points up, clockwise in a picture. Fewer
/// than three different points are returned as they are, sorted.
pub fn convex_hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let mut all = half(points.iter());
    all.extend(half(points.iter().rev()));
    all
}

/// The hull's lower half of points in the order of x, without its last corner.
fn half<'a>(points: impl Iterator<Item = &'a Vec2>) -> Vec<Vec2> {
    let mut out: Vec<Vec2> = Vec::new();
    for p in points {
        while let [.., a, b] = out[..] {
            if (b - a).perp(&(p - a)) > 0.0 {
                break;
            }
            out.pop();
        }
        out.push(*p);
    }
    out.pop();
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_holds_all_points_and_has_no_corner_too_many() {
        let grid = |w: i32, h: i32| (0..=w).flat_map(move |x| (0..=h).map(move |y| Vec2::new(x.into(), y.into())));
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]].map(Vec2::from);
        assert_eq!(convex_hull(grid(4, 2).chain(grid(4, 2)).collect()), corners);
        // On one line two ends are left, and of one point the point.
        assert_eq!(convex_hull(grid(3, 0).collect()), [[0.0, 0.0], [3.0, 0.0]].map(Vec2::from));
        assert_eq!(convex_hull(vec![corners[1]; 3]), [corners[1]]);
        assert!(convex_hull(vec![]).is_empty());
    }
}
