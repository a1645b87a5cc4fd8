//! In: a recording and settings. Out: its scan in the job's folder, watched by the pages while it grows.
//! Frame and unit: mm.

use super::run::Run;
use super::store::scan_of;
use crate::fault::{Fault, Result};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::scan::{Extraction, GridOptions, Where};
use crate::station::{ScanOptions, ScanReport, Settings, Watch, filter_scan, scan_recording};
use crate::web::guard::resolve;
use crate::web::message::{FilterOrder, Frames, Outcome, ScanFigures, ScanOrder};
use serde_json::Value;
use std::collections::BTreeMap;

pub(super) fn scan(this: &Run, asked: &ScanOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    let (settings, rig) = (Settings::load(&place.station)?, Rig::load(&place.station)?);
    let recording = Recording::open(&resolve(&place.recordings, &asked.recording)?)?;
    let size = [recording.meta.image.width, recording.meta.image.height];
    let place_to_run: Where = asked
        .on
        .as_deref()
        .unwrap_or("auto")
        .parse()
        .map_err(|e: String| Fault::usage(e).next("choose one of them"))?;
    let out = this.folder.join("scan");
    // A scan that ended before its first checkpoint begins anew.
    let resume = this.again && out.join("scan.part/progress.json").exists();
    let options = ScanOptions {
        place: place_to_run,
        extraction: with(&settings.extraction, &asked.settings)?,
        grid: GridOptions { cell: asked.cell_mm, ..GridOptions::default() },
        overlays: 6,
        skip_bad: asked.skip_bad,
        resume,
        stop: this.stop.clone(),
        watch: watch(this, &recording, size),
        ..ScanOptions::for_station(&settings, &rig, &out)
    };
    let report = scan_recording(&recording, None, &rig, &options, |done, of| this.progress(done, of))?;
    let mut frames = this.jobs.frames.lock().unwrap_or_else(|e| e.into_inner());
    for (_, why) in &report.skipped {
        *frames.dropped.entry(format!("left out: {why}")).or_default() += 1;
    }
    drop(frames);
    report.has_points()?;
    Ok(Outcome::Scan(Box::new(figures(report))))
}

/// A scan less what filters take away, in a job of its own.
pub(super) fn filter(this: &Run, asked: &FilterOrder) -> Result<Outcome> {
    let scan = scan_of(&this.jobs.place.jobs(), &this.jobs.get(&asked.scan)?)?;
    let filters: Vec<_> = asked.filters.iter().map(|f| (*f).into()).collect();
    Ok(Outcome::Scan(Box::new(figures(filter_scan(&scan, &filters, &this.folder.join("scan"))?))))
}

/// Counts frames and lets the pages' height map grow.
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

/// The station's settings with some of them changed: keys with dots, as `threshold.window`.
fn with(station: &Extraction, changes: &BTreeMap<String, Value>) -> Result<Extraction> {
    let mut all = serde_json::to_value(station).expect("plain data");
    for (key, value) in changes {
        let mut at = &mut all;
        for word in key.split('.') {
            at = at.get_mut(word).ok_or_else(|| {
                Fault::usage(format!("{key}: is no setting of the extraction"))
                    .cause("a slip, or a setting of another version")
                    .next("take one from docs/file-formats.md, [extraction]")
            })?;
        }
        *at = value.clone();
    }
    let changed: Extraction = serde_json::from_value(all)
        .map_err(|e| Fault::usage(format!("the changed settings cannot be used: {e}")).next("correct the value"))?;
    changed.check()?;
    Ok(changed)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_changed_by_their_names_alone() {
        let station = Extraction::default();
        let change = |key: &str, value: Value| with(&station, &BTreeMap::from([(key.to_owned(), value)]));
        assert_eq!(change("threshold.minimum", 12.into()).unwrap().threshold.minimum, 12);
        assert_eq!(with(&station, &BTreeMap::new()).unwrap(), station);
        assert!(change("threshold.minimun", 12.into()).unwrap_err().what.contains("minimun"));
        assert!(change("threshold.minimum", "a".into()).unwrap_err().what.contains("cannot be used"));
    }
}
