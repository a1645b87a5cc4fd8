//! In: matches in a height map. Out: where each of them lies in the scan's frame, for a list of all places that look
//! like the part.
//! Frame and unit: the scan's frame, mm; degrees from x towards y of the map's grid.

use crate::find::search::full::Match;
use crate::geometry::Vec3;
use crate::scan::HeightMap;

/// A place that looks like the part; only the best one is measured on the points.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Place {
    /// Score of the [`Match`].
    pub score: f64,
    /// The part's origin on the map's surface, in the scan's frame, mm; at height 0 of the grid where nothing was
    /// measured there.
    pub at_mm: [f64; 3],
    /// Turn in the map, x towards y, degrees.
    pub angle_deg: f64,
    /// Standard deviations of its position in the map, mm.
    pub sigma_mm: Option<[f64; 2]>,
    /// Standard deviation of the turn, degrees.
    pub sigma_deg: f64,
}

/// The places of matches, in their order.
pub(super) fn places(matches: &[Match], map: &HeightMap) -> Vec<Place> {
    let place = |m: &Match| {
        let z = map.get(m.pose.x.round() as i64, m.pose.y.round() as i64).unwrap_or(0.0);
        let at = Vec3::new((m.pose.x + 0.5) * map.cell, (m.pose.y + 0.5) * map.cell, f64::from(z));
        Place {
            score: m.score,
            at_mm: map.base_from_grid.point(&at).into(),
            angle_deg: m.pose.angle.to_degrees(),
            sigma_mm: m.sigma_mm,
            sigma_deg: m.sigma_deg,
        }
    };
    matches.iter().map(place).collect()
}
