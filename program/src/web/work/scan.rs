//! In: a recording and settings. Out: its scan in the job's folder; pages show it while it grows.
//! Frame and unit: mm.

use super::run::Run;
use super::store::scan_of;
use crate::web::guard::resolve;
use crate::web::message::{FilterOrder, Frames, Outcome, ScanFigures, ScanOrder};
use sheetlight::capture::Latency;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{GridOptions, Where};
use sheetlight::station::{ScanOptions, ScanReport, Settings, Watch, changed, filter_scan, scan_recording};

pub(super) fn scan(this: &Run, asked: &ScanOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    let (settings, rig) = (Settings::load(&place.station)?, Rig::load(&place.station)?);
    let settings = changed(&settings, "extraction", &asked.settings)?;
    let recording = Recording::open(&resolve(&place.recordings, &asked.recording)?)?;
    let size = [recording.meta.image.width, recording.meta.image.height];
    let place_to_run: Where = asked
        .on
        .as_deref()
        .unwrap_or("auto")
        .parse()
        .map_err(|e: String| Fault::usage(e).next("choose one of them"))?;
    let out = this.folder.join("scan");
    // A scan that ended before its first checkpoint starts again.
    let resume = this.again && out.join("scan.part/progress.json").exists();
    let options = ScanOptions {
        place: place_to_run,
        grid: GridOptions { cell: asked.cell_mm, ..GridOptions::default() },
        overlays: 6,
        skip_bad: asked.skip_bad,
        latency: Latency::load(&place.station)?,
        resume,
        stop: this.stop.clone(),
        watch: watch(this, &recording, size),
        ..ScanOptions::for_station(&settings, &rig, &out)
    };
    let report = scan_recording(&recording, None, &rig, &options, |done, of| this.progress(done, of))?;
    let mut frames = this.jobs.frames.lock().unwrap_or_else(|e| e.into_inner());
    for (_, why) in &report.skipped {
        *frames.dropped.entry(format!("excluded: {why}")).or_default() += 1;
    }
    drop(frames);
    report.has_points()?;
    Ok(Outcome::Scan(Box::new(figures(report))))
}

/// Stores a filtered copy of a scan in a separate job.
pub(super) fn filter(this: &Run, asked: &FilterOrder) -> Result<Outcome> {
    let scan = scan_of(&this.jobs.place.jobs(), &this.jobs.get(&asked.scan)?)?;
    let filters: Vec<_> = asked.filters.iter().map(|f| (*f).into()).collect();
    Ok(Outcome::Scan(Box::new(figures(filter_scan(&scan, &filters, &this.folder.join("scan"))?))))
}

/// Counts frames and extends the height map that pages show.
fn watch(this: &Run, recording: &Recording, size: [u32; 2]) -> Watch {
    let shots = recording.meta.frames.iter().filter(|f| f.laser.is_some()).count();
    this.jobs.hub.growing.begin(this.number, shots);
    *this.jobs.frames.lock().unwrap_or_else(|e| e.into_inner()) = Frames::default();
    let jobs = this.jobs.clone();
    Watch::new(move |profile, up| {
        jobs.hub.growing.add(profile, up, size);
        let mut frames = jobs.frames.lock().unwrap_or_else(|e| e.into_inner());
        frames.seen += 1;
        if profile.points.is_empty() {
            *frames.dropped.entry("no stripe".into()).or_default() += 1;
        } else {
            frames.measured += 1;
        }
    })
}

fn figures(r: ScanReport) -> ScanFigures {
    let spent = serde_json::to_value(r.spent).ok().and_then(|v| serde_json::from_value(v).ok()).unwrap_or_default();
    ScanFigures {
        shots: r.shots,
        points: r.points,
        width: r.image.width,
        height: r.image.height,
        frame: r.frame,
        median_sigma_mm: r.median_sigma_mm,
        coverage: r.height_map.as_ref().map(|h| h.coverage),
        cell_mm: r.height_map.as_ref().map(|h| h.cell_mm),
        z_mm: r.height_map.as_ref().map(|h| [h.z_low_mm, h.z_high_mm]),
        peaks: r.peaks,
        dark_shots: r.dark_shots.len(),
        skipped: r.skipped,
        seconds: r.seconds,
        shots_per_second: r.shots_per_second,
        ran_on: r.ran_on,
        spent,
        remarks: r.remarks,
    }
}
