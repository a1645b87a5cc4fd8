//! In: a scan, filters. Out: a scan without the points and cells that the filters remove.
//! Frame and unit: the height map's grid frame, mm.

use super::at::Names;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::fault::Result;
use sheetlight::files::not_over_any;
use sheetlight::scan;
use sheetlight::station::{ScanReport, filter_scan, of_a_scan};
use std::path::Path;
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

impl From<scan::Filter> for Filter {
    fn from(f: scan::Filter) -> Filter {
        match f {
            scan::Filter::Sigma { most_mm } => Filter::Sigma { most_mm },
            scan::Filter::Heights { low_mm, high_mm } => Filter::Heights { low_mm, high_mm },
            scan::Filter::Cut { corners } => Filter::Cut { corners },
            scan::Filter::Keep { corners } => Filter::Keep { corners },
            scan::Filter::Islands { least_cells, step_mm } => Filter::Islands { least_cells, step_mm },
        }
    }
}

/// A filtered copy of a scan.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FilterOrder {
    /// Folder from sheetlight scan --out; over HTTP the name of its job
    pub scan: String,
    /// Filter: sigma:MM, heights:LOW,HIGH, cut:X0,Y0,X1,Y1, keep:X0,Y0,X1,Y1 or islands:CELLS,STEP; may be repeated
    #[arg(long = "filter", value_name = "FILTER", required = true, value_parser = typed, allow_hyphen_values = true)]
    pub filters: Vec<Filter>,
}

impl FilterOrder {
    /// Writes the filtered copy into the folder `out`.
    ///
    /// # Errors
    /// No such scan, a filter that removes everything or whose numbers are impossible, or `out` holds another scan.
    pub fn filter(&self, names: &dyn Names, out: &Path) -> Result<ScanReport> {
        let scan = names.scan(&self.scan)?;
        not_over_any(&out.join("scan.json"), &scan, of_a_scan)?;
        let filters: Vec<scan::Filter> = self.filters.iter().map(|f| (*f).into()).collect();
        filter_scan(&scan, &filters, out)
    }
}

fn typed(words: &str) -> std::result::Result<Filter, String> {
    words.parse::<scan::Filter>().map(Filter::from)
}
