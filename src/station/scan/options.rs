//! Says how a scan is run. Depths are mm.

use super::watch::Watch;
use crate::capture::Latency;
use crate::raster::Image;
use crate::recording::Motion;
use crate::rig::Volume;
use crate::scan::{Extraction, GridOptions, Where};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// How a scan is run.
#[derive(Clone, Debug)]
pub struct ScanOptions {
    /// Folder for the results; made where it is missing.
    pub out: PathBuf,
    /// GPU, this machine's processor, or whichever of them is faster.
    pub place: Where,
    /// How the stripe is found.
    pub extraction: Extraction,
    /// How the cloud becomes a height map.
    pub grid: GridOptions,
    /// What moved between the shots.
    pub motion: Motion,
    /// Camera depths at which points are believed; `None` for all ([`crate::station::volume::believed`]).
    pub volume: Option<Volume>,
    /// A picture with the laser off and the shots' exposure, subtracted from every shot.
    pub ambient: Option<Image>,
    /// Shots to draw with their kept and rejected peaks, evenly spread; 0 for none.
    pub overlays: usize,
    /// Leave out shots that cannot be read instead of stopping; they are listed in scan.json.
    pub skip_bad: bool,
    /// By how much pictures are late against poses, of those that were paired by clock.
    pub latency: Option<Latency>,
    /// Continue an interrupted scan of the same recording with the same rig and settings.
    pub resume: bool,
    /// Set by somebody who wants the scan to end: it keeps what is done and says how to go on.
    pub stop: Arc<AtomicBool>,
    /// Who looks on while it runs.
    pub watch: Watch,
}
