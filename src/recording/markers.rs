//! In: the description of a board with markers. Out: which cells of its markers are printed black.
//! Frame and unit: board frame, mm; rows and columns of cells counted from the marker's upper left.

use super::BoardSpec;
use crate::fault::{Fault, Result};
use calib_targets_aruco::{Dictionary, resolve_dictionary};

/// The markers of one board, in OpenCV's order: row by row over the white squares of a ChArUco board, or over all
/// positions of a grid.
#[derive(Clone, Debug)]
pub struct Markers {
    codes: Dictionary,
    /// Cells that may hold a marker [columns, rows].
    cells: [u32; 2],
    pitch_mm: f64,
    marker_mm: f64,
    /// Restricts markers to the white cells of a checker pattern: those whose column plus row is odd (1) or even
    /// (0). There a marker is in the middle of its cell. `None`: every cell has a marker.
    white: Option<u32>,
    first_id: usize,
}

impl Markers {
    /// `None` for boards without markers.
    ///
    /// # Errors
    /// An unknown dictionary, or one with fewer codes than the board has markers.
    pub fn of(board: &BoardSpec) -> Result<Option<Markers>> {
        let (cells, pitch_mm, marker_mm, name, white, first_id) = match board {
            BoardSpec::Charuco { squares, square_mm, marker_mm, dictionary, first_id, .. } => {
                let white = Some(u32::from(!board.begins_white()));
                (*squares, *square_mm, *marker_mm, dictionary, white, *first_id as usize)
            }
            BoardSpec::MarkerGrid { markers, marker_mm, gap_mm, dictionary, first_id, .. } => {
                (*markers, marker_mm + gap_mm, *marker_mm, dictionary, None, *first_id as usize)
            }
            _ => return Ok(None),
        };
        let codes = resolve_dictionary(name).ok_or_else(|| {
            Fault::usage(format!("'{name}' is not a known marker dictionary")).next(
                "use OpenCV's name, e.g. \
                DICT_5X5_250",
            )
        })?;
        let all = cells[0] as usize * cells[1] as usize;
        // If the number of squares is odd, the colour of the first square has one square more.
        let needed = first_id
            + match white {
                None => all,
                Some(1) => all / 2,
                Some(_) => all.div_ceil(2),
            };
        if needed > codes.codes().len() {
            return Err(Fault::usage(format!("the board needs {needed} markers, {name} has {}", codes.codes().len()))
                .next("choose a larger dictionary, a smaller board or a lower first_id"));
        }
        Ok(Some(Markers { codes, cells, pitch_mm, marker_mm, white, first_id }))
    }
    /// The dictionary of its markers.
    pub fn dictionary(&self) -> Dictionary {
        self.codes
    }
    /// Number of cells across a marker, including its black ring.
    pub fn cells(&self) -> usize {
        self.codes.marker_size() + 2
    }
    /// Side of a cell, mm.
    pub fn cell_mm(&self) -> f64 {
        self.marker_mm / self.cells() as f64
    }
    /// Positions of the markers: column, row and the marker's id.
    pub fn places(&self) -> impl Iterator<Item = (u32, u32, usize)> + use<> {
        let ([nx, ny], white, first) = (self.cells, self.white, self.first_id);
        let all = (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)));
        let with = all.filter(move |(i, j)| white.is_none_or(|w| (i + j) % 2 == w));
        with.enumerate().map(move |(k, (i, j))| (i, j, first + k))
    }
    /// Upper left corner of the marker at (i, j).
    pub fn corner(&self, i: u32, j: u32) -> [f64; 2] {
        let rim = if self.white.is_some() { 0.5 * (self.pitch_mm - self.marker_mm) } else { 0.0 };
        [f64::from(i) * self.pitch_mm + rim, f64::from(j) * self.pitch_mm + rim]
    }
    /// Whether a cell of marker `id` is black. A code holds the cells row by row from the lowest bit; 1 is black.
    pub fn black(&self, id: usize, column: usize, row: usize) -> bool {
        let bits = self.codes.marker_size();
        let ring = row == 0 || column == 0 || row > bits || column > bits;
        ring || self.codes.codes()[id] >> ((row - 1) * bits + column - 1) & 1 == 1
    }
    /// Whether a point of the board lies on a black cell of a marker.
    pub fn black_at(&self, x: f64, y: f64) -> bool {
        let (i, j) = ((x / self.pitch_mm).floor(), (y / self.pitch_mm).floor());
        let [nx, ny] = self.cells.map(f64::from);
        if !(i >= 0.0 && j >= 0.0 && i < nx && j < ny) {
            return false;
        }
        let (i, j) = (i as u32, j as u32);
        if self.white.is_some_and(|w| (i + j) % 2 != w) {
            return false;
        }
        let [x0, y0] = self.corner(i, j);
        let (c, r) = (((x - x0) / self.cell_mm()).floor(), ((y - y0) / self.cell_mm()).floor());
        let n = self.cells() as f64;
        let before = j * self.cells[0] + i;
        // Every second square before a white one is white.
        let id = self.first_id + if self.white.is_some() { before / 2 } else { before } as usize;
        c >= 0.0 && r >= 0.0 && c < n && r < n && self.black(id, c as usize, r as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn board(squares: [u32; 2], dictionary: &str) -> BoardSpec {
        let (dictionary, first_square) = (dictionary.into(), None);
        let (square_mm, marker_mm, border_mm, first_id) = (10.0, 7.0, 0.0, 0);
        BoardSpec::Charuco { squares, square_mm, marker_mm, dictionary, first_id, first_square, border_mm }
    }

    fn white(squares: [u32; 2], from: u32) -> BoardSpec {
        let mut board = board(squares, "DICT_5X5_250");
        if let BoardSpec::Charuco { first_square, first_id, .. } = &mut board {
            (*first_square, *first_id) = (Some("white".into()), from);
        }
        board
    }

    #[test]
    fn points_and_cells_tell_the_same_marker() {
        // With odd and with even numbers of columns, rows start with different colours.
        let grid = BoardSpec::MarkerGrid {
            markers: [4, 3],
            marker_mm: 7.0,
            gap_mm: 2.0,
            dictionary: "DICT_APRILTAG_36h11".into(),
            first_id: 40,
            border_mm: 2.0,
        };
        let charuco = [[5, 4], [6, 5], [7, 3]].map(|s| (board(s, "DICT_5X5_250"), s[0] * s[1] / 2));
        let begin_white = [(white([5, 4], 0), 10), (white([6, 5], 3), 15), (white([7, 3], 9), 11)];
        for (squares, count) in charuco.into_iter().chain(begin_white).chain([(grid, 12)]) {
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
