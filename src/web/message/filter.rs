//! In: nothing. Out: what is taken away of a scan's surface before it is looked at, as pages say it.
//! Frame and unit: the height map's grid frame, mm.

use crate::scan;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

/// What is taken away; what stays is as it was measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(tag = "filter", rename_all = "snake_case")]
pub enum Filter {
    /// Cells whose stated standard deviation is larger.
    Sigma {
        /// mm.
        most_mm: f64,
    },
    /// Cells outside a range of heights.
    Heights {
        /// mm.
        low_mm: f64,
        /// mm.
        high_mm: f64,
    },
    /// What lies in a box.
    Cut {
        /// Two opposite corners: x0 y0 x1 y1, mm.
        corners: [f64; 4],
    },
    /// What lies outside a box.
    Keep {
        /// Two opposite corners: x0 y0 x1 y1, mm.
        corners: [f64; 4],
    },
    /// Pieces of surface of fewer cells.
    Islands {
        /// Fewer than so many go.
        least_cells: u32,
        /// Neighbours that differ by more are of two pieces, mm.
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

/// The filters through which a scan is looked at; all questions about its surface are answered through them.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct Filters {
    /// In their order.
    pub filters: Vec<Filter>,
}

/// What they leave.
#[derive(Clone, Debug, PartialEq, Serialize, TS)]
pub struct Filtered {
    /// In their order.
    pub filters: Vec<Filter>,
    /// Cells that each takes.
    pub cells: Vec<usize>,
    /// Cells that are left.
    pub left: usize,
}

/// A scan that is filtered for good.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS)]
#[serde(deny_unknown_fields)]
pub struct FilterOrder {
    /// The job that scanned.
    pub scan: String,
    /// In their order.
    pub filters: Vec<Filter>,
}
