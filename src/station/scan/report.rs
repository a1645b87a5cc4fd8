//! In: a scan folder. Out: what the scan came to, as scan.json holds it, and its points; both only as they were
//! written.
//! Frame and unit: cloud in the frame that the report names, mm (docs/file-formats.md).

use super::scan_folder::settle;
use super::seen::Seen;
use crate::capture::{Account, Delay};
use crate::fault::{Fault, Result};
use crate::recording::Motion;
use crate::rig::{Volume, hash_file};
use crate::scan::{
    Along, CloudFile, CloudPoint, Extraction, Filter, Format, PathFound, SHOTS_FILE, SheetFound, Shots, read_cloud,
};
use crate::stages::peak::Stripe;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// What a scan came to; scan.json holds it.
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
    /// Of the cloud: base, axis, or the flange of a robot that carries the part.
    pub frame: String,
    /// What moved between the shots; the robot with the sensor in reports of former versions.
    #[serde(default)]
    pub motion: Motion,
    /// What was scanned, as the caller named it.
    pub recording: String,
    /// [`crate::rig::Rig::fingerprint`] of the calibration used.
    pub rig_fingerprint: String,
    /// Adapter and driver, or this machine's processor and why.
    pub ran_on: String,
    /// Size and depth of the shots.
    pub image: Format,
    /// Number of shots done, those left out included.
    pub shots: usize,
    /// Number of points in the cloud.
    pub points: u64,
    /// Depths at which points were believed; none where nothing limits them.
    pub working_volume: Option<Volume>,
    /// Peaks by fate: kept, and rejected by reason.
    pub peaks: BTreeMap<String, u64>,
    /// Shots without a single kept peak.
    pub dark_shots: Vec<u32>,
    /// What became of every picture that the camera sent, where one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Account>,
    /// From a picture's last byte to its points in the cloud, of a running camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<Delay>,
    /// Shots left out, with the reason.
    pub skipped: Vec<(String, String)>,
    /// Median over the points of the standard deviation that each carries, mm; none without points.
    pub median_sigma_mm: Option<f64>,
    /// Width (px) and speckle of the stripe, measured in the first shots or as set.
    pub stripe: Option<Stripe>,
    /// How the places scatter that the robot or the axis reported, where a surface shows it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub places: Option<PathFound>,
    /// How thick the sheet is where brightness changes, where the cloud shows it; what that does is taken out of the
    /// points.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sheet: Option<SheetFound>,
    /// Pixels of the sensor that shine by themselves; their neighbours stood for them.
    #[serde(default)]
    pub hot_pixels: usize,
    /// Levels of the pictures and where their light lies.
    pub seen: Seen,
    /// From the first shot to the closed cloud.
    pub seconds: f64,
    /// Of this run: shots that an earlier run did are not counted.
    pub shots_per_second: f64,
    /// Where the time went.
    pub spent: Spent,
    /// Extraction settings as they were given.
    pub settings: Extraction,
    /// `None` where there were too few points for a map.
    pub height_map: Option<HeightMapFigures>,
    /// What the calibrations' own files say against them, and what else a reader of the figures must know.
    pub remarks: Vec<String>,
    /// SHA-256 of the cloud and of the height map, by file name.
    pub files: BTreeMap<String, String>,
    /// Where the points came from that no rig of this program measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<Imported>,
    /// What was taken away of a former scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filtered: Option<Filtered>,
}

/// Which scan was filtered, and how.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Filtered {
    /// Its folder's name.
    pub scan: String,
    /// SHA-256 of its scan.json.
    pub sha256: String,
    /// In the order in which they were applied.
    pub filters: Vec<Filter>,
    /// Cells that each took.
    pub cells: Vec<usize>,
}

/// What an imported file was, and what its user stated about it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Imported {
    /// Its name.
    pub file: String,
    /// SHA-256 of it.
    pub sha256: String,
    /// The page of it that was chosen, from 1 on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub page: Option<usize>,
    /// SHA-256 of the picture of the light that came with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub light_sha256: Option<String>,
    /// mm in one level or coordinate, as stated.
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

/// Bytes of a height map's file: 64 million cells and what stands before them.
const MOST_OF_A_MAP: u64 = 257 << 20;

/// Of the reports that this version writes; format 1 had no hashes.
pub(in crate::station) const FORMAT: u32 = 2;

/// Seconds of a scan by what its main thread did; pictures are decoded and stages run meanwhile on other threads, so
/// only what had to be waited for counts.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spent {
    /// Opening the GPU and the recording, until the first shot could be handed over.
    pub start_s: f64,
    /// Until the first profile was there; stages are compiled in it.
    pub first_profile_s: f64,
    /// Waiting for decoded pictures.
    pub pictures_s: f64,
    /// Handing shots to the stages and waiting for them; judging points by their neighbours.
    pub stages_s: f64,
    /// Cloud, overlays and checkpoints.
    pub writing_s: f64,
    /// Height map, pictures and PCD, after the last shot.
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
    /// Heights between which 98 % of the cells lie, mm above the grid's plane.
    pub z_low_mm: f64,
    /// The upper one of the two, mm above the grid's plane.
    pub z_high_mm: f64,
}

impl ScanReport {
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

    /// Refuses a scan without points, and says what its pictures hold.
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

    /// Refuses files of a scan folder that are not those that the scan wrote.
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
    // Its lines lie from column to column, whatever sensor they are from.
    if report.imported.is_some() {
        return Ok(Shots::unplaced(Along::U));
    }
    let shots = Shots::load(scan, &report.frame, &report.rig_fingerprint)?;
    Ok(shots.with_stripe(report.stripe.map(|s| s.width_px)))
}

/// The points of a finished scan where the sheet's middle meets the rays of their light, checked as those of
/// [`cloud_of`]: what finds a part's edges in them takes the sheet to be thick ([`crate::scan::Thick`] has moved them
/// off it).
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

/// A finished scan with its points on the disk, all of it checked to be what the scan wrote: report, shots, cloud.
///
/// # Errors
/// As [`cloud_of`] and [`shots_of`]: a scan without points, files that are missing, cut off, or of another scan.
pub fn whole_scan(scan: &Path) -> Result<(ScanReport, Shots, CloudFile)> {
    let (report, cloud) = opened(scan)?;
    let shots = shots_of(scan)?;
    report.check_files(scan)?;
    Ok((report, shots, cloud))
}

/// A scan that has points, and its cloud, whose header and length alone were looked at: what is not a cloud is not
/// worth hashing.
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
