//! In: a finished scan, filters. Out: another scan folder with the remaining points and cells; its report lists the
//! filters.
//! Frame and unit: the scan's; filters in its height map's grid, mm.

use super::scan::products;
use super::scan::report::{Filtered, ScanReport, cloud_of, load_report};
use super::scan::scan_folder;
use crate::fault::{Fault, Result};
use crate::files::Lock;
use crate::geometry::Vec3;
use crate::rig::hash_file;
use crate::scan::{CloudPoint, CloudWriter, Filter, HeightMap, MOST_FILTERS, SHOTS_FILE};
use std::path::Path;

/// Fewest points of a filtered scan.
const FEWEST: usize = 100;

/// Applies filters to a map in their order; returns how many cells each removed.
///
/// # Errors
/// Too many filters, or a filter with invalid parameters.
pub fn filter_map(map: &mut HeightMap, filters: &[Filter]) -> Result<Vec<usize>> {
    if filters.len() > MOST_FILTERS {
        return Err(Fault::usage(format!("{} filters, at most {MOST_FILTERS} are applied", filters.len()))
            .next("take some away"));
    }
    filters.iter().try_for_each(Filter::check)?;
    Ok(filters.iter().map(|f| f.apply(map)).collect())
}

/// Whether a point remains: all points remain except those in cells that were removed.
pub fn left<'a>(before: &'a HeightMap, after: &'a HeightMap) -> impl Fn(&glam::Vec3) -> bool + 'a {
    let grid_from_base = before.base_from_grid.inverse();
    move |position| {
        let at = grid_from_base.point(&Vec3::from(position.as_dvec3().to_array()));
        let [x, y] = [at.x, at.y].map(|v| (v / before.cell).floor() as i64);
        before.get(x, y).is_none() || after.get(x, y).is_some()
    }
}

/// Writes the filtered scan. Its map has the grid of the original, so that both can be compared cell by cell.
///
/// # Errors
/// `scan` holds no scan, `out` holds an unfiltered one, or the filters leave fewer than `FEWEST` points.
pub fn filter_scan(scan: &Path, filters: &[Filter], out: &Path) -> Result<ScanReport> {
    if filters.is_empty() {
        return Err(Fault::usage("no filter was given").next("give one, for example islands:20,0.5"));
    }
    let (report, cloud, before) = (load_report(scan)?, cloud_of(scan)?, HeightMap::load(scan)?);
    let mut map = before.clone();
    let cells = filter_map(&mut map, filters)?;
    let stays = left(&before, &map);
    let points: Vec<CloudPoint> = cloud.into_iter().filter(|p| stays(&p.position)).collect();
    if points.len() < FEWEST {
        return Err(Fault::refused(format!("{} points are left, {FEWEST} are needed", points.len()))
            .cause("the filters take nearly everything away")
            .next("take the strictest of them back"));
    }
    if out.join("scan.json").exists() && load_report(out)?.filtered.is_none() {
        return Err(Fault::usage(format!("{}: holds a scan", out.display()))
            .cause("a filtered one would replace it")
            .next("give another folder"));
    }
    scan_folder::make(out)?;
    let _lock = Lock::take(out, "scan", "scan")?;
    let folder = scan_folder::together(out);
    folder.settle_locked()?;
    let part = folder.begin()?;
    let mut writer = CloudWriter::create_in(&part.join("cloud.ply"), frame(&report)?)?;
    writer.append(&points)?;
    let count = writer.finish()?;
    let (height_map, mut files) = products::of_map(&part, &part.join("cloud.ply"), count, &map)?;
    if report.imported.is_none() {
        let shots = crate::files::read_text(&scan.join(SHOTS_FILE))?;
        crate::files::write(&part.join(SHOTS_FILE), shots.as_bytes())?;
        files.extend([products::hash(&part, SHOTS_FILE)?]);
    }
    let name = scan.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let filtered =
        Filtered { scan: name, sha256: hash_file(&scan.join("scan.json"))?, filters: filters.to_vec(), cells };
    let mut sigmas: Vec<f32> = points.iter().map(|p| p.sigma_mm).collect();
    let middle = sigmas.len() / 2;
    let median = *sigmas.select_nth_unstable_by(middle, f32::total_cmp).1;
    let taken: usize = filtered.cells.iter().sum();
    let remark = format!("filtered: {taken} cells and {} points were removed", report.points - count);
    let report = ScanReport {
        created: jiff::Timestamp::now().to_string(),
        points: count,
        median_sigma_mm: Some(f64::from(median)),
        height_map: Some(height_map),
        files,
        remarks: report.remarks.iter().cloned().chain([remark]).collect(),
        filtered: Some(filtered),
        ..report
    };
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    crate::files::write(&part.join("scan.json"), text.as_bytes())?;
    folder.commit()?;
    Ok(report)
}

/// The frame's name for a cloud's header.
fn frame(report: &ScanReport) -> Result<&'static str> {
    let known = ["base", "axis", "flange", "map"].into_iter().find(|f| *f == report.frame);
    known.ok_or_else(|| Fault::input(format!("the scan's frame is {:?}", report.frame)).next("scan again"))
}
