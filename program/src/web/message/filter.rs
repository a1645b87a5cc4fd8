//! In: nothing. Out: the filters through which a scan is viewed, and what they remove.
//! Frame and unit: the height map's grid frame, mm.

use crate::procedure::filter::Filter;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use ts_rs::TS;

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
