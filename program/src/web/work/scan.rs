//! In: a recording and settings. Out: its scan in the job's folder; pages show it while it grows.
//! Frame and unit: mm.

use super::run::Run;
use crate::procedure::{At, ScanOrder};
use crate::web::message::{FilterOrder, Frames, Outcome, ScanFigures};
use sheetlight::fault::Result;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::station::{ScanOptions, ScanReport, Settings, Watch, scan_recording};

pub(super) fn scan(this: &Run, order: &ScanOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    let (settings, rig) = (Settings::load(&place.station)?, Rig::load(&place.station)?);
    let out = this.folder.join("scan");
    let prepare = |at: &At| {
        let recording = order.open(at)?;
        let options = ScanOptions {
            ambient: order.dark(at, &recording)?,
            overlays: 6,
            // A scan that ended before its first checkpoint starts again.
            resume: this.again && out.join("scan.part/progress.json").exists(),
            stop: this.stop.clone(),
            watch: watch(this, &recording),
            ..order.options(at, &settings, &rig, &out)?
        };
        Ok((recording, options))
    };
    let ((recording, options), remarks) = this.remarked(prepare)?;
    let poses = order.poses.as_deref();
    let mut report = scan_recording(&recording, poses, &rig, &options, |done, of| this.progress(done, of))?;
    report.remarks.extend(remarks);
    let mut frames = this.jobs.frames.lock().unwrap_or_else(|e| e.into_inner());
    for (_, why) in &report.skipped {
        *frames.dropped.entry(format!("excluded: {why}")).or_default() += 1;
    }
    drop(frames);
    report.has_points()?;
    Ok(Outcome::Scan(Box::new(figures(report))))
}

/// Stores a filtered copy of a scan in a separate job.
pub(super) fn filter(this: &Run, order: &FilterOrder) -> Result<Outcome> {
    Ok(Outcome::Scan(Box::new(figures(order.filter(this, &this.folder.join("scan"))?))))
}

/// Counts frames and extends the height map that pages show.
fn watch(this: &Run, recording: &Recording) -> Watch {
    let size = [recording.meta.image.width, recording.meta.image.height];
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
