//! In: a folder of a scan, unfinished or finished. Out: its working folder, its files' names, and the rule that it
//! holds one complete scan.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use crate::files::{Together, remove};
use crate::scan::SHOTS_FILE;
use std::io::Result as Io;
use std::path::Path;

/// All files of a scan folder, including those that are made from the scan later. The report comes first, because
/// without it the rest is not a scan.
const FILES: [&str; 21] = [
    "scan.json",
    "index.html",
    "cloud.ply",
    "cloud.pcd",
    SHOTS_FILE,
    "height.tif",
    "height.png",
    "height.json",
    "intensity.tif",
    "sigma.tif",
    "count.png",
    "height_picture.png",
    "intensity_picture.png",
    "sigma_picture.png",
    "coverage_picture.png",
    "overlays",
    "errors.json",
    "error_picture.png",
    // Earlier versions stored an interrupted scan here.
    "cloud.ply.part",
    FORMER_PROGRESS,
    "found.json",
];
pub(in crate::station) const CLOUD_FILE: &str = "cloud.ply";
/// Cloud and shots as measured, in the working folder, under the names of unfinished files: an interrupted scan
/// resumes with these.
pub(super) const MEASURED: [&str; 2] = ["cloud.ply.part", "shots.jsonl.part"];
/// Progress of a scan of an earlier version.
pub(super) const FORMER_PROGRESS: &str = "scan.progress.json";

/// Whether a scan folder itself uses a name.
pub fn of_a_scan(name: &str) -> bool {
    FILES.contains(&name) || ["scan.part", "scan.whole", "scan.moving", "scan.lock"].contains(&name)
}

/// Progress of an interrupted scan; in the working folder.
pub(in crate::station) const PROGRESS: &str = "progress.json";

/// The scan's files: written in `scan.part`, where an interrupted scan waits to be resumed, then moved up together.
pub(in crate::station) fn together(out: &Path) -> Together<'_> {
    Together::new(out, "scan", clear)
}

/// Removes the previous scan when the new one is complete.
fn clear(out: &Path, whole: &Path) -> Io<()> {
    // The previous scan's list names the parts found in it.
    #[derive(serde::Deserialize)]
    struct Found {
        name: String,
    }
    let found = crate::files::read_text(&out.join("found.json")).ok();
    let found: Vec<Found> = found.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default();
    for name in found.iter().map(|f| &f.name).filter(|n| !n.contains(['/', '\\'])) {
        remove(&out.join(format!("find_{name}.json")))?;
        remove(&out.join(format!("find_{name}.png")))?;
    }
    FILES.iter().try_for_each(|name| remove(&out.join(name)))?;
    MEASURED.iter().try_for_each(|name| remove(&whole.join(name)))?;
    remove(&whole.join(PROGRESS))
}

/// Completes what a stopped process has begun in a scan folder; every reader calls it first.
pub(in crate::station) fn settle(scan: &Path) -> Result<()> {
    together(scan).settle()
}

/// Makes the folder; refuses one that holds something else.
pub(in crate::station) fn make(out: &Path) -> Result<()> {
    for (file, what) in [("meta.json", "a recording"), ("station.toml", "a station")] {
        if out.join(file).exists() {
            return Err(Fault::usage(format!("{}: is {what}, it has a {file}", out.display()))
                .cause("the folder of the results was exchanged with another")
                .next("give the scan a separate folder"));
        }
    }
    if out.join("scan.part").is_symlink() {
        return Err(Fault::output(format!("{}: scan.part is a link", out.display()))
            .cause("it was not made by this program; its target is not touched")
            .next("take it away, or choose another folder"));
    }
    crate::files::make_folder(out)
}

/// Removes partial files of a killed process from the working folder of a scan that is resumed.
pub(in crate::station) fn sweep(part: &Path) -> Result<()> {
    crate::files::sweep(part)
        .and_then(|()| crate::files::sweep(&part.join("overlays")))
        .map_err(|e| Fault::write(part, e))
}
