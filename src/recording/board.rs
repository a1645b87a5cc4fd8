//! In: the `board` entries of meta.json and board description files. Out: the board's layout.
//! Frame and unit: board frame, mm. Chessboard: origin in the first inner corner, x along the columns, y along the
//! rows, z into the board. ChArUco: origin in the outer corner of the first square.

use crate::fault::{Fault, Result};
use crate::geometry::Vec3;
use std::path::Path;

/// A calibration target as a description file or meta.json states it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum BoardSpec {
    /// Black and white squares; the features are the inner corners.
    Chessboard {
        /// Inner corners [columns, rows].
        inner_corners: [u32; 2],
        /// Side of a square, mm; above 0, up to 10000.
        square_mm: f64,
        /// Plain margin around the outer squares, mm, 0..=10000; 0 unless stated.
        #[serde(default)]
        border_mm: f64,
        /// Colour of the corner square outside the origin; "black" unless stated.
        #[serde(default = "black")]
        first_square: String,
    },
    /// A chessboard with a marker in each white square; the features are the inner corners.
    Charuco {
        /// Squares [columns, rows].
        squares: [u32; 2],
        /// Side of a square, mm; above 0, up to 10000.
        square_mm: f64,
        /// Side of a marker, its black ring included, mm; smaller than a square.
        marker_mm: f64,
        /// OpenCV's name, e.g. DICT_5X5_250.
        dictionary: String,
        /// Id of the first marker; the others follow row by row.
        #[serde(default, skip_serializing_if = "is_zero")]
        first_id: u32,
        /// Colour of the square at the origin. If it is not stated, the markers' ids determine it in each picture.
        /// OpenCV draws "black" since 4.6. Earlier versions, and its "legacy pattern", draw boards with an even
        /// number of rows with "white" first.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        first_square: Option<String>,
        /// Plain margin around the outer squares, mm, 0..=10000; 0 unless stated.
        #[serde(default)]
        border_mm: f64,
    },
    /// ArUco or AprilTag markers in rows, one or more, with white between them.
    MarkerGrid {
        /// Markers [columns, rows]; [1, 1] for a single one.
        markers: [u32; 2],
        /// Side of a marker, its black ring included, mm; above 0, up to 10000.
        marker_mm: f64,
        /// White gap between two markers, mm; not needed for a single one.
        #[serde(default)]
        gap_mm: f64,
        /// OpenCV's name, e.g. DICT_APRILTAG_36h11.
        dictionary: String,
        /// Id of the first marker; the others follow row by row.
        #[serde(default)]
        first_id: u32,
        /// White margin around the outer markers, mm, 0..=10000; 0 unless stated.
        #[serde(default)]
        border_mm: f64,
    },
    /// Dots on a square grid [columns, rows]; asymmetric grids shift every other row by half a pitch.
    Circles {
        /// Dots [columns, rows], 2..=1000 each.
        dots: [u32; 2],
        /// Distance between two rows, and between the dots of a row (doubled in an asymmetric grid), mm.
        pitch_mm: f64,
        /// Diameter of a dot, mm; measured in each picture if not stated.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        diameter_mm: Option<f64>,
        /// OpenCV's layout: odd rows are shifted by `pitch_mm`.
        #[serde(default)]
        asymmetric: bool,
        /// Plain margin around the outer dots, mm, 0..=10000; 0 unless stated. It is counted from the dots' centres
        /// if no diameter is stated.
        #[serde(default)]
        border_mm: f64,
    },
}

fn black() -> String {
    "black".into()
}

fn is_zero(number: &u32) -> bool {
    *number == 0
}

impl BoardSpec {
    /// Reads a board's description file, as `sheetlight board` writes it.
    pub fn load(path: &Path) -> Result<BoardSpec> {
        let text = crate::files::read_text(path)?;
        let board: BoardSpec = serde_json::from_str(&text).map_err(|e| {
            Fault::input(format!("{}: is not a board description: {e}", path.display()))
                .cause(crate::files::slip_in(&text, e.line(), "a misspelt key or a missing size"))
                .next("compare it with docs/file-formats.md, or write one with sheetlight board")
        })?;
        board.check().map_err(|e| e.at(path.display()))?;
        Ok(board)
    }

    /// Refuses an impossible board.
    pub(super) fn check(&self) -> Result<()> {
        let (count, what, least, border) = match self {
            BoardSpec::Chessboard { inner_corners, border_mm, .. } => (inner_corners, "inner corners", 2, border_mm),
            BoardSpec::Charuco { squares, border_mm, .. } => (squares, "squares", 3, border_mm),
            BoardSpec::MarkerGrid { markers, border_mm, .. } => (markers, "markers", 1, border_mm),
            BoardSpec::Circles { dots, border_mm, .. } => (dots, "dots", 2, border_mm),
        };
        let refuse = |what: String| {
            Err(Fault::input(what)
                .cause("the board's description was typed by hand, or the unit is not mm")
                .next("measure the board and correct its description"))
        };
        if let Some(n) = count.iter().find(|n| !(least..=1000).contains(*n)) {
            return refuse(format!("the board has {n} {what} along a side, {least} to 1000 are allowed"));
        }
        let in_range = |v: f64| v > 0.0 && v <= 10_000.0;
        // What is printed in a cell must fit into it.
        let (cell, drawn) = match self {
            BoardSpec::Chessboard { square_mm, .. } => (*square_mm, None),
            BoardSpec::Charuco { square_mm, marker_mm, .. } => (*square_mm, Some(("marker_mm", *marker_mm))),
            BoardSpec::MarkerGrid { marker_mm, .. } => (*marker_mm, None),
            BoardSpec::Circles { pitch_mm, diameter_mm, .. } => (*pitch_mm, diameter_mm.map(|d| ("diameter_mm", d))),
        };
        let name = self.length_key();
        if !in_range(cell) {
            return refuse(format!("the board's {name} is {cell}, above 0 and up to 10000 mm is allowed"));
        }
        if let Some((inner, v)) = drawn.filter(|(_, v)| !(*v > 0.0 && *v < cell)) {
            return refuse(format!("the board's {inner} is {v}, above 0 and below {name} {cell} is allowed"));
        }
        if !(0.0..=10_000.0).contains(border) {
            return refuse(format!("the board's border_mm is {border}, 0 to 10000 mm is allowed"));
        }
        match self {
            // Without a white gap two markers merge into one patch.
            BoardSpec::MarkerGrid { markers, marker_mm, gap_mm, .. }
                if !(0.0..=10_000.0).contains(gap_mm) || (markers != &[1, 1] && *gap_mm < 0.1 * marker_mm) =>
            {
                let least = 0.1 * marker_mm;
                refuse(format!("the board's gap_mm is {gap_mm}, {least} (a tenth of marker_mm) to 10000 mm is allowed"))
            }
            BoardSpec::Chessboard { first_square: colour, .. }
            | BoardSpec::Charuco { first_square: Some(colour), .. }
                if colour != "black" && colour != "white" =>
            {
                refuse(format!("the board's first_square is '{colour}', 'black' or 'white' is allowed"))
            }
            _ => Ok(()),
        }
    }

    /// Whether the square at a ChArUco board's origin is white, and so contains a marker. A board that does not
    /// state its first square is drawn with a black one.
    pub fn begins_white(&self) -> bool {
        matches!(self, BoardSpec::Charuco { first_square: Some(colour), .. } if colour == "white")
    }

    /// Whether a picture of part of this ChArUco board may leave the colour of its first square undetermined if the
    /// description does not state it. With odd columns and even rows, one order of markers equals the other shifted
    /// by a column.
    pub fn first_square_may_stay_open(&self) -> bool {
        match self {
            BoardSpec::Charuco { squares: [columns, rows], first_square: None, .. } => {
                columns % 2 == 1 && rows % 2 == 0
            }
            _ => false,
        }
    }

    /// A ChArUco board that does not state its first square, with that square set as `white` says; any other board
    /// unchanged.
    pub fn beginning(&self, white: bool) -> BoardSpec {
        let mut board = self.clone();
        if let BoardSpec::Charuco { first_square: open @ None, .. } = &mut board {
            *open = Some(if white { "white" } else { "black" }.into());
        }
        board
    }

    /// Diameter at which a circle grid's dots are drawn, mm: half of the pitch unless stated.
    pub fn drawn_diameter(&self) -> Option<f64> {
        match self {
            BoardSpec::Circles { pitch_mm, diameter_mm, .. } => Some(diameter_mm.unwrap_or(0.5 * pitch_mm)),
            _ => None,
        }
    }

    /// The key that states the size of the board's cells, mm: every length on the board scales with it.
    pub fn length_key(&self) -> &'static str {
        match self {
            BoardSpec::Chessboard { .. } | BoardSpec::Charuco { .. } => "square_mm",
            BoardSpec::MarkerGrid { .. } => "marker_mm",
            BoardSpec::Circles { .. } => "pitch_mm",
        }
    }

    /// The size of the board's cells, mm, under [`BoardSpec::length_key`].
    pub fn length_mm(&self) -> f64 {
        match self {
            BoardSpec::Chessboard { square_mm, .. } | BoardSpec::Charuco { square_mm, .. } => *square_mm,
            BoardSpec::MarkerGrid { marker_mm, .. } => *marker_mm,
            BoardSpec::Circles { pitch_mm, .. } => *pitch_mm,
        }
    }

    /// Positions of the features in the board frame, row by row; a feature's index is its id.
    /// Chessboard and ChArUco: the inner corners; a ChArUco board's origin is one square outside the first of them.
    /// Circles: the centres. In an asymmetric grid (OpenCV's layout) columns are two half pitches apart and odd rows
    /// are shifted by one.
    pub fn features(&self) -> Vec<Vec3> {
        match self {
            BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm, .. } => {
                lattice(*nx, *ny, |i, j| [f64::from(i) * square_mm, f64::from(j) * square_mm])
            }
            BoardSpec::Charuco { squares: [nx, ny], square_mm, .. } => {
                lattice(nx.saturating_sub(1), ny.saturating_sub(1), |i, j| {
                    [f64::from(i + 1) * square_mm, f64::from(j + 1) * square_mm]
                })
            }
            BoardSpec::MarkerGrid { markers: [nx, ny], marker_mm, gap_mm, .. } => {
                let pitch = marker_mm + gap_mm;
                let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
                let first = lattice(*nx, *ny, |i, j| [f64::from(i) * pitch, f64::from(j) * pitch]);
                first
                    .iter()
                    .flat_map(|f| corners.map(|[x, y]| f + Vec3::new(x * marker_mm, y * marker_mm, 0.0)))
                    .collect()
            }
            BoardSpec::Circles { dots: [nx, ny], pitch_mm, asymmetric, .. } => lattice(*nx, *ny, |i, j| {
                if *asymmetric {
                    [f64::from(2 * i + j % 2) * pitch_mm, f64::from(j) * pitch_mm]
                } else {
                    [f64::from(i) * pitch_mm, f64::from(j) * pitch_mm]
                }
            }),
        }
    }
    /// The outline [x low, y low, x high, y high], including the border.
    pub fn outline(&self) -> [f64; 4] {
        match self {
            BoardSpec::Chessboard { inner_corners: [nx, ny], square_mm: s, border_mm: b, .. } => {
                [-s - b, -s - b, f64::from(*nx) * s + b, f64::from(*ny) * s + b]
            }
            BoardSpec::Charuco { squares: [nx, ny], square_mm: s, border_mm: b, .. } => {
                [-b, -b, f64::from(*nx) * s + b, f64::from(*ny) * s + b]
            }
            BoardSpec::MarkerGrid { markers: [nx, ny], marker_mm: m, gap_mm: g, border_mm: b, .. } => {
                let side = |n: u32| f64::from(n) * (m + g) - g + b;
                [-b, -b, side(*nx), side(*ny)]
            }
            BoardSpec::Circles { dots: [nx, ny], pitch_mm: p, diameter_mm: d, asymmetric, border_mm: b } => {
                let columns = if *asymmetric { f64::from(2 * nx - 1) } else { f64::from(nx - 1) };
                // An area that is not known to be printed does not count as board.
                let r = d.unwrap_or(0.0) / 2.0 + b;
                [-r, -r, columns * p + r, f64::from(ny - 1) * p + r]
            }
        }
    }
}

fn lattice(nx: u32, ny: u32, at: impl Fn(u32, u32) -> [f64; 2]) -> Vec<Vec3> {
    (0..ny)
        .flat_map(|j| (0..nx).map(move |i| (i, j)))
        .map(|(i, j)| {
            let [x, y] = at(i, j);
            Vec3::new(x, y, 0.0)
        })
        .collect()
}
