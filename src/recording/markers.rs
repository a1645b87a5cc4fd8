//! In: the description of a board with markers. Out: which cells of its markers are printed black.
//! Frame and unit: board frame, mm; rows and columns of cells from the marker's upper left.

use super::BoardSpec;
use crate::fault::{Fault, Result};
use calib_targets_aruco::{Dictionary, resolve_dictionary};

/// The markers of one board, in OpenCV's order: row by row over the white squares of a ChArUco board, over all
/// places of a grid.
#[derive(Clone, Debug)]
pub struct Markers {
    codes: Dictionary,
    /// Cells that may hold a marker [columns, rows].
    cells: [u32; 2],
    pitch_mm: f64,
    marker_mm: f64,
    /// Only the white cells of a checker pattern hold one, in their middle.
    checker: bool,
    first_id: usize,
}

impl Markers {
    /// `None` for boards without markers.
    ///
    /// # Errors
    /// An unknown dictionary, or one with fewer codes than the board has markers.
    pub fn of(board: &BoardSpec) -> Result<Option<Markers>> {
        let (cells, pitch_mm, marker_mm, name, checker, first_id) = match board {
            BoardSpec::Charuco { squares, square_mm, marker_mm, dictionary, .. } => {
                (*squares, *square_mm, *marker_mm, dictionary, true, 0)
            }
            BoardSpec::MarkerGrid { markers, marker_mm, gap_mm, dictionary, first_id, .. } => {
                (*markers, marker_mm + gap_mm, *marker_mm, dictionary, false, *first_id as usize)
            }
            _ => return Ok(None),
        };
        let codes = resolve_dictionary(name).ok_or_else(|| {
            Fault::usage(format!("'{name}' is no known marker dictionary")).next("use OpenCV's name, e.g. DICT_5X5_250")
        })?;
        let all = cells[0] as usize * cells[1] as usize;
        let needed = first_id + if checker { all / 2 } else { all };
        if needed > codes.codes().len() {
            return Err(Fault::usage(format!("the board needs {needed} markers, {name} has {}", codes.codes().len()))
                .next("choose a larger dictionary, a smaller board or a lower first_id"));
        }
        Ok(Some(Markers { codes, cells, pitch_mm, marker_mm, checker, first_id }))
    }
    /// The dictionary that its markers are from.
    pub fn dictionary(&self) -> Dictionary {
        self.codes
    }
    /// Cells across a marker, its black ring included.
    pub fn cells(&self) -> usize {
        self.codes.marker_size() + 2
    }
    /// Side of a cell, mm.
    pub fn cell_mm(&self) -> f64 {
        self.marker_mm / self.cells() as f64
    }
    /// Places with a marker: column, row and the marker's id.
    pub fn places(&self) -> impl Iterator<Item = (u32, u32, usize)> + use<> {
        let ([nx, ny], checker, first) = (self.cells, self.checker, self.first_id);
        let all = (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)));
        let with = all.filter(move |(i, j)| !checker || (i + j) % 2 == 1);
        with.enumerate().map(move |(k, (i, j))| (i, j, first + k))
    }
    /// Upper left corner of the marker at (i, j).
    pub fn corner(&self, i: u32, j: u32) -> [f64; 2] {
        let rim = if self.checker { 0.5 * (self.pitch_mm - self.marker_mm) } else { 0.0 };
        [f64::from(i) * self.pitch_mm + rim, f64::from(j) * self.pitch_mm + rim]
    }
    /// Whether a cell of marker `id` is black; codes are row by row from the lowest bit, 1 is black.
    pub fn black(&self, id: usize, column: usize, row: usize) -> bool {
        let bits = self.codes.marker_size();
        let ring = row == 0 || column == 0 || row > bits || column > bits;
        ring || self.codes.codes()[id] >> ((row - 1) * bits + column - 1) & 1 == 1
    }
    /// Whether a point of the board lies on a black cell of a marker.
    pub fn black_at(&self, x: f64, y: f64) -> bool {
        let (i, j) = ((x / self.pitch_mm).floor(), (y / self.pitch_mm).floor());
        let [nx, ny] = self.cells.map(f64::from);
        if !(i >= 0.0 && j >= 0.0 && i < nx && j < ny) || (self.checker && (i + j) % 2.0 == 0.0) {
            return false;
        }
        let (i, j) = (i as u32, j as u32);
        let [x0, y0] = self.corner(i, j);
        let (c, r) = (((x - x0) / self.cell_mm()).floor(), ((y - y0) / self.cell_mm()).floor());
        let n = self.cells() as f64;
        // White squares before this one, row by row: every second one is white.
        let before = j * self.cells[0] + i;
        let id = self.first_id + if self.checker { before / 2 } else { before } as usize;
        c >= 0.0 && r >= 0.0 && c < n && r < n && self.black(id, c as usize, r as usize)
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
        let grid = BoardSpec::MarkerGrid {
            markers: [4, 3],
            marker_mm: 7.0,
            gap_mm: 2.0,
            dictionary: "DICT_APRILTAG_36h11".into(),
            first_id: 40,
            border_mm: 2.0,
        };
        let charuco = [[5, 4], [6, 5], [7, 3]].map(|s| (board(s, "DICT_5X5_250"), s[0] * s[1] / 2));
        for (squares, count) in charuco.into_iter().chain([(grid, 12)]) {
            let m = Markers::of(&squares).unwrap().unwrap();
            assert_eq!(m.places().count(), count as usize);
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
