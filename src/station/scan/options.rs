//! Options of a scan. Depths are mm.

use super::watch::Watch;
use crate::capture::Latency;
use crate::raster::Image;
use crate::recording::Motion;
use crate::rig::Volume;
use crate::scan::{Extraction, GridOptions, Where};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Options of a scan.
#[derive(Clone, Debug)]
pub struct ScanOptions {
    /// Folder for the results; it is created if it is missing.
    pub out: PathBuf,
    /// GPU, this machine's processor, or whichever of them is faster.
    pub place: Where,
    /// How the stripe is found.
    pub extraction: Extraction,
    /// How the cloud becomes a height map.
    pub grid: GridOptions,
    /// What moved between the shots.
    pub motion: Motion,
    /// Camera depths at which points are accepted; `None` for all ([`crate::station::volume::believed`]).
    pub volume: Option<Volume>,
    /// A picture with the laser off and the shots' exposure, subtracted from every shot.
    pub ambient: Option<Image>,
    /// Number of shots to draw with their kept and rejected peaks, evenly spread; 0 for none.
    pub overlays: usize,
    /// Skip shots that cannot be read instead of stopping; they are listed in scan.json.
    pub skip_bad: bool,
    /// Delay of pictures relative to poses, for pictures that were paired by clock.
    pub latency: Option<Latency>,
    /// Continue an interrupted scan of the same recording with the same rig and settings.
    pub resume: bool,
    /// Set from outside to end the scan: it stores the finished shots and reports how to resume.
    pub stop: Arc<AtomicBool>,
    /// An observer of the running scan.
    pub watch: Watch,
}
