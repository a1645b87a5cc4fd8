//! In: a scan folder. Out: the scan's report, as in scan.json, and its points; both are checked to be as written.
//! Frame and unit: cloud in the frame that the report names, mm (docs/file-formats.md).

use super::scan_folder::settle;
use super::seen::Seen;
use crate::capture::{Account, Delay};
use crate::fault::{Fault, Result};
use crate::recording::Motion;
use crate::rig::{Rig, Volume, hash_file};
use crate::scan::{
    Along, CloudFile, CloudPoint, Extraction, Filter, Format, Merged, PathFound, SHOTS_FILE, SheetFound, Shots,
    parts_for, parts_for_profiles, read_cloud,
};
use crate::stages::peak::Stripe;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Report of a scan; the content of scan.json.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanReport {
    /// Version of this file: 2.
    pub format: u32,
    /// Name and version of the program that wrote it.
    pub program: String,
    /// Time at which the report was written, UTC, RFC 3339.
    pub created: String,
    /// Unit of all lengths: "mm".
    pub units: String,
    /// Frame of the cloud: base, axis, or the flange of a robot that carries the part.
    pub frame: String,
    /// What moved between the shots; reports of earlier versions without it mean the robot with the sensor.
    #[serde(default)]
    pub motion: Motion,
    /// Name of the recording, as the caller gave it.
    pub recording: String,
    /// [`crate::rig::Rig::fingerprint`] of the calibration used.
    pub rig_fingerprint: String,
    /// Adapter and driver, or this machine's processor and the reason for it.
    pub ran_on: String,
    /// Size and depth of the shots.
    pub image: Format,
    /// Number of shots done, including skipped ones.
    pub shots: usize,
    /// Number of points in the cloud.
    pub points: u64,
    /// Depths at which points were accepted; `None` if unlimited.
    pub working_volume: Option<Volume>,
    /// Number of peaks by rejection reason; accepted ones are listed too.
    pub peaks: BTreeMap<String, u64>,
    /// Shots without a single kept peak.
    pub dark_shots: Vec<u32>,
    /// The exposures that the shots were merged from, and the share of each; `None` for shots of one picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposures: Option<Merged>,
    /// Account of every picture that a camera sent; `None` without a camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Account>,
    /// Delay from a picture's last byte to its points in the cloud, for a running camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<Delay>,
    /// Skipped shots, with the reason.
    pub skipped: Vec<(String, String)>,
    /// Median of the points' standard deviations, mm; `None` without points.
    pub median_sigma_mm: Option<f64>,
    /// Width (px) and speckle of the stripe, measured in the first shots or as set.
    pub stripe: Option<Stripe>,
    /// Scatter of the poses that the robot or the axis reported, if a surface shows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub places: Option<PathFound>,
    /// Thickness of the laser sheet as seen at changes of brightness, if the cloud shows it; its effect is removed
    /// from the points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet: Option<SheetFound>,
    /// Number of hot pixels of the sensor; they were replaced by their neighbours.
    #[serde(default)]
    pub hot_pixels: usize,
    /// Levels of the pictures and the area of their light.
    pub seen: Seen,
    /// Duration from the first shot to the closed cloud, s.
    pub seconds: f64,
    /// Rate of this run: shots of an earlier run are not counted.
    pub shots_per_second: f64,
    /// Durations by activity.
    pub spent: Spent,
    /// Extraction settings as given.
    pub settings: Extraction,
    /// `None` if there were too few points for a map.
    pub height_map: Option<HeightMapFigures>,
    /// Warnings in the calibration files, and other remarks that a reader of the figures must know.
    pub remarks: Vec<String>,
    /// SHA-256 of the cloud and of the height map, by file name.
    pub files: BTreeMap<String, String>,
    /// Origin of points that no rig of this program measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<Imported>,
    /// Statements about the line-profile sensor whose profiles the shots are; `None` for shots that are pictures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profiles: Option<Profiled>,
    /// What was removed from an earlier scan by filters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filtered: Option<Filtered>,
}

/// The profiles that a scan was made of, and what their user stated about them.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profiled {
    /// Name of the file of poses, or of counts.
    pub moved: String,
    /// Way of the parts during one count, as stated, sensor frame, mm; `None` if a robot moved the sensor.
    pub travel_mm: Option<[f64; 3]>,
    /// SHA-256 of the files of profiles and of poses or counts, by name.
    pub inputs: BTreeMap<String, String>,
    /// Standard deviation of a point along z of the sensor, as stated, mm.
    pub sigma_mm: f64,
    /// The same along x of the sensor, as stated; `None` if it was not stated: it then counts as 0.
    pub sigma_x_mm: Option<f64>,
    /// z that means "not measured", as stated, mm.
    pub missing: Option<f64>,
    /// Whether z grows towards the sensor, as stated; it was negated.
    pub z_up: bool,
    /// mm of x to one step of `u`, if places that were not measured are not in the file; `None` if `u` is the index
    /// of a place in its profile.
    pub step_mm: Option<f64>,
}

/// The scan that was filtered, and the filters.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Filtered {
    /// Name of the scan's folder.
    pub scan: String,
    /// SHA-256 of its scan.json.
    pub sha256: String,
    /// The filters in the order in which they were applied.
    pub filters: Vec<Filter>,
    /// Number of cells that each filter removed.
    pub cells: Vec<usize>,
}

/// An imported file, and what its user stated about it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imported {
    /// Name of the file.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// The selected page of the file, counted from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page: Option<usize>,
    /// SHA-256 of the intensity picture that belongs to it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_sha256: Option<String>,
    /// Length of one level or one coordinate unit, mm, as stated.
    pub unit_mm: f64,
    /// Distance of columns and rows, as stated, mm.
    pub spacing_mm: Option<[f64; 2]>,
    /// Height of level 0, as stated, mm.
    pub offset_mm: f64,
    /// Level where nothing was measured, as stated.
    pub missing: Option<f64>,
    /// Whether y runs along the rows, as stated.
    pub rows_up: bool,
    /// Standard deviation of a height, stated or measured, mm.
    pub sigma_mm: f64,
}

/// Most bytes of a height map's file: 64 million cells and the header.
const MOST_OF_A_MAP: u64 = 257 << 20;

/// Version of the reports that this version writes; format 1 had no hashes.
pub(in crate::station) const FORMAT: u32 = 2;

/// Duration of a scan by activity of its main thread, s. Pictures are decoded and stages run on other threads
/// meanwhile, so only waiting for them counts.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spent {
    /// Opening the GPU and the recording, until the first shot could be submitted.
    pub start_s: f64,
    /// Until the first profile was ready, including compilation of the stages.
    pub first_profile_s: f64,
    /// Waiting for decoded pictures.
    pub pictures_s: f64,
    /// Submitting shots to the stages and waiting for them; judging points by their neighbours.
    pub stages_s: f64,
    /// Writing cloud, overlays and checkpoints.
    pub writing_s: f64,
    /// Making height map, pictures and PCD after the last shot.
    pub products_s: f64,
}

/// The height map's figures.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeightMapFigures {
    /// Columns: cells along the grid's x.
    pub width: u32,
    /// Rows: cells along the grid's y.
    pub height: u32,
    /// Edge of a cell, mm.
    pub cell_mm: f64,
    /// Share of the cells that hold a height.
    pub coverage: f64,
    /// Lower limit of the heights of the middle 98 % of the cells, mm above the grid's plane.
    pub z_low_mm: f64,
    /// Upper limit of those heights, mm above the grid's plane.
    pub z_high_mm: f64,
}

impl ScanReport {
    /// The parts of a station's rig that this scan depends on.
    pub fn parts_of(&self, rig: &Rig) -> Rig {
        match &self.profiles {
            None => parts_for(rig, &self.motion),
            Some(p) if p.travel_mm.is_none() => parts_for_profiles(rig),
            Some(_) => Rig::default(),
        }
    }

    /// Stands for the time at which a report was written, where it says none.
    pub(in crate::station) const NO_TIME: &str = "1970-01-01T00:00:00Z";

    /// The same without clock, machine and place: scans of equal recordings by equal calibrations have equal reports.
    pub(in crate::station) fn timeless(self, recording: &str) -> ScanReport {
        ScanReport {
            created: ScanReport::NO_TIME.into(),
            recording: recording.into(),
            ran_on: String::new(),
            delay: None,
            seconds: 0.0,
            shots_per_second: 0.0,
            spent: Spent::default(),
            ..self
        }
    }

    /// Refuses a scan without points, and reports what its pictures contain.
    pub fn has_points(&self) -> Result<()> {
        if self.points > 0 {
            return Ok(());
        }
        let rejected: Vec<String> = self.peaks.iter().map(|(fate, n)| format!("{n} peaks {fate}")).collect();
        let peaks = if rejected.is_empty() { "no peak was found".into() } else { rejected.join(", ") };
        let (cause, next) = self.seen.why();
        Err(Fault::refused(format!("no point in {} shots: {}; {peaks}", self.shots, self.seen.words()))
            .cause(cause)
            .next(next))
    }

    /// Refuses a scan folder whose files differ from those that the scan wrote.
    pub(in crate::station) fn check_files(&self, scan: &Path) -> Result<()> {
        self.files.par_iter().try_for_each(|(name, hash)| {
            let path = scan.join(name);
            if !["cloud.ply", SHOTS_FILE].contains(&name.as_str()) && crate::files::length(&path)? > MOST_OF_A_MAP {
                return Err(Fault::input(format!("{}: is longer than any map", path.display()))
                    .cause("another file of that name, or a damaged one")
                    .next("scan again"));
            }
            let is = hash_file(&path)?;
            if is == *hash {
                return Ok(());
            }
            Err(Fault::input(format!(
                "{}: has SHA-256 {is:.12}, its scan.json says {hash:.12}",
                scan.join(name).display()
            ))
            .cause("files of two scans in one folder, edited, or damaged")
            .next("scan again"))
        })
    }
}

/// Reads `scan.json` of a finished scan.
pub fn load_report(scan: &Path) -> Result<ScanReport> {
    settle(scan)?;
    let path = scan.join("scan.json");
    let text =
        crate::files::read_text(&path).map_err(|e| e.next("give the folder that sheetlight scan --out wrote"))?;
    let strange = |what: String| {
        Fault::input(format!("{}: {what}", path.display()))
            .cause("another version, or edited by hand")
            .next("scan again")
    };
    let report: ScanReport =
        serde_json::from_str(&text).map_err(|e| strange(format!("is not a scan's report: {e}")))?;
    if report.format != FORMAT {
        return Err(strange(format!("is of format {}, this version reads {FORMAT}", report.format)));
    }
    Ok(report)
}

/// The shots of a finished scan.
///
/// # Errors
/// As [`Shots::load`].
pub fn shots_of(scan: &Path) -> Result<Shots> {
    let report = load_report(scan)?;
    // The lines of an imported map run from column to column, whatever its sensor.
    if report.imported.is_some() {
        return Ok(Shots::unplaced(Along::U));
    }
    let shots = Shots::load(scan, &report.frame, &report.rig_fingerprint)?;
    Ok(shots.with_stripe(report.stripe.map(|s| s.width_px)))
}

/// The points of a finished scan where the middle of the laser sheet meets the camera's rays, checked like those of
/// [`cloud_of`]. Edge detection assumes a laser sheet of finite thickness, so it needs the points before
/// [`crate::scan::Thick`] moved them off the sheet.
pub fn lit_cloud_of(scan: &Path) -> Result<Vec<CloudPoint>> {
    let mut cloud = cloud_of(scan)?;
    if load_report(scan)?.sheet.is_some() {
        shots_of(scan)?.onto_sheet(&mut cloud);
    }
    Ok(cloud)
}

/// The points of a finished scan, checked to be those that the scan wrote.
pub fn cloud_of(scan: &Path) -> Result<Vec<CloudPoint>> {
    let (report, _) = opened(scan)?;
    report.check_files(scan)?;
    read_cloud(&scan.join("cloud.ply"))
}

/// A finished scan with its points on disk, completely checked against what the scan wrote: report, shots, cloud.
///
/// # Errors
/// As [`cloud_of`] and [`shots_of`]: a scan without points, files that are missing, cut off, or of another scan.
pub fn whole_scan(scan: &Path) -> Result<(ScanReport, Shots, CloudFile)> {
    let (report, cloud) = opened(scan)?;
    let shots = shots_of(scan)?;
    report.check_files(scan)?;
    Ok((report, shots, cloud))
}

/// A scan with points, and its cloud, of which only header and length are checked so far: a file that is not a
/// cloud is not worth hashing.
fn opened(scan: &Path) -> Result<(ScanReport, CloudFile)> {
    settle(scan)?;
    if !scan.join("cloud.ply").exists() {
        let recording = scan.join("meta.json").exists();
        let cause = if recording { "it is a recording, not a scan" } else { "another folder was given" };
        return Err(Fault::input(format!("{}: holds no cloud.ply", scan.display()))
            .cause(cause)
            .next("give the folder that sheetlight scan wrote with --out"));
    }
    let report = load_report(scan)?;
    report.has_points().map_err(|e| e.at(scan.display()))?;
    let cloud = CloudFile::open(&scan.join("cloud.ply"))?;
    Ok((report, cloud))
}
