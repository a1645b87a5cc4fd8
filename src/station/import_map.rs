//! In: a height map or cloud of another sensor, and what its user states about it. Out: a scan folder that `find`
//! accepts, with the origin of the data.
//! Frame and unit: the file's own frame, which the folder calls map; mm.

use super::scan::products;
use super::scan::report::{FORMAT, Imported, ScanReport, Spent};
use super::scan::scan_folder;
use super::scan::seen::Seen;
use crate::fault::{Fault, Result};
use crate::files::Lock;
use crate::geometry::Vec3;
use crate::recording::Motion;
use crate::rig::hash_text;
use crate::scan::{
    CloudPoint, CloudWriter, Extraction, FEW_CELLS, Format, GridOptions, Lines, Stated, lines, read_foreign_page,
};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

/// Frame of imported points.
const FRAME: &str = "map";
/// Replaces the fingerprint of a rig, which is unknown here.
const NO_RIG: &str = "imported";
/// Longest file, bytes: 64 million points of 36 bytes.
const MOST_BYTES: u64 = 36 << 26;

/// Makes a scan folder from a file, or from its `page` (counted from 1); `light` is the intensity picture that
/// belongs to a height picture.
///
/// # Errors
/// A file cannot be read, a required statement is missing, or the folder holds a scan of a rig.
pub fn import_map(
    file: &Path,
    page: Option<usize>,
    light: Option<&Path>,
    stated: &Stated,
    out: &Path,
) -> Result<ScanReport> {
    let begun = Instant::now();
    if out.join("scan.json").exists() && super::load_report(out)?.imported.is_none() {
        return Err(Fault::usage(format!("{}: holds a scan", out.display()))
            .cause("an imported map would replace it")
            .next("give another --out"));
    }
    let read = |path: &Path, page: Option<usize>| {
        let bytes = crate::files::read(path, MOST_BYTES)?;
        Ok((read_foreign_page(&bytes, page).map_err(|e: Fault| e.at(path.display()))?, hash_text(&bytes)))
    };
    let (raw, sha256) = read(file, page)?;
    let light = light.map(|light| read(light, None)).transpose()?;
    let made = lines(&raw, light.as_ref().map(|l| &l.0), stated).map_err(|e| e.at(file.display()))?;
    scan_folder::make(out)?;
    let _lock = Lock::take(out, "scan", "scan")?;
    let folder = scan_folder::together(out);
    folder.settle_locked()?;
    let part = folder.begin()?;
    let cloud_path = part.join("cloud.ply");
    let mut cloud = CloudWriter::create_in(&cloud_path, FRAME)?;
    cloud.append(&made.points)?;
    let points = cloud.finish()?;
    let grid = GridOptions { cell: cell_of(&made, stated), ..GridOptions::default() };
    let (height_map, files) = products::write(&part, &cloud_path, points, &grid, Vec3::z(), None)?;
    let imported = Imported {
        file: file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        sha256,
        page,
        light_sha256: light.map(|l| l.1),
        unit_mm: stated.unit_mm.unwrap_or(f64::NAN),
        spacing_mm: stated.spacing_mm,
        offset_mm: stated.offset_mm,
        missing: stated.missing.flatten(),
        rows_up: stated.rows_up,
        sigma_mm: made.sigma_mm,
    };
    let report =
        ScanReport { height_map, files, seconds: begun.elapsed().as_secs_f64(), ..report(made, points, imported) };
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    crate::files::write(&part.join("scan.json"), text.as_bytes())?;
    folder.commit()?;
    Ok(report)
}

/// The cell that holds one point of the file's raster, or as few as the map's size allows; `None`: the points lie on no
/// raster. Of pixels that are not square the longer side counts: a cell that is narrower would often be empty.
fn cell_of(lines: &Lines, stated: &Stated) -> Option<f64> {
    let [along, across] = stated.spacing_mm.or_else(|| spacing_of(&lines.points))?;
    let places = lines.size[0] as f64 * lines.size[1] as f64;
    Some(along.max(across) * (places / FEW_CELLS as f64).sqrt().ceil())
}

/// Distance of neighbours in a line, and of lines, mm, if nearly all are as far apart.
fn spacing_of(points: &[CloudPoint]) -> Option<[f64; 2]> {
    let apart = |a: &CloudPoint, b: &CloudPoint| {
        f64::from((a.position[0] - b.position[0]).hypot(a.position[1] - b.position[1]))
    };
    let lines: Vec<&[CloudPoint]> = points.chunk_by(|a, b| a.shot == b.shot).collect();
    let in_line = |line: &&[CloudPoint]| -> Vec<f64> {
        line.windows(2).filter(|w| w[1].u == w[0].u + 1.0).map(|w| apart(&w[0], &w[1])).collect()
    };
    let between = |pair: &[&[CloudPoint]]| -> Vec<f64> {
        if pair[1][0].shot != pair[0][0].shot + 1 {
            return Vec::new();
        }
        let beside = |a: &CloudPoint| {
            let at = pair[1].binary_search_by(|b| b.u.total_cmp(&a.u)).ok()?;
            Some(apart(a, &pair[1][at]))
        };
        pair[0].iter().filter_map(beside).collect()
    };
    Some([regular(lines.iter().flat_map(in_line).collect())?, regular(lines.windows(2).flat_map(between).collect())?])
}

/// The median of distances, with four digits, if nine of ten are within a hundredth of it.
fn regular(mut apart: Vec<f64>) -> Option<f64> {
    if apart.is_empty() {
        return None;
    }
    let middle = apart.len() / 2;
    let median = *apart.select_nth_unstable_by(middle, f64::total_cmp).1;
    let like = apart.iter().filter(|d| (*d / median - 1.0).abs() < 0.01).count();
    let digit = 10f64.powi(median.log10().floor() as i32 - 3);
    (median > 0.0 && 10 * like >= 9 * apart.len()).then(|| (median / digit).round() * digit)
}

/// The report of an imported scan: what was not measured is empty.
fn report(made: Lines, points: u64, imported: Imported) -> ScanReport {
    ScanReport {
        format: FORMAT,
        program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
        created: jiff::Timestamp::now().to_string(),
        units: "mm".into(),
        frame: FRAME.into(),
        motion: Motion::default(),
        recording: imported.file.clone(),
        rig_fingerprint: NO_RIG.into(),
        working_volume: None,
        ran_on: "nothing: imported".into(),
        image: Format { width: made.size[1] as u32, height: made.size[0] as u32, bits: 16 },
        shots: made.size[0],
        points,
        median_sigma_mm: Some(made.sigma_mm),
        stripe: None,
        places: None,
        sheet: None,
        hot_pixels: 0,
        seen: Seen::default(),
        peaks: BTreeMap::new(),
        dark_shots: vec![],
        exposures: None,
        camera: None,
        delay: None,
        skipped: vec![],
        seconds: 0.0,
        shots_per_second: 0.0,
        spent: Spent::default(),
        settings: Extraction::default(),
        height_map: None,
        remarks: made.notes.into_iter().chain([NO_BUDGET.to_owned()]).collect(),
        files: BTreeMap::new(),
        imported: Some(imported),
        profiles: None,
        filtered: None,
    }
}

const NO_BUDGET: &str = "imported: the error budget omits the other sensor's calibration; the map's frame has no known \
                         pose in a robot's base";
