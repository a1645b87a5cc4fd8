//! In: nothing. Out: what a judged scan comes to, as the page shows it.
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
    /// Points by distance from the surface: steps of 0.01 mm, the last takes all beyond.
    pub histogram: Vec<u64>,
    /// Share of the points that lie within 1, 2 and 3 of their own standard deviations of the surface;
    /// a normal distribution has 0.683, 0.954, 0.997.
    pub within_sigmas: [f64; 3],
    /// Largest distance of a point, median over the cells of the height map, mm.
    pub map_median_mm: f64,
}

/// Steps of the histogram, mm.
pub const HISTOGRAM_STEP: f64 = 0.01;
