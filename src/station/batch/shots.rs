//! In: a finished scan. Out: a row for each of its shots.
//! Frame and unit: the scan's frame, mm; grey levels.

use crate::fault::Result;
use crate::scan::PointSource;
use crate::station::scan::report::whole_scan;
use std::path::Path;

/// A shot of a scan.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShotRow {
    /// Index in the recording.
    pub shot: u32,
    /// Where the camera stood.
    pub camera_mm: [f64; 3],
    /// Points of the cloud that are from it.
    pub points: u64,
    /// Mean of those points; none without points.
    pub mean_mm: Option<[f64; 3]>,
    /// Mean of their standard deviations, mm.
    pub sigma_mm: Option<f64>,
    /// Mean height of the stripe over its surroundings, grey levels.
    pub intensity: Option<f64>,
}

#[derive(Clone, Copy, Default)]
struct Sums {
    points: u64,
    at: [f64; 3],
    sigma: f64,
    intensity: f64,
}

/// The shots of a scan, in order.
pub(super) fn rows(scan: &Path) -> Result<Vec<ShotRow>> {
    let (_, shots, cloud) = whole_scan(scan)?;
    let last = shots.places().map(|(shot, _)| shot as usize + 1).max().unwrap_or(0);
    let mut sums = vec![Sums::default(); last];
    cloud.for_each_chunk(&mut |points| {
        for p in points {
            // A cloud's points are from its shots.
            let Some(s) = sums.get_mut(p.shot as usize) else { continue };
            s.points += 1;
            s.at.iter_mut().zip(p.position.as_dvec3().to_array()).for_each(|(sum, v)| *sum += v);
            s.sigma += f64::from(p.sigma_mm);
            s.intensity += f64::from(p.intensity);
        }
    })?;
    let row = |(shot, place): (u32, crate::geometry::Rigid<_, _>)| {
        let s = sums[shot as usize];
        let mean = |sum: f64| (s.points > 0).then(|| sum / s.points as f64);
        ShotRow {
            shot,
            camera_mm: place.translation.into(),
            points: s.points,
            mean_mm: (s.points > 0).then(|| s.at.map(|v| v / s.points as f64)),
            sigma_mm: mean(s.sigma),
            intensity: mean(s.intensity),
        }
    };
    Ok(shots.places().map(row).collect())
}
