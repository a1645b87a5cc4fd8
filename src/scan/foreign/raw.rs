//! What a foreign file holds: numbers, with no unit given to them yet.

use crate::raster::{Kind, Says};

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Raw {
    /// A picture of heights: levels by column and row, row 0 at the top.
    Picture {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Row by row, as written; NaN where the file hides a pixel.
        levels: Vec<f64>,
        /// What kind of numbers they are; whole ones cannot say by themselves that a value is missing.
        kind: Kind,
        /// What the file says about them, which is not applied yet.
        says: Says,
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
