//! What a foreign file holds: numbers, to which no unit is assigned yet.

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
        /// Their number type; whole numbers cannot mark a missing value by themselves, as NaN does.
        kind: Kind,
        /// What the file states about them; not applied yet.
        says: Says,
    },
    /// Points in the order of the file; a missing one has a coordinate that is not finite.
    Points {
        /// Points per line, if the file is organised in lines of equal length.
        line: Option<usize>,
        /// Coordinates.
        points: Vec<[f64; 3]>,
        /// An intensity for each point, if the file holds intensities.
        intensity: Option<Vec<f32>>,
    },
}

/// Most points or cells of a file.
pub(super) const MOST_POINTS: usize = 1 << 26;
