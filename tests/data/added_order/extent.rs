//! In: a scan. Out: how many points it has, and between which heights.
//! Frame and unit: mm in the scan's frame.

use super::at::At;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sheetlight::fault::Result;
use sheetlight::station::load_report;
use ts_rs::TS;

/// The scan whose extent is asked for.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, Deserialize, TS, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtentOrder {
    /// Name of its job
    pub scan: String,
}

/// The extent of a scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, TS, JsonSchema)]
pub struct Extent {
    /// Number of its points.
    pub points: u64,
    /// Range that contains 98 % of its heights, mm.
    pub z_mm: Option<[f64; 2]>,
}

impl ExtentOrder {
    /// Reads it from the scan's report.
    ///
    /// # Errors
    /// No such scan.
    pub fn extent(&self, at: &At) -> Result<Extent> {
        let report = load_report(&at.names.scan(&self.scan)?)?;
        Ok(Extent { points: report.points, z_mm: report.height_map.map(|h| [h.z_low_mm, h.z_high_mm]) })
    }
}
