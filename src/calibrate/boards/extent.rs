//! In: a board's layout and a point on it. Out: whether the point lies on the board, and its distance from the
//! nearest edge of the print.
//! Frame and unit: board frame, mm.

use crate::geometry::Vec3;
use crate::recording::{BoardSpec, Markers, OriginMark};

/// Distance to the board's outline, mm; positive inside, negative outside.
pub fn inside(board: &BoardSpec, x: f64, y: f64) -> f64 {
    let [x0, y0, x1, y1] = board.outline();
    (x - x0).min(x1 - x).min(y - y0).min(y1 - y)
}

/// Distance to the nearest border between dark and bright print, mm. A stripe or spot across such a border is pulled
/// towards the bright side.
pub fn to_print_edge(board: &BoardSpec, x: f64, y: f64) -> f64 {
    match board {
        BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: s, .. } => {
            let (u, v) = (x / s, y / s);
            to_lines(u, v, -1.0, f64::from(*nx), -1.0, f64::from(*ny)) * s
        }
        BoardSpec::Charuco { squares: [nx, ny], square_mm: s, marker_mm, .. } => {
            let (u, v) = (x / s, y / s);
            let (nx, ny) = (f64::from(*nx), f64::from(*ny));
            let square = to_lines(u, v, 0.0, nx, 0.0, ny) * s;
            let on_board = u > 0.0 && v > 0.0 && u < nx && v < ny;
            let white = (u.floor() as i64 + v.floor() as i64).rem_euclid(2) == i64::from(!board.begins_white());
            if on_board && white {
                // The marker's cells are full of edges: only the margin around it is plain.
                let (a, b) = ((u.fract() - 0.5).abs(), (v.fract() - 0.5).abs());
                square.min((a.max(b) * s - marker_mm / 2.0).max(0.0))
            } else {
                square
            }
        }
        // A marker's cells are full of edges: only the white around the markers is plain.
        BoardSpec::MarkerGrid { marker_mm, .. } => {
            let out = |d: f64| (-d).max(d - marker_mm).max(0.0);
            let first = board.features().into_iter().step_by(4);
            let markers = first.map(|c| out(x - c.x).hypot(out(y - c.y)));
            let all = Markers::of(board).ok().flatten();
            let squares = all.iter().flat_map(Markers::corner_squares).map(|[left, top, side]| {
                let out = |d: f64| (-d).max(d - side).max(0.0);
                out(x - left).hypot(out(y - top))
            });
            markers.chain(squares).fold(f64::INFINITY, f64::min)
        }
        // Dots of unknown size: no position near them is known to be plain.
        BoardSpec::Circles { diameter_mm: None, .. } => 0.0,
        BoardSpec::Circles { diameter_mm: Some(d), origin, .. } => {
            let dots = board.features();
            let to = |c: &Vec3, d: f64| ((x - c.x).hypot(y - c.y) - d / 2.0).abs();
            let all = dots.iter().map(|c| to(c, *d)).fold(f64::INFINITY, f64::min);
            match origin {
                None => all,
                // The larger dot's own diameter is measured in the pictures and not kept.
                Some(OriginMark::LargerDot { diameter_mm: None }) if x.hypot(y) < 2.0 * d => 0.0,
                Some(OriginMark::LargerDot { diameter_mm }) => all.min(diameter_mm.map_or(all, |d| to(&dots[0], d))),
                Some(OriginMark::FinderPatterns { .. }) => {
                    let holes = board.drawn_holes();
                    holes.iter().map(|(k, diameter)| to(&dots[*k], *diameter)).fold(all, f64::min)
                }
                Some(OriginMark::FrameCorner { bar_mm, corner_mm, .. }) => {
                    all.min(to_frame(board, *bar_mm, *corner_mm, x, y))
                }
            }
        }
    }
}

/// Distance to the frame around a circle grid, mm; 0 on its bars and its triangle, which are narrow.
fn to_frame(board: &BoardSpec, bar: f64, corner: f64, x: f64, y: f64) -> f64 {
    let BoardSpec::Circles { border_mm, .. } = board else { return f64::INFINITY };
    let [x0, y0, x1, y1] = board.outline();
    let (left, top) = (x - x0 - border_mm, y - y0 - border_mm);
    let inside = left.min(top).min(x1 - border_mm - x).min(y1 - border_mm - y);
    if inside < 0.0 {
        return -inside;
    }
    (inside - bar).min((left + top - corner) * std::f64::consts::FRAC_1_SQRT_2).max(0.0)
}

/// Distance to the lines of the unit grid inside a rectangle; from outside, to the rectangle.
fn to_lines(u: f64, v: f64, u0: f64, u1: f64, v0: f64, v1: f64) -> f64 {
    let outside = (u0 - u).max(u - u1).max(0.0).hypot((v0 - v).max(v - v1).max(0.0));
    if outside > 0.0 {
        return outside;
    }
    (u - u.round()).abs().min((v - v.round()).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_of_a_chessboard() {
        let b = BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: 10.0,
            border_mm: 7.0,
            first_square: "black".into(),
        };
        assert_eq!(b.outline(), [-17.0, -17.0, 97.0, 67.0]);
        assert!((to_print_edge(&b, 5.0, 3.0) - 3.0).abs() < 1e-12);
        assert!((to_print_edge(&b, -14.0, 20.0) - 4.0).abs() < 1e-12);
        assert!(inside(&b, -18.0, 0.0) < 0.0 && (inside(&b, 95.0, 20.0) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn the_frame_of_a_plate_is_no_plain_place() {
        let b = BoardSpec::Circles {
            dots: [7, 7],
            pitch_mm: 12.5,
            diameter_mm: Some(6.25),
            asymmetric: false,
            origin: Some(OriginMark::FrameCorner { frame_mm: 12.5, bar_mm: 3.125, corner_mm: 12.5 }),
            border_mm: 1.25,
        };
        assert_eq!(b.outline(), [-13.75, -13.75, 88.75, 88.75]);
        // On the triangle, on the same place in another corner, and beyond the frame.
        assert_eq!(to_print_edge(&b, -8.0, -7.0), 0.0);
        assert!((to_print_edge(&b, 83.0, -7.0) - 1.375).abs() < 1e-12, "{}", to_print_edge(&b, 83.0, -7.0));
        assert!((to_print_edge(&b, -13.5, 30.0) - 1.0).abs() < 1e-12);
        assert!(b.on_frame(-8.0, -7.0) && !b.on_frame(83.0, -7.0) && b.on_frame(87.0, 40.0) && !b.on_frame(6.0, 6.0));
    }

    #[test]
    fn a_marker_has_no_plain_place() {
        let b = BoardSpec::Charuco {
            squares: [14, 10],
            square_mm: 10.0,
            marker_mm: 7.0,
            dictionary: "DICT_5X5_250".into(),
            first_id: 0,
            first_square: None,
            border_mm: 0.0,
        };
        assert_eq!(to_print_edge(&b, 15.0, 5.0), 0.0);
        assert!((to_print_edge(&b, 5.0, 5.0) - 5.0).abs() < 1e-12);
    }
}
