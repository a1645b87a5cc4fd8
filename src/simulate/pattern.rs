//! In: a board description and a position on the board. Out: whether that position is printed black.
//! Frame and unit: board frame (recording::BoardSpec), mm.

use crate::fault::Result;
use crate::recording::{BoardSpec, Markers};

/// A printed board.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// The description that the pattern was made from.
    pub board: BoardSpec,
    markers: Option<Markers>,
    /// Centres of the dots of a circle grid, and the radius of the hole in each.
    dots: Vec<[f64; 3]>,
}

impl Pattern {
    /// # Errors
    /// A ChArUco board whose markers its dictionary does not have.
    pub fn new(board: &BoardSpec) -> Result<Pattern> {
        let circles = matches!(board, BoardSpec::Circles { .. });
        let mut dots: Vec<[f64; 3]> =
            if circles { board.features().iter().map(|c| [c.x, c.y, 0.0]).collect() } else { Vec::new() };
        board.drawn_holes().iter().for_each(|(k, diameter)| dots[*k][2] = diameter / 2.0);
        Ok(Pattern { board: board.clone(), markers: Markers::of(board)?, dots })
    }

    /// Whether the print is black at a position.
    pub fn is_black(&self, x: f64, y: f64) -> bool {
        match &self.board {
            BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: s, first_square, .. } => {
                let (i, j) = ((x / s).floor(), (y / s).floor());
                let on = i >= -1.0 && j >= -1.0 && i < f64::from(*nx) && j < f64::from(*ny);
                // The square outside the origin, (-1, -1), has the first colour.
                on && ((i + j).rem_euclid(2.0) == 0.0) == (first_square == "black")
            }
            BoardSpec::Charuco { squares: [nx, ny], square_mm: s, .. } => {
                let (i, j) = ((x / s).floor(), (y / s).floor());
                let on = i >= 0.0 && j >= 0.0 && i < f64::from(*nx) && j < f64::from(*ny);
                let black = f64::from(u8::from(self.board.begins_white()));
                on && ((i + j) % 2.0 == black || self.markers.as_ref().is_some_and(|m| m.black_at(x, y)))
            }
            BoardSpec::MarkerGrid { .. } => self.markers.as_ref().is_some_and(|m| m.black_at(x, y)),
            BoardSpec::Circles { .. } => {
                let r = self.board.drawn_diameter().unwrap_or(0.0) / 2.0;
                let first = self.board.drawn_first_diameter().unwrap_or(0.0) / 2.0;
                self.board.on_frame(x, y)
                    || x.hypot(y) <= first
                    || self.dots.iter().any(|c| (c[2]..=r).contains(&(x - c[0]).hypot(y - c[1])))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corner_squares_tell_a_half_turn() {
        let board = Pattern::new(&BoardSpec::Chessboard {
            inner_corners: [9, 6],
            square_mm: 15.0,
            border_mm: 9.0,
            first_square: "black".into(),
        })
        .unwrap();
        assert!(board.is_black(-7.0, -7.0) && !board.is_black(7.0, -7.0));
        assert!(!board.is_black(9.0 * 15.0 - 7.0, 6.0 * 15.0 - 7.0), "the opposite corner is white");
        assert!(!board.is_black(-20.0, -7.0), "the border is white");
        assert_eq!(board.board.outline(), [-24.0, -24.0, 144.0, 99.0]);
    }
}
