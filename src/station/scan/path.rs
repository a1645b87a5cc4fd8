//! In: the working folder of a scan whose last shot is done. Out: cloud and shots without what the reported places scatter by, where the
//! surface shows that to be the report's; what was measured waits beside them until the scan has its names.
//! Frame and unit: the cloud's frame, mm.

use super::scan_folder::{CLOUD_FILE, MEASURED};
use crate::fault::{Fault, Result};
use crate::files::moment;
use crate::recording::Motion;
use crate::scan::{
    Along, CloudFile, CloudPoint, CloudWriter, Format, PathFound, PointSource, SHOTS_FILE, Shots, Straight, straight,
};
use std::path::Path;

/// Where the cloud is made that takes the measured one's name.
const NEXT: &str = "straight.ply";

/// `part`: the working folder; `rig`: the fingerprint of the scan's. `None` where nothing is told of the places.
pub(super) fn follow(part: &Path, motion: &Motion, rig: &str, format: Format) -> Result<Option<PathFound>> {
    let shots = Shots::load(part, motion.frame(), rig)?;
    let cloud = CloudFile::open(&part.join(CLOUD_FILE))?;
    let pixels = if shots.along == Along::U { format.width } else { format.height };
    let Some(path) = straight(&cloud, &shots, pixels)? else { return Ok(None) };
    if path.found.taken_out {
        let next = part.join(NEXT);
        moved(&cloud, &path, CloudWriter::create_in(&next, motion.frame())?)?;
        let places = Shots::rewritten(part, |shot, place| path.place(shot, place))?;
        rename(&part.join(CLOUD_FILE), &part.join(MEASURED[0]))?;
        rename(&next, &part.join(CLOUD_FILE))?;
        rename(&part.join(SHOTS_FILE), &part.join(MEASURED[1]))?;
        crate::files::write(&part.join(SHOTS_FILE), places.as_bytes())?;
    }
    Ok(Some(path.found))
}

fn moved(cloud: &CloudFile, path: &Straight, mut out: CloudWriter) -> Result<()> {
    let mut points: Vec<CloudPoint> = Vec::new();
    let mut written = Ok(());
    cloud.for_each_chunk(&mut |chunk| {
        points.clear();
        points.extend_from_slice(chunk);
        path.apply(&mut points);
        if written.is_ok() {
            written = out.append(&points);
        }
    })?;
    written?;
    out.finish().map(|_| ())
}

fn rename(from: &Path, to: &Path) -> Result<()> {
    moment().and_then(|()| std::fs::rename(from, to)).map_err(|e| Fault::write(to, e))
}
