//! In: a ChArUco board's description. Out: which cells of its markers are printed black.
//! Frame and unit: board frame, mm; rows and columns of cells from the marker's upper left.

use super::BoardSpec;
use crate::fault::{Fault, Result};
use calib_targets_aruco::{Dictionary, resolve_dictionary};

/// The markers of one ChArUco board, in OpenCV's order: row by row over the white squares.
#[derive(Clone, Debug)]
pub struct Markers {
    codes: Dictionary,
    squares: [u32; 2],
    square_mm: f64,
    marker_mm: f64,
}

impl Markers {
    /// `None` for boards without markers.
    ///
    /// # Errors
    /// An unknown dictionary, or one with fewer codes than the board has markers.
    pub fn of(board: &BoardSpec) -> Result<Option<Markers>> {
        let BoardSpec::Charuco { squares, square_mm, marker_mm, dictionary: name, .. } = board else {
            return Ok(None);
        };
        let codes = resolve_dictionary(name).ok_or_else(|| {
            Fault::usage(format!("'{name}' is no known marker dictionary")).next("use OpenCV's name, e.g. DICT_5X5_250")
        })?;
        let needed = (squares[0] * squares[1] / 2) as usize;
        if needed > codes.codes().len() {
            return Err(Fault::usage(format!("the board needs {needed} markers, {name} has {}", codes.codes().len()))
                .next("choose a larger dictionary or a smaller board"));
        }
        Ok(Some(Markers { codes, squares: *squares, square_mm: *square_mm, marker_mm: *marker_mm }))
    }
    /// Cells across a marker, its black ring included.
    pub fn cells(&self) -> usize {
        self.codes.marker_size() + 2
    }
    /// Side of a cell, mm.
    pub fn cell_mm(&self) -> f64 {
        self.marker_mm / self.cells() as f64
    }
    /// Squares with a marker: column, row and the marker's number.
    pub fn places(&self) -> impl Iterator<Item = (u32, u32, usize)> + use<> {
        let [nx, ny] = self.squares;
        let white = (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j))).filter(|(i, j)| (i + j) % 2 == 1);
        white.enumerate().map(|(k, (i, j))| (i, j, k))
    }
    /// Upper left corner of the marker in square (i, j).
    pub fn corner(&self, i: u32, j: u32) -> [f64; 2] {
        let rim = 0.5 * (self.square_mm - self.marker_mm);
        [f64::from(i) * self.square_mm + rim, f64::from(j) * self.square_mm + rim]
    }
    /// Whether a cell of marker `k` is black; codes are row by row from the lowest bit, 1 is black.
    pub fn black(&self, k: usize, column: usize, row: usize) -> bool {
        let bits = self.codes.marker_size();
        let ring = row == 0 || column == 0 || row > bits || column > bits;
        ring || self.codes.codes()[k] >> ((row - 1) * bits + column - 1) & 1 == 1
    }
    /// Whether a point of the board lies on a black cell of a marker.
    pub fn black_at(&self, x: f64, y: f64) -> bool {
        let (i, j) = ((x / self.square_mm).floor(), (y / self.square_mm).floor());
        let [nx, ny] = self.squares.map(f64::from);
        if !(i >= 0.0 && j >= 0.0 && i < nx && j < ny) || (i + j) % 2.0 == 0.0 {
            return false;
        }
        let (i, j) = (i as u32, j as u32);
        let [x0, y0] = self.corner(i, j);
        let (c, r) = (((x - x0) / self.cell_mm()).floor(), ((y - y0) / self.cell_mm()).floor());
        let n = self.cells() as f64;
        // White squares before this one, row by row: every second one is white.
        let k = (j * self.squares[0] + i) / 2;
        c >= 0.0 && r >= 0.0 && c < n && r < n && self.black(k as usize, c as usize, r as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(squares: [u32; 2], dictionary: &str) -> BoardSpec {
        BoardSpec::Charuco { squares, square_mm: 10.0, marker_mm: 7.0, dictionary: dictionary.into(), border_mm: 0.0 }
    }

    #[test]
    fn points_and_cells_tell_the_same_marker() {
        // Odd and even numbers of columns start their rows with other colours.
        for squares in [[5, 4], [6, 5], [7, 3]] {
            let m = Markers::of(&board(squares, "DICT_5X5_250")).unwrap().unwrap();
            assert_eq!(m.places().count(), (squares[0] * squares[1] / 2) as usize);
            for (i, j, k) in m.places() {
                let [x, y] = m.corner(i, j);
                for (c, r) in (0..m.cells()).flat_map(|r| (0..m.cells()).map(move |c| (c, r))) {
                    let middle = |from: f64, n: usize| from + (n as f64 + 0.5) * m.cell_mm();
                    assert_eq!(m.black_at(middle(x, c), middle(y, r)), m.black(k, c, r), "{squares:?} {k} {c} {r}");
                }
                assert!(!m.black_at(x - 0.5, y - 0.5) && m.black_at(x + 0.5, y + 0.5));
            }
        }
    }

    #[test]
    fn boards_without_codes_are_refused() {
        assert!(Markers::of(&board([5, 4], "DICT_9X9")).unwrap_err().what.contains("DICT_9X9"));
        assert!(Markers::of(&board([20, 20], "DICT_4X4_50")).unwrap_err().what.contains("200 markers"));
    }
}
