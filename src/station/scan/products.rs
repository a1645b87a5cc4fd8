//! In: a finished cloud on disk. Out: the files that people and other programs open: height map, its companion
//! maps, pictures, PCD.
//! Frame and unit: cloud in the base frame, height map in its grid frame; mm.

use super::report::HeightMapFigures;
use crate::fault::Result;
use crate::geometry::Vec3;
use crate::gpu::Device;
use crate::rig::hash_file;
use crate::scan::{CloudFile, GridOptions, HeightMap, grid_on, write_pcd};
use std::collections::BTreeMap;
use std::path::Path;

/// Fewest points of a height map.
pub(super) const FEWEST_OF_A_MAP: u64 = 100;

/// Writes everything that is derived from the cloud. The figures are `None` if there are too few points for a map.
/// Also returns the SHA-256 of cloud and map by file name.
pub fn write(
    out: &Path,
    cloud: &Path,
    points: u64,
    options: &GridOptions,
    up: Vec3,
    device: Option<&Device>,
) -> Result<(Option<HeightMapFigures>, BTreeMap<String, String>)> {
    if points < FEWEST_OF_A_MAP {
        return Ok((None, BTreeMap::from([hash(out, "cloud.ply")?])));
    }
    let source = CloudFile::open(cloud)?;
    let heights = || {
        let map = grid_on(&source, &GridOptions { up, ..options.clone() }, device)?;
        map.save(out)?;
        Ok(map)
    };
    let ((map, pcd), of_cloud) = rayon::join(
        || rayon::join(heights, || write_pcd(&out.join("cloud.pcd"), &source, points, source.frame())),
        || hash(out, "cloud.ply"),
    );
    let map = pcd.and(map)?;
    Ok((Some(figures(&map)), hashes(out, of_cloud?)?))
}

/// The same for an existing map, in the cloud's own grid.
pub fn of_map(
    out: &Path,
    cloud: &Path,
    points: u64,
    map: &HeightMap,
) -> Result<(HeightMapFigures, BTreeMap<String, String>)> {
    map.save(out)?;
    let source = CloudFile::open(cloud)?;
    write_pcd(&out.join("cloud.pcd"), &source, points, source.frame())?;
    Ok((figures(map), hashes(out, hash(out, "cloud.ply")?)?))
}

/// Name and SHA-256 of a file of the folder.
pub fn hash(out: &Path, name: &str) -> Result<(String, String)> {
    Ok((name.to_owned(), hash_file(&out.join(name))?))
}

fn hashes(out: &Path, of_cloud: (String, String)) -> Result<BTreeMap<String, String>> {
    Ok(BTreeMap::from([of_cloud, hash(out, "height.tif")?, hash(out, "height.json")?]))
}

/// The figures of a map for a report.
pub(super) fn figures(map: &HeightMap) -> HeightMapFigures {
    let (low, high) = map.quantiles(0.01, 0.99).unwrap_or((0.0, 0.0));
    HeightMapFigures {
        width: map.width,
        height: map.height,
        cell_mm: map.cell,
        coverage: map.coverage(),
        z_low_mm: f64::from(low),
        z_high_mm: f64::from(high),
    }
}
