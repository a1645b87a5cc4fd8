//! In: the `board` entries of meta.json and board description files. Out: the board's layout.
//! Frame and unit: board frame, mm. Chessboard: origin in the first inner corner, x along the columns, y along the
//! rows, z into the board. ChArUco: origin in the outer corner of the first square.

use super::mark::OriginMark;
use crate::fault::{Fault, Result};
use crate::geometry::Vec3;

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
        /// How the markers are arranged and turned; "opencv" unless stated.
        #[serde(default, skip_serializing_if = "MarkerLayout::is_opencv")]
        layout: MarkerLayout,
        /// Width of a marker's black ring in cells, 1 or 2; unless stated 1, and 2 in Kalibr's layout.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ring_cells: Option<u32>,
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
        /// Mark that shows which way round the grid lies; none unless stated.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        origin: Option<OriginMark>,
        /// Plain margin around the outer dots, mm, 0..=10000; 0 unless stated. It is counted from the dots' centres
        /// if no diameter is stated.
        #[serde(default)]
        border_mm: f64,
    },
}

/// How a grid's markers are arranged and turned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MarkerLayout {
    /// Ids row by row from the upper left; markers as OpenCV draws them.
    #[default]
    Opencv,
    /// Kalibr's AprilGrid: ids row by row from the lower left, upward; tags as the AprilTag project draws them, half
    /// a turn from OpenCV's; a black square in each corner between the tags, as wide as the gap.
    Kalibr,
}

impl MarkerLayout {
    fn is_opencv(&self) -> bool {
        *self == MarkerLayout::Opencv
    }
}

fn black() -> String {
    "black".into()
}

fn is_zero(number: &u32) -> bool {
    *number == 0
}

impl BoardSpec {
    /// Refuses an impossible board.
    pub(in crate::recording) fn check(&self) -> Result<()> {
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
            BoardSpec::MarkerGrid { ring_cells: Some(cells), .. } if !(1..=2).contains(cells) => {
                refuse(format!("the board's ring_cells is {cells}, 1 or 2 is allowed"))
            }
            BoardSpec::Circles { asymmetric: true, origin: Some(_), .. } => {
                refuse("the board is an asymmetric grid and has an origin mark, only square grids have one".into())
            }
            BoardSpec::Circles { dots, pitch_mm, diameter_mm, origin: Some(mark), .. } => {
                mark.refusal(*pitch_mm, *diameter_mm, *dots).map_or(Ok(()), refuse)
            }
            BoardSpec::Chessboard { first_square: colour, .. }
            | BoardSpec::Charuco { first_square: Some(colour), .. }
                if colour != "black" && colour != "white" =>
            {
                refuse(format!("the board's first_square is '{colour}', 'black' or 'white' is allowed"))
            }
            _ => Ok(()),
        }?;
        self.not_metres(*border)
    }

    /// Refuses a board whose print is too narrow for one in millimetres: it is described in metres.
    fn not_metres(&self, border: f64) -> Result<()> {
        let [left, top, right, bottom] = self.outline();
        let across = (right - left).max(bottom - top) - 2.0 * border;
        if across >= METRES {
            return Ok(());
        }
        let (key, length) = (self.length_key(), self.length_mm());
        Err(Fault::input(format!(
            "the board's {key} is {length}: its print would be {across:.4} mm across, at least {METRES} is accepted"
        ))
        .cause("the lengths look like metres")
        .next("state the board's lengths in mm: multiply them by 1000"))
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

    /// Diameter at which a circle grid's larger first dot is drawn, mm: twice that of the others unless stated.
    /// `None` if all dots are equal.
    pub fn drawn_first_diameter(&self) -> Option<f64> {
        match self {
            BoardSpec::Circles { origin: Some(OriginMark::LargerDot { diameter_mm }), .. } => {
                diameter_mm.or(self.drawn_diameter().map(|d| 2.0 * d))
            }
            _ => None,
        }
    }

    /// Width of a marker's black ring, in cells.
    pub fn ring_cells(&self) -> u32 {
        match self {
            BoardSpec::MarkerGrid { ring_cells: Some(cells), .. } => *cells,
            BoardSpec::MarkerGrid { layout: MarkerLayout::Kalibr, .. } => 2,
            _ => 1,
        }
    }

    /// Side of the black squares between the markers of Kalibr's layout, mm; `None` without them.
    pub fn corner_squares_mm(&self) -> Option<f64> {
        match self {
            BoardSpec::MarkerGrid { layout: MarkerLayout::Kalibr, gap_mm, .. } => Some(*gap_mm),
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
                if self.is_hexagonal() {
                    [(f64::from(i) - 0.5 * f64::from(j % 2)) * pitch_mm, f64::from(j) * ROWS * pitch_mm]
                } else if *asymmetric {
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
                let b = b + self.corner_squares_mm().unwrap_or(0.0);
                let side = |n: u32| f64::from(n) * (m + g) - g + b;
                [-b, -b, side(*nx), side(*ny)]
            }
            BoardSpec::Circles { pitch_mm: p, diameter_mm: d, origin, border_mm: b, .. } => {
                let [far_x, far_y] = self.far_dot(*p);
                // An area that is not known to be printed does not count as board.
                let r = d.unwrap_or(0.0) / 2.0;
                let (low, high) = match origin {
                    Some(OriginMark::FrameCorner { frame_mm, .. }) => (*frame_mm, *frame_mm),
                    Some(OriginMark::LargerDot { diameter_mm: Some(first) }) => (first / 2.0, r),
                    _ => (r, r),
                };
                let left = if self.is_hexagonal() { 0.5 * p } else { 0.0 };
                [-left - low - b, -low - b, far_x + high + b, far_y + high + b]
            }
        }
    }
}

impl BoardSpec {
    /// Largest x and y of a circle grid's dots, mm.
    fn far_dot(&self, pitch_mm: f64) -> [f64; 2] {
        match self {
            BoardSpec::Circles { dots: [nx, ny], asymmetric, .. } => {
                let columns = if *asymmetric { 2 * nx - 1 } else { nx - 1 };
                let rows = if self.is_hexagonal() { ROWS } else { 1.0 };
                [f64::from(columns) * pitch_mm, f64::from(ny - 1) * rows * pitch_mm]
            }
            _ => [0.0; 2],
        }
    }

    /// Whether a circle grid's rows are shifted by half a pitch, as HALCON's finder patterns imply.
    pub fn is_hexagonal(&self) -> bool {
        matches!(self, BoardSpec::Circles { origin: Some(OriginMark::FinderPatterns { .. }), .. })
    }

    /// The holes of finder patterns as they are drawn: index of the feature, and diameter in mm.
    pub fn drawn_holes(&self) -> Vec<(usize, f64)> {
        let BoardSpec::Circles { dots, origin: Some(OriginMark::FinderPatterns { at }), .. } = self else {
            return Vec::new();
        };
        let diameter = HOLE * self.drawn_diameter().unwrap_or(0.0);
        let index = |[i, j]: [i32; 2]| j as usize * dots[0] as usize + i as usize;
        OriginMark::holes(at).into_iter().map(|hole| (index(hole), diameter)).collect()
    }

    /// Whether a point lies on the frame of a circle grid, its triangle included.
    pub fn on_frame(&self, x: f64, y: f64) -> bool {
        match self {
            BoardSpec::Circles { origin: Some(mark), pitch_mm, .. } => mark.frame_at(self.far_dot(*pitch_mm), x, y),
            _ => false,
        }
    }
}

/// Least width of a print, mm.
const METRES: f64 = 2.0;

/// Distance of two rows of a hexagonal arrangement over the pitch: half the square root of 3.
const ROWS: f64 = 0.866_025_403_784_438_6;
/// Diameter of a finder pattern's holes over that of the marks, as measured in pictures of a plate.
const HOLE: f64 = 0.37;

fn lattice(nx: u32, ny: u32, at: impl Fn(u32, u32) -> [f64; 2]) -> Vec<Vec3> {
    (0..ny)
        .flat_map(|j| (0..nx).map(move |i| (i, j)))
        .map(|(i, j)| {
            let [x, y] = at(i, j);
            Vec3::new(x, y, 0.0)
        })
        .collect()
}
