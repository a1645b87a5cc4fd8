//! In: a source of shots, a calibrated rig, an output folder. Out: the scan folder — cloud, height
//! map, overlays, figures — written so that a crash loses nothing that was done.
//! Frame and unit: cloud in the base frame, height map in its grid frame; mm (docs/file-formats.md).

use super::progress::{Checkpoint, Lock};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::rig::{Rig, Volume};
use crate::scan::{
    BadShot, CloudPoint, CloudWriter, Extraction, GridOptions, Processor, Profile, Scanner, Source, Where,
};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How a scan is run.
#[derive(Clone, Debug)]
pub struct ScanOptions {
    /// Folder for the results; made where it is missing.
    pub out: PathBuf,
    /// GPU, this machine's processor, or whichever of them is faster.
    pub place: Where,
    pub extraction: Extraction,
    pub grid: GridOptions,
    /// Camera depths at which points are believed; `None` for all ([`super::volume::believed`]).
    pub volume: Option<Volume>,
    /// A picture with the laser off and the shots' exposure, subtracted from every shot.
    pub ambient: Option<Image>,
    /// Shots to draw with their kept and rejected peaks, evenly spread; 0 for none.
    pub overlays: usize,
    /// Leave out shots that cannot be read instead of stopping; they are listed in scan.json.
    pub skip_bad: bool,
    /// Continue an interrupted scan of the same recording with the same rig and settings.
    pub resume: bool,
}

/// What a scan came to; scan.json holds it.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct ScanReport {
    pub format: u32,
    pub program: String,
    pub created: String,
    pub units: String,
    pub frame: String,
    pub recording: String,
    /// [`Rig::fingerprint`] of the calibration used.
    pub rig_fingerprint: String,
    /// Adapter and driver, or this machine's processor and why.
    pub ran_on: String,
    pub image: crate::scan::Format,
    pub shots: usize,
    pub points: u64,
    /// Depths at which points were believed; none where nothing limits them.
    #[serde(default)]
    pub working_volume: Option<Volume>,
    /// Peaks by fate: kept, and rejected by reason.
    pub peaks: BTreeMap<String, u64>,
    /// Shots without a single kept peak.
    pub dark_shots: Vec<u32>,
    /// Shots left out, with the reason.
    pub skipped: Vec<(String, String)>,
    /// Median over the points of the standard deviation that each carries, mm.
    pub median_sigma_mm: f64,
    /// Width (px) and speckle of the stripe, measured in the first shots or as set.
    pub stripe: Option<crate::stages::peak::Stripe>,
    /// From the first shot to the closed cloud.
    pub seconds: f64,
    pub shots_per_second: f64,
    /// Where the time went.
    #[serde(default)]
    pub spent: Spent,
    pub settings: Extraction,
    pub height_map: Option<HeightMapFigures>,
    /// What the calibrations' own files say against them, and what else a reader of the figures must know.
    #[serde(default)]
    pub remarks: Vec<String>,
}

/// Seconds of a scan by what its main thread did; pictures are decoded and stages run meanwhile on other threads, so
/// only what had to be waited for counts.
#[derive(Clone, Copy, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Spent {
    /// Opening the GPU and the recording, until the first shot could be handed over.
    pub start_s: f64,
    /// Until the first profile was there; stages are compiled in it.
    pub first_profile_s: f64,
    /// Waiting for decoded pictures.
    pub pictures_s: f64,
    /// Handing shots to the stages and waiting for them; judging points by their neighbours.
    pub stages_s: f64,
    /// Cloud, overlays and checkpoints.
    pub writing_s: f64,
    /// Height map, pictures and PCD, after the last shot.
    pub products_s: f64,
}

/// The height map's figures.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct HeightMapFigures {
    pub width: u32,
    pub height: u32,
    pub cell_mm: f64,
    /// Share of the cells that hold a height.
    pub coverage: f64,
    /// Heights between which 98 % of the cells lie, mm above the grid's plane.
    pub z_low_mm: f64,
    pub z_high_mm: f64,
}

/// Shots between two checkpoints: what a crash can cost beside those under way.
const CHECKPOINT_SHOTS: usize = 64;

/// [`scan_on`] where the options say; the device is opened while the first pictures are decoded.
pub fn scan(
    id: &str,
    label: &str,
    open: impl FnOnce(usize) -> Result<Box<dyn Source>>,
    rig: &Rig,
    options: &ScanOptions,
    progress: impl FnMut(usize, Option<usize>),
) -> Result<ScanReport> {
    scan_on(|| options.place.open(), id, label, open, rig, options, progress)
}

/// Runs a scan from the first shot to the last file. `processor` is asked for once the source is open; `id` names the recording (a hash of its
/// meta.json, poses and ambient picture), so that a resumed scan cannot continue another one; `open` gives the source
/// from a shot on; `progress` is told (shots done, shots in all). Whatever ends it early, the shots that were done stay
/// done and the next run can resume there.
pub fn scan_on(
    processor: impl FnOnce() -> Result<Processor>,
    id: &str,
    label: &str,
    open: impl FnOnce(usize) -> Result<Box<dyn Source>>,
    rig: &Rig,
    options: &ScanOptions,
    mut progress: impl FnMut(usize, Option<usize>),
) -> Result<ScanReport> {
    let begun = Instant::now();
    options.grid.check()?;
    rig.belong_together()?;
    rig.reaches(options.volume.as_ref())?;
    std::fs::create_dir_all(&options.out).map_err(|e| Fault::write(&options.out, e))?;
    let _lock = Lock::take(&options.out)?;
    let cloud_path = options.out.join("cloud.ply");
    let settings = serde_json::to_string(&(&options.extraction, &options.volume)).expect("plain data");
    let identity = crate::rig::hash_text(format!("{id} {} {settings}", rig.fingerprint()).as_bytes());
    let former = Checkpoint::load(&options.out)?.filter(|_| options.resume);
    let state = match former {
        Some(c) if c.identity == identity => c,
        Some(_) => {
            return Err(Fault::usage("the interrupted scan was of another recording, rig or settings")
                .cause("something was changed since")
                .next("scan again without --resume, or into another folder"));
        }
        None => Checkpoint::new(identity),
    };
    // A resumed scan reads the last finished shot again, because points are judged by the shots around them.
    let repeated = state.shots.min(1);
    let mut source = open(state.shots - repeated)?;
    let processor = processor()?;
    let cloud = if state.shots > 0 {
        CloudWriter::resume(&cloud_path, state.points)?
    } else {
        CloudWriter::create(&cloud_path)?
    };
    let total = source.remaining().map(|n| n + state.shots - repeated);
    let scanner = Scanner::new(
        rig,
        source.format(),
        &options.extraction,
        options.volume.as_ref(),
        options.ambient.clone(),
        processor,
        state.stripe,
    )?;
    let mut overlays = Overlays::new(&options.out, options.overlays, total)?;
    let started = Instant::now();
    let first = state.shots;
    let spent = Spent { start_s: begun.elapsed().as_secs_f64(), ..Spent::default() };
    let mut work = Work { out: &options.out, repeated, cloud, state, scanner, overlays: &mut overlays, spent };
    if let Err(fault) = work.all(source.as_mut(), options.skip_bad, |done| progress(done, total)) {
        // Where the disk itself failed, the checkpoint before this one stands.
        let _ = work.save();
        return Err(fault);
    }
    let Work { cloud, mut state, scanner, mut spent, .. } = work;
    let points = cloud.finish()?;
    let seconds = started.elapsed().as_secs_f64();
    let products = Instant::now();
    let height_map = super::products::write(
        &options.out,
        &cloud_path,
        points,
        &options.grid,
        scanner.up_in_base(),
        scanner.device(),
    )?;
    spent.products_s = products.elapsed().as_secs_f64();
    if scanner.cut() > 0 {
        state.peaks.insert("beyond the list: more than a twentieth of the pictures lit".into(), scanner.cut());
    }
    let report = ScanReport {
        format: 1,
        program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
        created: jiff::Timestamp::now().to_string(),
        units: "mm".into(),
        frame: "base".into(),
        recording: label.into(),
        rig_fingerprint: rig.fingerprint(),
        working_volume: options.volume.clone(),
        ran_on: scanner.ran_on(),
        image: source.format(),
        shots: state.shots,
        points,
        peaks: state.peaks.clone(),
        dark_shots: state.dark.clone(),
        skipped: state.skipped.clone(),
        median_sigma_mm: state.median_sigma(),
        stripe: scanner.stripe(),
        seconds,
        shots_per_second: (state.shots - first) as f64 / seconds.max(1e-9),
        spent,
        settings: options.extraction.clone(),
        height_map,
        remarks: rig.remarks(),
    };
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    crate::files::write(&options.out.join("scan.json"), text.as_bytes())?;
    super::page::save(&options.out, None, &[])?;
    Checkpoint::remove(&options.out)?;
    Ok(report)
}

/// A scan under way.
struct Work<'a> {
    out: &'a Path,
    /// Shots that an earlier run finished and this one reads again.
    repeated: usize,
    cloud: CloudWriter,
    state: Checkpoint,
    scanner: Scanner,
    overlays: &'a mut Overlays,
    spent: Spent,
}

impl Work<'_> {
    /// Every shot of the source, to its points in the cloud.
    fn all(&mut self, source: &mut dyn Source, skip_bad: bool, mut progress: impl FnMut(usize)) -> Result<()> {
        let mut ended = false;
        let started = Instant::now();
        while !ended {
            let next = clocked(&mut self.spent.pictures_s, || source.next());
            match next {
                Some(Ok(shot)) => {
                    let shot = self.overlays.keep(shot);
                    clocked(&mut self.spent.stages_s, || self.scanner.push(shot))?;
                }
                // A resumed scan may meet a bad shot that the run before has listed.
                Some(Err(bad)) if skip_bad && self.state.skipped.iter().any(|(name, _)| *name == bad.name) => {}
                Some(Err(bad)) if skip_bad => self.state.skipped.push((bad.name, bad.fault.what)),
                Some(Err(BadShot { name, fault, .. })) => {
                    // The last good shot is not taken: it still waits to be judged by its neighbour.
                    let ready = self.scanner.ready()?;
                    self.take(&ready)?;
                    return Err(fault
                        .at(name)
                        .next("repair the shot and run again with --resume, or leave it out with --skip-bad"));
                }
                None => ended = true,
            }
            let scanner = &mut self.scanner;
            let ready = clocked(&mut self.spent.stages_s, || if ended { scanner.finish() } else { scanner.ready() })?;
            if self.spent.first_profile_s == 0.0 && !ready.is_empty() {
                self.spent.first_profile_s = started.elapsed().as_secs_f64();
            }
            let from = Instant::now();
            self.take(&ready)?;
            self.spent.writing_s += from.elapsed().as_secs_f64();
            progress(self.state.shots);
        }
        Ok(())
    }

    fn take(&mut self, ready: &[Profile]) -> Result<()> {
        for profile in ready {
            if self.repeated > 0 {
                self.repeated -= 1;
                continue;
            }
            self.overlays.draw(profile)?;
            // Points and state go together: what is counted here is what a resumed scan keeps.
            self.cloud.append(&profile.points)?;
            self.state.add(profile);
            if self.state.shots.is_multiple_of(CHECKPOINT_SHOTS) {
                self.save()?;
            }
        }
        Ok(())
    }

    fn save(&mut self) -> Result<()> {
        self.state.stripe = self.scanner.stripe();
        self.state.save(self.out, &mut self.cloud)
    }
}

/// Adds the time that something takes to a sum of seconds.
fn clocked<T>(seconds: &mut f64, what: impl FnOnce() -> T) -> T {
    let from = Instant::now();
    let result = what();
    *seconds += from.elapsed().as_secs_f64();
    result
}

/// Draws a few shots, evenly spread; holds a picture only from its arrival until its profile is there.
struct Overlays {
    folder: PathBuf,
    every: usize,
    held: BTreeMap<u32, Image>,
}

impl Overlays {
    fn new(out: &Path, count: usize, total: Option<usize>) -> Result<Overlays> {
        let folder = out.join("overlays");
        if count > 0 {
            std::fs::create_dir_all(&folder).map_err(|e| Fault::write(&folder, e))?;
        }
        // Of a pipe of unknown length every 100th shot is drawn.
        let every = if count == 0 { usize::MAX } else { total.map_or(100, |n| n.div_ceil(count)).max(1) };
        Ok(Overlays { folder, every, held: BTreeMap::new() })
    }
    fn keep(&mut self, shot: crate::scan::Shot) -> crate::scan::Shot {
        if self.every != usize::MAX && shot.index as usize % self.every == self.every / 2 {
            self.held.insert(shot.index, shot.image.clone());
        }
        shot
    }
    fn draw(&mut self, profile: &Profile) -> Result<()> {
        let Some(image) = self.held.remove(&profile.shot) else { return Ok(()) };
        let path = self.folder.join(format!("shot_{:05}.png", profile.shot));
        crate::scan::overlay::draw(&image, &profile.peaks).save_png(&path)
    }
}

/// Reads `scan.json` of a finished scan.
pub fn load_report(scan: &Path) -> Result<ScanReport> {
    let path = scan.join("scan.json");
    let text = std::fs::read_to_string(&path)
        .map_err(|e| Fault::read(&path, e).next("give the folder that sheetlight scan --out wrote"))?;
    serde_json::from_str(&text).map_err(|e| {
        Fault::input(format!("{}: is not a scan's report: {e}", path.display()))
            .cause("another version, or edited by hand")
            .next("scan again")
    })
}

/// The points of a finished scan, streamed.
pub fn cloud_of(scan: &Path) -> Result<Vec<CloudPoint>> {
    if !scan.join("cloud.ply").exists() {
        let recording = scan.join("meta.json").exists();
        let cause = if recording { "it is a recording, not a scan" } else { "another folder was given" };
        return Err(Fault::input(format!("{}: holds no cloud.ply", scan.display()))
            .cause(cause)
            .next("give the folder that sheetlight scan wrote with --out"));
    }
    crate::scan::read_cloud(&scan.join("cloud.ply"))
}
