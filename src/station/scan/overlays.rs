//! In: shots and their profiles. Out: a few of them drawn with their peaks, evenly spread over the scan.
//! Frame and unit: pixels of the shot.

use crate::fault::Result;
use crate::raster::Image;
use crate::scan::{Profile, Shot};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Stores a picture only from its arrival until its profile is ready.
pub(in crate::station) struct Overlays {
    folder: PathBuf,
    every: usize,
    held: BTreeMap<u32, Image>,
}

impl Overlays {
    pub(in crate::station) fn new(out: &Path, count: usize, total: Option<usize>) -> Result<Overlays> {
        let folder = out.join("overlays");
        if count > 0 {
            crate::files::make_folder(&folder)?;
        }
        // For a pipe of unknown length every 100th shot is drawn.
        let every = if count == 0 { usize::MAX } else { total.map_or(100, |n| n.div_ceil(count)).max(1) };
        Ok(Overlays { folder, every, held: BTreeMap::new() })
    }
    pub(in crate::station) fn keep(&mut self, shot: &Shot) {
        if self.every != usize::MAX && shot.index as usize % self.every == self.every / 2 {
            self.held.insert(shot.index, shot.image.clone());
        }
    }
    pub(in crate::station) fn draw(&mut self, profile: &Profile) -> Result<()> {
        let Some(image) = self.held.remove(&profile.shot) else { return Ok(()) };
        let path = self.folder.join(format!("shot_{:05}.png", profile.shot));
        crate::scan::overlay::draw(&image, &profile.peaks).save_png(&path)
    }
}
