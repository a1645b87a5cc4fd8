//! In: a folder that a scan writes into or was written into. Out: its working folder, its files' names, and the rule
//! that it holds one scan, whole.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use crate::files::{Together, remove};
use crate::scan::SHOTS_FILE;
use std::io::Result as Io;
use std::path::Path;

/// Everything that a scan leaves in its folder, and what is made of it there; the report first, because without it
/// the rest is no scan.
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
    // Where former versions kept an interrupted scan.
    "cloud.ply.part",
    FORMER_PROGRESS,
    "found.json",
];
pub(super) const CLOUD_FILE: &str = "cloud.ply";
/// Cloud and shots as measured, in the working folder, under the names of those that are not done: an interrupted
/// scan goes on with these.
pub(super) const MEASURED: [&str; 2] = ["cloud.ply.part", "shots.jsonl.part"];
/// How far a scan of a former version got.
pub(super) const FORMER_PROGRESS: &str = "scan.progress.json";

/// Whether a name is one that a scan folder uses itself.
pub fn of_a_scan(name: &str) -> bool {
    FILES.contains(&name) || ["scan.part", "scan.whole", "scan.moving", "scan.lock"].contains(&name)
}

/// How far an interrupted scan got; in the working folder.
pub(in crate::station) const PROGRESS: &str = "progress.json";

/// The scan's files: made in `scan.part`, where an interrupted scan waits to be resumed, then moved up together.
pub(in crate::station) fn together(out: &Path) -> Together<'_> {
    Together::new(out, "scan", clear)
}

/// Takes the former scan away when the new one is whole.
fn clear(out: &Path, whole: &Path) -> Io<()> {
    // Parts found in the former scan are named in its list.
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

/// Ends what a stopped process has begun in a scan folder; whoever reads one asks for it first.
pub(in crate::station) fn settle(scan: &Path) -> Result<()> {
    together(scan).settle()
}

/// Makes the folder, and refuses one that is something else.
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

/// What a killed process left half-written in the working folder of a scan that is resumed.
pub(in crate::station) fn sweep(part: &Path) -> Result<()> {
    crate::files::sweep(part)
        .and_then(|()| crate::files::sweep(&part.join("overlays")))
        .map_err(|e| Fault::write(part, e))
}
