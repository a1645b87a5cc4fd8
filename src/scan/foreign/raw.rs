//! In: nothing. Out: what a foreign file holds: points as numbers, no unit given to them yet.
//! Frame and unit: the file's own.

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Raw {
    /// A picture of heights: levels by column and row, row 0 at the top; NaN where the file itself says that nothing is there.
    Picture {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Row by row.
        levels: Vec<f32>,
        /// True for whole numbers, which cannot say by themselves that a value is missing.
        whole: bool,
    },
    /// Points in the order of the file; a missing one has a coordinate that is not finite.
    Points {
        /// Points a line, where the file is organised in lines of one length.
        line: Option<usize>,
        /// Coordinates.
        points: Vec<[f64; 3]>,
        /// A level of light for each point, where the file has one.
        intensity: Option<Vec<f32>>,
    },
}

/// Most points or cells of a file.
pub(super) const MOST_POINTS: usize = 1 << 26;
