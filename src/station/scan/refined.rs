//! In: the working folder of a scan whose last shot is done. Out: cloud and shots corrected for the scatter of the
//! reported poses and for the laser sheet's thickness at changes of brightness, as far as the surface shows both.
//! The measured files stay beside them until the scan is complete.
//! Frame and unit: the cloud's frame, mm.

use super::scan_folder::{CLOUD_FILE, MEASURED};
use super::spread::Spread;
use crate::fault::{Fault, Result};
use crate::files::moment;
use crate::scan::{CloudFile, CloudWriter, Extraction, Format, PathFound, Refining, SHOTS_FILE, SheetFound, Shots};
use std::path::Path;

/// Temporary name of the corrected cloud, which then takes the measured one's name.
const NEXT: &str = "refined.ply";

/// What the scan showed and the correction removed; `None` if nothing was found.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::station) struct Refined {
    pub places: Option<PathFound>,
    pub sheet: Option<SheetFound>,
    /// Median of the points' corrected standard deviations, mm; `None` if they were not changed.
    pub median_sigma_mm: Option<f64>,
}

/// `part`: the working folder; `frame`: the cloud's frame; `shots`: the shots at their reported poses.
pub(in crate::station) fn refine(
    part: &Path,
    frame: &'static str,
    shots: Shots,
    format: Format,
    settings: &Extraction,
) -> Result<Refined> {
    let cloud = CloudFile::open(&part.join(CLOUD_FILE))?;
    let refining = Refining::of(&cloud, shots, format, settings)?;
    let places = refining.places;
    if !refining.changes() {
        return Ok(Refined { places, ..Refined::default() });
    }
    let next = part.join(NEXT);
    let mut out = CloudWriter::create_in(&next, frame)?;
    let mut spread = Spread::default();
    let sheet = refining.apply(&cloud, &mut |points| {
        spread.add(points);
        out.append(points)
    })?;
    out.finish()?;
    rename(&part.join(CLOUD_FILE), &part.join(MEASURED[0]))?;
    rename(&next, &part.join(CLOUD_FILE))?;
    if let Some(path) = refining.path() {
        let places = Shots::rewritten(part, |shot, place| path.place(shot, place))?;
        rename(&part.join(SHOTS_FILE), &part.join(MEASURED[1]))?;
        crate::files::write(&part.join(SHOTS_FILE), places.as_bytes())?;
    }
    Ok(Refined { places, sheet, median_sigma_mm: spread.median_mm() })
}

fn rename(from: &Path, to: &Path) -> Result<()> {
    moment().and_then(|()| std::fs::rename(from, to)).map_err(|e| Fault::write(to, e))
}
