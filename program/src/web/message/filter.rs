//! In: nothing. Out: filters that remove cells from a scan's surface before it is viewed, as pages state them.
//! Frame and unit: the height map's grid frame, mm.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::scan;
use ts_rs::TS;

/// A filter. It removes cells; the remaining ones keep their measured values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(tag = "filter", rename_all = "snake_case")]
pub enum Filter {
    /// Removes cells whose stated standard deviation is larger than this.
    Sigma {
        /// Largest standard deviation, mm.
        most_mm: f64,
    },
    /// Removes cells outside a range of heights.
    Heights {
        /// Lowest height, mm.
        low_mm: f64,
        /// Highest height, mm.
        high_mm: f64,
    },
    /// Removes cells inside a box.
    Cut {
        /// Two opposite corners: x0 y0 x1 y1, mm.
        corners: [f64; 4],
    },
    /// Removes cells outside a box.
    Keep {
        /// Two opposite corners: x0 y0 x1 y1, mm.
        corners: [f64; 4],
    },
    /// Removes connected pieces of surface with too few cells.
    Islands {
        /// Pieces with fewer cells are removed.
        least_cells: u32,
        /// Neighbouring cells whose heights differ by more belong to different pieces, mm.
        step_mm: f64,
    },
}

impl From<Filter> for scan::Filter {
    fn from(f: Filter) -> scan::Filter {
        match f {
            Filter::Sigma { most_mm } => scan::Filter::Sigma { most_mm },
            Filter::Heights { low_mm, high_mm } => scan::Filter::Heights { low_mm, high_mm },
            Filter::Cut { corners } => scan::Filter::Cut { corners },
            Filter::Keep { corners } => scan::Filter::Keep { corners },
            Filter::Islands { least_cells, step_mm } => scan::Filter::Islands { least_cells, step_mm },
        }
    }
}

/// The filters applied when a scan is viewed; all answers about its surface use them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Filters {
    /// In the order in which they are applied.
    pub filters: Vec<Filter>,
}

/// Result of the filters.
#[derive(Clone, Debug, PartialEq, Serialize, TS, JsonSchema)]
pub struct Filtered {
    /// In the order in which they are applied.
    pub filters: Vec<Filter>,
    /// Number of cells that each filter removes.
    pub cells: Vec<usize>,
    /// Number of cells that remain.
    pub left: usize,
}

/// A filtered scan to be stored as a new scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterOrder {
    /// The job that made the scan.
    pub scan: String,
    /// In the order in which they are applied.
    pub filters: Vec<Filter>,
}
