//! In: nothing. Out: the figures of a judged scan, as the page shows them.
//! Frame and unit: base frame, mm.

use crate::simulate::CloudErrors;
use std::collections::BTreeMap;

/// A scan's errors against the truth.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Judged {
    /// Errors of all points, mm.
    pub cloud: CloudErrors,
    /// Errors of the points nearest to each part; "board" is everything else.
    pub by_part: BTreeMap<String, CloudErrors>,
    /// Points by distance from the surface in bins of 0.01 mm; the last bin takes all larger distances.
    pub histogram: Vec<u64>,
    /// Share of the points that lie within 1, 2 and 3 of their own standard deviations of the surface;
    /// a normal distribution has 0.683, 0.954, 0.997.
    pub within_sigmas: [f64; 3],
    /// Median over the height map's cells of their distance from the true surface, mm.
    pub map_median_mm: f64,
}

/// Width of a histogram bin, mm.
pub const HISTOGRAM_STEP: f64 = 0.01;
