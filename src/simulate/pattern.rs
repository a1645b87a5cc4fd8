//! In: a board description and a place on it. Out: whether that place is printed black.
//! Frame and unit: board frame (recording::BoardSpec), mm.

use crate::recording::BoardSpec;

/// The lower left and upper right corner of the printed plate, border included: x0, y0, x1, y1.
pub fn plate(board: &BoardSpec) -> [f64; 4] {
    match board {
        BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: s, border_mm: b, .. } => {
            [-s - b, -s - b, f64::from(*nx) * s + b, f64::from(*ny) * s + b]
        }
        BoardSpec::Charuco { squares: [nx, ny], square_mm: s, border_mm: b, .. } => {
            [-b, -b, f64::from(*nx) * s + b, f64::from(*ny) * s + b]
        }
        BoardSpec::Circles { dots: [nx, ny], pitch_mm: p, asymmetric, border_mm: b, .. } => {
            let columns = if *asymmetric { 2 * nx - 1 } else { nx - 1 };
            let margin = b.max(*p);
            [-margin, -margin, f64::from(columns) * p + margin, f64::from(ny - 1) * p + margin]
        }
    }
}

/// True where the print is black. ChArUco markers are not printed here: their squares stay white.
pub fn is_black(board: &BoardSpec, x: f64, y: f64) -> bool {
    match board {
        BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: s, first_square, .. } => {
            let (i, j) = ((x / s).floor(), (y / s).floor());
            let on = i >= -1.0 && j >= -1.0 && i < f64::from(*nx) && j < f64::from(*ny);
            // The square outside the origin, (-1, -1), has the first colour.
            on && ((i + j).rem_euclid(2.0) == 0.0) == (first_square == "black")
        }
        BoardSpec::Charuco { squares: [nx, ny], square_mm: s, .. } => {
            let (i, j) = ((x / s).floor(), (y / s).floor());
            let on = i >= 0.0 && j >= 0.0 && i < f64::from(*nx) && j < f64::from(*ny);
            on && (i + j).rem_euclid(2.0) == 0.0
        }
        BoardSpec::Circles { diameter_mm, .. } => {
            let r = diameter_mm / 2.0;
            board.features().iter().any(|c| (x - c.x).hypot(y - c.y) <= r)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_squares_tell_a_half_turn() {
        let board = BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: 15.0,
            border_mm: 9.0,
            first_square: "black".into(),
        };
        assert!(is_black(&board, -7.0, -7.0) && !is_black(&board, 7.0, -7.0));
        assert!(!is_black(&board, 9.0 * 15.0 - 7.0, 6.0 * 15.0 - 7.0), "the opposite corner is white");
        assert!(!is_black(&board, -20.0, -7.0), "the border is white");
        assert_eq!(plate(&board), [-24.0, -24.0, 144.0, 99.0]);
    }
}
