//! In: the working folder of a scan whose last shot is done. Out: cloud and shots without what the reported places
//! scatter by, and without what the sheet's thickness does where brightness changes, as far as the surface shows
//! both; what was measured waits beside them until the scan has its names.
//! Frame and unit: the cloud's frame, mm.

use super::scan_folder::{CLOUD_FILE, MEASURED};
use super::spread::Spread;
use crate::fault::{Fault, Result};
use crate::files::moment;
use crate::scan::{CloudFile, CloudWriter, Extraction, Format, PathFound, Refining, SHOTS_FILE, SheetFound, Shots};
use std::path::Path;

/// Where the cloud is made that takes the measured one's name.
const NEXT: &str = "refined.ply";

/// What was told of a scan, and taken out; `None` where nothing is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Refined {
    pub places: Option<PathFound>,
    pub sheet: Option<SheetFound>,
    /// Median of the points' standard deviations where they have others than they were measured with, mm.
    pub median_sigma_mm: Option<f64>,
}

/// `part`: the working folder; `frame`: the cloud's; `shots`: where they were reported.
pub(super) fn refine(
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
