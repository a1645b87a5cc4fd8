//! In: a scan folder, a recipe, the station that made the scan. Out: the insertion's report and its picture. A scan
//! that was made with another calibration than the station's is refused.
//! Frame and unit: the scan's frame, mm; plans of a verification scan: base.

use super::height_witness::height_witness;
use super::scan::held::HeldScan;
use super::scan::report::{ScanReport, lit_cloud_of, load_report, shots_of};
use crate::fault::{Fault, Result};
use crate::find::insert::locate::NOT_FOUND;
use crate::find::insert::picture;
use crate::find::insert::teach::{TeachOptions, teach};
use crate::find::{LocateOptions, LookPlan, OtherScale, Recipe, Report, agree, locate, other_scale, plan_look};
use crate::geometry::{AxisKind, Base, Flange, Rigid, Vec3};
use crate::raster::RgbImage;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::scan::{CloudPoint, GridOptions, Shots, grid};
use std::path::{Path, PathBuf};

/// The data of one part: finished scans of it, and pictures of the pointer's spot on it.
#[derive(Clone, Copy)]
pub struct Looked<'a> {
    /// Folders of finished scans, one or more; the first gives picture and map.
    pub scans: &'a [PathBuf],
    /// A recording of the pointer with the robot's poses.
    pub range: Option<&'a Recording>,
}

/// Finds the recipe's part in one or more finished scans of it and combines the results ([`agree`]). The pointer's
/// distances serve as an independent measure of the height. The picture is the first scan's. Errors: those of each
/// scan; with several scans, the first error.
pub fn find_part_in_all(
    looked: &Looked,
    recipe: &Recipe,
    station: Option<&Path>,
    options: &LocateOptions,
) -> Result<(Report, RgbImage)> {
    let Some((first, more)) = looked.scans.split_first() else {
        return Err(Fault::usage("no scan was named").next("name the folder that sheetlight scan --out wrote"));
    };
    if !more.is_empty() || looked.range.is_some() {
        comparable(looked.scans, station)?;
    }
    let (report, picture) = find_part(first, recipe, station, options)?;
    if more.is_empty() && looked.range.is_none() {
        return Ok((report, picture));
    }
    let mut reports = vec![report];
    for scan in more {
        reports.push(find_part(scan, recipe, station, &options.clone().again(&reports[0]))?.0);
    }
    let mut witness = None;
    if let (Some(recording), Some(station)) = (looked.range, station) {
        let at = |e: Fault| e.at(recording.folder.display());
        let (heights, said) = height_witness(recording, &Rig::load(station)?, recipe, &reports[0]).map_err(at)?;
        reports[0].notes.extend(said);
        witness = Some(heights);
    }
    Ok((agree(reports, witness.as_ref(), recipe, options.robot)?, picture))
}

/// Refuses scans whose comparison shows nothing: without the station the expected disagreement is unknown, and a
/// scan always agrees with itself.
fn comparable(scans: &[PathBuf], station: Option<&Path>) -> Result<()> {
    if station.is_none() {
        return Err(Fault::usage("several scans are compared, but no station is given")
            .cause("the expected disagreement follows from the covariances of the calibrations")
            .next("name the station that scanned with --station"));
    }
    different(scans)
}

/// Refuses the same scan under two names.
pub(super) fn different(scans: &[PathBuf]) -> Result<()> {
    let clouds: Vec<Option<String>> =
        scans.iter().map(|s| Ok(load_report(s)?.files.get("cloud.ply").cloned())).collect::<Result<_>>()?;
    for (i, (cloud, scan)) in clouds.iter().zip(scans).enumerate() {
        if let Some(same) = clouds[..i].iter().position(|c| c.is_some() && c == cloud) {
            return Err(Fault::usage(format!(
                "{} and {} are one scan twice: their clouds are the same",
                scans[same].display(),
                scan.display()
            ))
            .cause("a folder was named twice or copied")
            .next("scan the part from another side; sheetlight second-look plans it"));
        }
    }
    Ok(())
}

/// The robot's poses for a verification scan of a part, shot by shot, and what the two scans together can show.
pub struct SecondLook {
    /// The part as the first scan shows it.
    pub report: Report,
    /// The sensor's motion, and what the two scans can show.
    pub plan: LookPlan,
    /// base_from_flange for each shot of the first scan that saw the part's surroundings.
    pub flanges: Vec<Rigid<Base, Flange>>,
}

/// Plans a verification scan ([`plan_look`]) from a finished scan and the poses of its recording.
pub fn second_look(
    scan: &Path,
    poses: &[Rigid<Base, Flange>],
    recipe: &Recipe,
    station: &Path,
    turn_deg: f64,
    tilt_deg: f64,
) -> Result<SecondLook> {
    let scanned = load_report(scan)?;
    let motion = &scanned.motion;
    if motion.frame() != "base" {
        return Err(Fault::usage(format!("{}: was scanned in the {} frame", scan.display(), motion.frame()))
            .cause("no robot moved the sensor, so no second scan can be planned")
            .next("scan the part again in another position on the axis"));
    }
    let (report, _) = find_part(scan, recipe, Some(station), &LocateOptions::default())?;
    let plan = plan_look(&report, &scanned.parts_of(&Rig::load(station)?), turn_deg, tilt_deg)?;
    let flanges = poses.iter().map(|p| plan.base_from_base * *p).collect();
    Ok(SecondLook { report, plan, flanges })
}

/// Finds the recipe's part in a finished scan. Without `station` the error budget lacks the calibrations.
pub fn find_part(
    scan: &Path,
    recipe: &Recipe,
    station: Option<&Path>,
    options: &LocateOptions,
) -> Result<(Report, RgbImage)> {
    let scanned = load_report(scan)?;
    let rig = station.map(|station| rig_that_scanned(station, scan, &scanned)).transpose()?;
    let (cloud, shots) = (lit_cloud_of(scan)?, shots_of(scan)?);
    let report = located(&cloud, &shots, &scanned, recipe, rig.as_ref(), options).map_err(|e| e.at(scan.display()))?;
    let image = picture::draw(&report, &recipe.drawing());
    Ok((report, image))
}

/// Shots farther apart than this many cells of the recipe leave too few of its edges. Of the three parts of the
/// built-in scene, simulated with seed 3, all are found up to 1.6 cells, one at 1.6 to 2.0, none at 2.2 to 2.6.
const COARSE: f64 = 1.6;

/// Names the step between shots as the cause, if it is coarse for the recipe.
fn too_coarse(fault: Fault, scan: &Path, recipe: &Recipe) -> Fault {
    let Ok(shots) = shots_of(scan) else { return fault };
    let places: Vec<Vec3> = shots.places().map(|(_, place)| place.translation).collect();
    let mut steps: Vec<f64> = places.windows(2).map(|p| (p[1] - p[0]).norm()).collect();
    steps.sort_by(f64::total_cmp);
    match steps.get(steps.len() / 2) {
        Some(step) if *step > COARSE * recipe.cell_mm => fault
            .cause(format!(
                "the scan is too coarse: its shots are {step:.2} mm apart, the recipe's cells are {} mm",
                recipe.cell_mm
            ))
            .next(format!("scan with steps of {} mm or less", recipe.cell_mm)),
        _ => fault,
    }
}

/// If the part was not found, adds the scale with which it would be, or that the scan is too coarse. It searches some
/// forty times, so it is for people who wait for one answer, not for a job.
pub fn with_scale(fault: Fault, scans: &[PathBuf], recipe: &Recipe, options: &LocateOptions) -> Fault {
    let of = |scan: &&PathBuf| fault.what.starts_with(&scan.display().to_string());
    let Some(scan) = scans.iter().find(of).filter(|_| fault.what.contains(NOT_FOUND)) else { return fault };
    let other = || other_scale(&lit_cloud_of(scan)?, &shots_of(scan)?, recipe, options);
    let Ok(Some(OtherScale { factor, score })) = other() else { return too_coarse(fault, scan, recipe) };
    fault
        .cause(format!(
            "the scan has a wrong scale: with all distances from the camera times {factor:.2} the part scores \
             {score:.2}"
        ))
        .next("measure the laser plane's calibration boards, correct their stated size, calibrate and scan again")
}

/// Finds the recipe's part in a scan in memory; `rig` is the one that made the scan. Without it the error budget
/// lacks the calibrations.
pub fn find_part_held(
    held: &HeldScan,
    recipe: &Recipe,
    rig: Option<&Rig>,
    options: &LocateOptions,
) -> Result<(Report, RgbImage)> {
    let scanned = &held.report;
    scanned.has_points()?;
    let rig = rig.map(|rig| scanned.parts_of(rig));
    if let Some(rig) = &rig {
        rig.belong_together()?;
        fits(rig, Path::new("the scan"), scanned)?;
    }
    let report = located(&held.lit(), &held.shots, scanned, recipe, rig.as_ref(), options)?;
    let image = picture::draw(&report, &recipe.drawing());
    Ok((report, image))
}

/// Finds the part in a scan's points, which lie where the middle of the laser sheet meets the camera's rays.
fn located(
    cloud: &[CloudPoint],
    shots: &Shots,
    scanned: &ScanReport,
    recipe: &Recipe,
    rig: Option<&Rig>,
    options: &LocateOptions,
) -> Result<Report> {
    // A turntable turns the part in front of the camera: heights are measured over the table, along z of the axis
    // frame.
    let over_table = (scanned.motion.axis() == Some(AxisKind::Turntable)).then(Vec3::z);
    let options = &LocateOptions { up: options.up.or(over_table), ..options.clone() };
    let mut report = locate(cloud, shots, recipe, rig, options)?;
    if scanned.frame != report.frame {
        report.notes.push(format!(
            "all poses are in the {} frame of the scan, not in a robot's base (docs/conventions.md)",
            scanned.frame
        ));
        report.frame = scanned.frame.clone();
    }
    report.notes.extend_from_slice(&scanned.remarks);
    Ok(report)
}

/// The parts of a station's rig that a finished scan depends on; `scanned` is the report of the folder `scan`.
///
/// # Errors
/// Calibrations that do not belong together, or differ from those with which the scan was made.
pub fn rig_that_scanned(station: &Path, scan: &Path, scanned: &ScanReport) -> Result<Rig> {
    let rig = scanned.parts_of(&Rig::load(station)?);
    rig.belong_together().map_err(|e| e.at(station.display()))?;
    fits(&rig, scan, scanned)?;
    Ok(rig)
}

/// Refuses a scan that was made with other calibrations than the station's present ones.
pub(super) fn fits(rig: &Rig, scan: &Path, scanned: &ScanReport) -> Result<()> {
    let now = rig.fingerprint();
    if now == scanned.rig_fingerprint {
        return Ok(());
    }
    Err(Fault::refused(format!(
        "{}: was scanned with calibration {:.12}, the station now has {now:.12}",
        scan.display(),
        scanned.rig_fingerprint,
    ))
    .cause("the station was calibrated again after the scan, or this is another station's scan")
    .next("scan again with the present calibration, or give the station that scanned"))
}

/// Teaches a part from a finished scan: the recipe, its test on that scan, and a picture of it.
pub fn teach_part(scan: &Path, options: &TeachOptions) -> Result<(Recipe, Report, RgbImage)> {
    taught(&lit_cloud_of(scan)?, &shots_of(scan)?, options).map_err(|e| e.at(scan.display()))
}

/// The same from a scan in memory.
pub fn teach_held(held: &HeldScan, options: &TeachOptions) -> Result<(Recipe, Report, RgbImage)> {
    held.report.has_points()?;
    taught(&held.lit(), &held.shots, options)
}

fn taught(cloud: &[CloudPoint], shots: &Shots, options: &TeachOptions) -> Result<(Recipe, Report, RgbImage)> {
    let map = grid(cloud, &GridOptions::default())?;
    let (recipe, proof) = teach(cloud, shots, &map, options)?;
    let image = picture::draw(&proof, &recipe.drawing());
    Ok((recipe, proof, image))
}
