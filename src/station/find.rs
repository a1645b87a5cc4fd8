//! In: a scan folder, a recipe, the station that scanned. Out: the insertion's report and its picture;
//! a scan taken with another calibration than the station's is refused.
//! Frame and unit: base frame, mm.

use super::report::{cloud_of, load_report};
use crate::fault::{Fault, Result};
use crate::find::teach::{TeachOptions, teach};
use crate::find::{LocateOptions, Recipe, Report, locate, picture};
use crate::raster::RgbImage;
use crate::rig::Rig;
use crate::scan::{GridOptions, grid};
use std::path::Path;

/// Finds the recipe's part in a finished scan. Without `station` the budget lacks the calibrations.
pub fn find_part(
    scan: &Path,
    recipe: &Recipe,
    station: Option<&Path>,
    options: &LocateOptions,
) -> Result<(Report, RgbImage)> {
    let scanned = load_report(scan)?;
    let rig = station.map(Rig::load).transpose()?;
    if let (Some(rig), Some(station)) = (&rig, station) {
        rig.belong_together().map_err(|e| e.at(station.display()))?;
        let now = rig.fingerprint();
        if now != scanned.rig_fingerprint {
            return Err(Fault::refused(format!(
                "{}: was scanned with calibration {:.12}, {} now has {now:.12}",
                scan.display(),
                scanned.rig_fingerprint,
                station.display()
            ))
            .cause("the station was calibrated again after the scan, or this is another station's scan")
            .next("scan again with the present calibration, or give the station that scanned"));
        }
    }
    let cloud = cloud_of(scan)?;
    let mut report = locate(&cloud, recipe, rig.as_ref(), options).map_err(|e| e.at(scan.display()))?;
    report.notes.extend(scanned.remarks);
    let image = picture::draw(&report, &recipe.drawing());
    Ok((report, image))
}

/// Teaches a part from a finished scan: the recipe, its proof on that scan, and a picture of it.
pub fn teach_part(scan: &Path, options: &TeachOptions) -> Result<(Recipe, Report, RgbImage)> {
    let cloud = cloud_of(scan)?;
    let map = grid(&cloud, &GridOptions::default())?;
    let (recipe, proof) = teach(&cloud, &map, options).map_err(|e| e.at(scan.display()))?;
    let image = picture::draw(&proof, &recipe.drawing());
    Ok((recipe, proof, image))
}
