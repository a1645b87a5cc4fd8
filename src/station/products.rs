//! In: a finished cloud on disk. Out: the files that people and other programs open: height map, its
//! companions, pictures, PCD.
//! Frame and unit: cloud in the base frame, height map in its grid frame; mm.

use super::run::HeightMapFigures;
use crate::fault::Result;
use crate::geometry::Vec3;
use crate::gpu::Device;
use crate::scan::{CloudFile, GridOptions, grid_on, write_pcd};
use std::path::Path;

/// Writes everything that is derived from the cloud; `None` where there are too few points for a map.
pub fn write(
    out: &Path,
    cloud: &Path,
    points: u64,
    options: &GridOptions,
    up: Vec3,
    device: Option<&Device>,
) -> Result<Option<HeightMapFigures>> {
    if points < 100 {
        return Ok(None);
    }
    let source = CloudFile::open(cloud)?;
    let heights = || {
        let map = grid_on(&source, &GridOptions { up, ..options.clone() }, device)?;
        map.save(out)?;
        Ok(map)
    };
    let (map, pcd) = rayon::join(heights, || write_pcd(&out.join("cloud.pcd"), &source, points));
    let map = pcd.and(map)?;
    let (low, high) = map.quantiles(0.01, 0.99).unwrap_or((f32::NAN, f32::NAN));
    Ok(Some(HeightMapFigures {
        width: map.width,
        height: map.height,
        cell_mm: map.cell,
        coverage: map.coverage(),
        z_low_mm: f64::from(low),
        z_high_mm: f64::from(high),
    }))
}
