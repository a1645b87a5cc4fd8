//! Makes a finished scan's report, whether its points are in memory or on disk. Lengths are mm.

use super::options::ScanOptions;
use super::progress::{Calibrated, Checkpoint};
use super::refined::Refined;
use super::report::{FORMAT, HeightMapFigures, ScanReport, Spent};
use super::seen::Seen;
use crate::capture::Delay;
use crate::fault::Result;
use crate::rig::{Rig, Volume};
use crate::scan::{Carrier, Processor, Scanner, Source, needs};
use std::collections::BTreeMap;

/// Data of a scan after its last shot.
pub(super) struct Done<'a> {
    pub label: &'a str,
    pub rig: &'a Rig,
    pub options: &'a ScanOptions,
    pub source: &'a dyn Source,
    pub scanner: &'a Scanner,
    pub state: Checkpoint,
    pub calibrated: Option<Calibrated>,
    pub seen: Seen,
    pub delay: Option<Delay>,
    /// Duration from the first shot to the refined cloud.
    pub seconds: f64,
    pub spent: Spent,
    /// Number of shots that this run did.
    pub shots_of_this_run: usize,
    /// A remark if a stream was ended early.
    pub stopped: Option<String>,
    pub points: u64,
    pub refined: Refined,
}

impl Done<'_> {
    /// `files`: hashes of the written files, by name.
    pub fn report(self, height_map: Option<HeightMapFigures>, files: BTreeMap<String, String>) -> ScanReport {
        let Done { options, scanner, mut state, .. } = self;
        if state.cut > 0 {
            state.peaks.insert("beyond the list: more than a twentieth of the pictures lit".into(), state.cut);
        }
        let levels: Vec<String> = self.seen.remarks().collect();
        ScanReport {
            format: FORMAT,
            program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
            created: jiff::Timestamp::now().to_string(),
            units: "mm".into(),
            frame: options.motion.frame().into(),
            motion: options.motion.clone(),
            recording: self.label.into(),
            rig_fingerprint: self.rig.fingerprint(),
            working_volume: options.volume.clone(),
            ran_on: scanner.ran_on(),
            image: self.source.format(),
            shots: state.shots,
            points: self.points,
            median_sigma_mm: self.refined.median_sigma_mm.or(state.sigma.median_mm()),
            stripe: scanner.stripe(),
            places: self.refined.places,
            sheet: self.refined.sheet,
            hot_pixels: scanner.hot().count(),
            seen: self.seen,
            peaks: state.peaks,
            dark_shots: state.dark,
            exposures: self.source.merged(),
            camera: self.source.account(),
            delay: self.delay,
            skipped: state.skipped,
            seconds: self.seconds,
            shots_per_second: self.shots_of_this_run as f64 / self.seconds.max(1e-9),
            spent: self.spent,
            settings: options.extraction.clone(),
            height_map,
            remarks: self
                .rig
                .remarks()
                .into_iter()
                .chain(self.source.remarks())
                .chain(scanner.remark())
                .chain(levels)
                .chain(state.repeats.remarks())
                .chain(self.calibrated.and_then(|c| state.depths.remark(&c)))
                .chain(self.stopped)
                .collect(),
            files,
            imported: None,
            profiles: None,
            filtered: None,
        }
    }
}

/// The scanner for such pictures, and the collector of their levels.
pub(in crate::station) fn scanner_for(
    rig: &Rig,
    source: &dyn Source,
    options: &ScanOptions,
    processor: Processor,
) -> Result<(Scanner, Seen)> {
    let (volume, ambient) = (options.volume.as_ref(), options.ambient.clone());
    rig.need_all(&needs(&options.motion))?;
    let carrier = Carrier::new(rig, &options.motion)?;
    let (pictures, mut extraction) = (source.pictures(), options.extraction.clone());
    extraction.peak.levels = source.levels();
    let scanner = Scanner::new(rig, carrier, pictures, &extraction, volume, ambient, processor)?;
    let camera = rig.need_camera()?.for_pictures(pictures.size(), pictures.readout.as_ref())?;
    let seen = Seen::new(&camera, &rig.need_laser_plane()?.value, Volume::depths(volume));
    Ok((scanner, seen))
}
