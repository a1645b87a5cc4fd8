//! In: the description of a board with markers. Out: which cells of its markers are printed black.
//! Frame and unit: board frame, mm; rows and columns of cells counted from the marker's upper left.

use super::spec::{BoardSpec, MarkerLayout};
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
    layout: MarkerLayout,
    /// Width of the black ring, cells.
    ring: usize,
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
        let layout = match board {
            BoardSpec::MarkerGrid { layout, .. } => *layout,
            _ => MarkerLayout::Opencv,
        };
        let ring = board.ring_cells() as usize;
        Ok(Some(Markers { codes, cells, pitch_mm, marker_mm, white, first_id, layout, ring }))
    }
    /// The dictionary of its markers.
    pub fn dictionary(&self) -> Dictionary {
        self.codes
    }
    /// Number of cells across a marker, including its black ring.
    pub fn cells(&self) -> usize {
        self.codes.marker_size() + 2 * self.ring
    }
    /// Width of the black ring, cells.
    pub fn ring(&self) -> usize {
        self.ring
    }
    /// Quarter turns, clockwise, from the markers as OpenCV draws them to those of the board.
    pub fn turn(&self) -> usize {
        if self.layout == MarkerLayout::Kalibr { 2 } else { 0 }
    }
    /// Side of a cell, mm.
    pub fn cell_mm(&self) -> f64 {
        self.marker_mm / self.cells() as f64
    }
    /// Positions of the markers: column, row and the marker's id.
    pub fn places(&self) -> impl Iterator<Item = (u32, u32, usize)> + use<> {
        let ([nx, ny], white, first) = (self.cells, self.white, self.first_id);
        let upward = self.layout == MarkerLayout::Kalibr;
        let all = (0..ny).flat_map(move |j| (0..nx).map(move |i| (i, j)));
        let with = all.filter(move |(i, j)| white.is_none_or(|w| (i + j) % 2 == w));
        with.enumerate().map(move |(k, (i, j))| {
            let k = if upward { ((ny - 1 - j) * nx + i) as usize } else { k };
            (i, j, first + k)
        })
    }
    /// Upper left corner of the marker at (i, j).
    pub fn corner(&self, i: u32, j: u32) -> [f64; 2] {
        let rim = if self.white.is_some() { 0.5 * (self.pitch_mm - self.marker_mm) } else { 0.0 };
        [f64::from(i) * self.pitch_mm + rim, f64::from(j) * self.pitch_mm + rim]
    }
    /// Whether a cell of marker `id` is black. A code holds the cells row by row from the lowest bit; 1 is black.
    pub fn black(&self, id: usize, column: usize, row: usize) -> bool {
        let (bits, ring) = (self.codes.marker_size(), self.ring);
        let inside = |n: usize| (ring..ring + bits).contains(&n);
        if !inside(row) || !inside(column) {
            return true;
        }
        let bit = (row - ring) * bits + column - ring;
        let bit = if self.turn() == 2 { bits * bits - 1 - bit } else { bit };
        self.codes.codes()[id] >> bit & 1 == 1
    }
    /// Whether a point lies on one of the black squares in the corners between the markers.
    fn in_corner_square(&self, x: f64, y: f64) -> bool {
        let gap = self.pitch_mm - self.marker_mm;
        let on = |at: f64, n: u32| {
            let from = (at + gap) / self.pitch_mm;
            (0.0..f64::from(n + 1)).contains(&from) && from.fract() * self.pitch_mm < gap
        };
        self.layout == MarkerLayout::Kalibr && on(x, self.cells[0]) && on(y, self.cells[1])
    }
    /// The black squares in the corners between the markers: left, top and side, mm.
    pub fn corner_squares(&self) -> Vec<[f64; 3]> {
        if self.layout != MarkerLayout::Kalibr {
            return Vec::new();
        }
        let (gap, [nx, ny]) = (self.pitch_mm - self.marker_mm, self.cells);
        let at = |k: u32| f64::from(k) * self.pitch_mm - gap;
        (0..=ny).flat_map(|j| (0..=nx).map(move |i| [at(i), at(j), gap])).collect()
    }
    /// Whether a point of the board lies on a black cell of a marker, or on a square between markers.
    pub fn black_at(&self, x: f64, y: f64) -> bool {
        let (i, j) = ((x / self.pitch_mm).floor(), (y / self.pitch_mm).floor());
        let [nx, ny] = self.cells.map(f64::from);
        if self.in_corner_square(x, y) {
            return true;
        }
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
        let row = if self.layout == MarkerLayout::Kalibr { self.cells[1] - 1 - j } else { j };
        let before = row * self.cells[0] + i;
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
            layout: MarkerLayout::Opencv,
            ring_cells: None,
        };
        let mut kalibr = grid.clone();
        if let BoardSpec::MarkerGrid { layout, .. } = &mut kalibr {
            *layout = MarkerLayout::Kalibr;
        }
        let charuco = [[5, 4], [6, 5], [7, 3]].map(|s| (board(s, "DICT_5X5_250"), s[0] * s[1] / 2));
        let begin_white = [(white([5, 4], 0), 10), (white([6, 5], 3), 15), (white([7, 3], 9), 11)];
        for (squares, count) in charuco.into_iter().chain(begin_white).chain([(grid, 12), (kalibr, 12)]) {
            let m = Markers::of(&squares).unwrap().unwrap();
            assert_eq!(m.places().count(), count as usize);
            for (i, j, k) in m.places() {
                let [x, y] = m.corner(i, j);
                for (c, r) in (0..m.cells()).flat_map(|r| (0..m.cells()).map(move |c| (c, r))) {
                    let middle = |from: f64, n: usize| from + (n as f64 + 0.5) * m.cell_mm();
                    assert_eq!(m.black_at(middle(x, c), middle(y, r)), m.black(k, c, r), "{squares:?} {k} {c} {r}");
                }
                // Kalibr's squares touch the tags' corners; beside the edges is white.
                let diagonal = squares.corner_squares_mm().is_some();
                assert!(m.black_at(x - 0.5, y - 0.5) == diagonal && m.black_at(x + 0.5, y + 0.5));
                assert!(!m.black_at(x - 0.5, y + 3.5) && !m.black_at(x + 3.5, y - 0.5));
            }
        }
    }

    /// The AprilTag project's codes of the first tags, the first cell in the highest bit, 1 for white.
    #[test]
    fn kalibrs_tags_are_those_of_the_apriltag_project() {
        let grid = BoardSpec::MarkerGrid {
            markers: [2, 2],
            marker_mm: 10.0,
            gap_mm: 3.0,
            dictionary: "DICT_APRILTAG_36h11".into(),
            first_id: 0,
            border_mm: 0.0,
            layout: MarkerLayout::Kalibr,
            ring_cells: None,
        };
        let m = Markers::of(&grid).unwrap().unwrap();
        assert_eq!((m.cells(), grid.outline()), (10, [-3.0, -3.0, 26.0, 26.0]));
        for (id, code) in [0xd_5d62_8584u64, 0xd_97f1_8b49, 0xd_d280_910e].into_iter().enumerate() {
            for k in 0..36 {
                assert_eq!(m.black(id, 2 + k % 6, 2 + k / 6), code >> (35 - k) & 1 == 0, "tag {id}, cell {k}");
            }
        }
        // Ids begin at the lower left and go right, then up.
        assert_eq!(m.places().collect::<Vec<_>>(), [(0, 0, 2), (1, 0, 3), (0, 1, 0), (1, 1, 1)]);
    }

    #[test]
    fn boards_without_codes_are_refused() {
        assert!(Markers::of(&board([5, 4], "DICT_9X9")).unwrap_err().what.contains("DICT_9X9"));
        assert!(Markers::of(&board([20, 20], "DICT_4X4_50")).unwrap_err().what.contains("200 markers"));
    }
}
