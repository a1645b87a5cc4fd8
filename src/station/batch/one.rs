//! In: a recording of a batch. Out: the folder of its results: scan/, found.json and found.png of the part in it, and
//! result.json; nothing in them depends on when and where they were made.
//! Frame and unit: the scan's frame; mm, degrees.

use super::identity::{BatchOptions, FORMAT};
use super::input::hash_of;
use super::manifest::Entry;
use super::plan::Folder;
use super::rows::{BatchRow, FoundAt, Line, Problem, is_a_result};
use super::shots::rows;
use crate::capture::Latency;
use crate::fault::{Fault, Result};
use crate::find::Recipe;
use crate::recording::Recording;
use crate::rig::Rig;
use crate::station::find::find_part;
use crate::station::scan::options::ScanOptions;
use crate::station::scan::recorded::scan_recording;
use crate::station::scan::report::ScanReport;
use crate::station::settings::Settings;
use std::path::Path;

/// What a process scans with.
pub(super) struct Bench<'a> {
    pub options: &'a BatchOptions,
    pub folder: Folder<'a>,
    pub settings: Settings,
    pub rig: Rig,
    pub latency: Option<Latency>,
    pub recipe: Option<Recipe>,
}

impl Bench<'_> {
    /// Scans a recording unless its results are there.
    ///
    /// # Errors
    /// What ends the batch here: the disk, the device, a signal. What is wrong with the recording is a line.
    pub fn one(&self, entry: &Entry, recording: &Path) -> Result<Line> {
        let key = self.folder.identity.key(&entry.input);
        if let Some(row) = self.folder.row(&key)? {
            return Ok(Line::of(&entry.name, Folder::results(&key), &row, false));
        }
        let recording = match self.checked(entry, recording) {
            Ok(recording) => recording,
            Err(fault) => return Ok(Line::failed(&entry.name, &fault)),
        };
        let place = self.folder.workplace()?;
        let row = self.made(&key, entry, &recording, place.folder())?;
        let text = serde_json::to_string_pretty(&row).expect("plain data");
        crate::files::write(&place.folder().join("result.json"), text.as_bytes())?;
        let made = place.keep(&self.folder.path(&key))?;
        Ok(Line::of(&entry.name, Folder::results(&key), &row, made))
    }

    /// The recording's folder, if it is the one that the manifest means.
    fn checked(&self, entry: &Entry, recording: &Path) -> Result<std::path::PathBuf> {
        let real = recording.canonicalize().map_err(|_| {
            Fault::input(format!("{}: there is no such folder", recording.display()))
                .cause("it was moved since the manifest was made, or its disk is not mounted here")
                .next("mount it, or make the manifest again")
        })?;
        if self.options.out.canonicalize().is_ok_and(|out| out.starts_with(&real)) {
            return Err(Fault::usage(format!("{}: the results would lie in this recording", recording.display()))
                .cause("a folder within a recording was given for results")
                .next("give another --out"));
        }
        let is = hash_of(&real)?;
        if is == entry.input {
            return Ok(real);
        }
        Err(Fault::input(format!(
            "{}: has the hash {is:.12}, its manifest says {:.12}",
            recording.display(),
            entry.input
        ))
        .cause("a file of it was changed, added or lost since the manifest was made")
        .next("restore the recording; if the change is meant, make the manifest again"))
    }

    fn made(&self, key: &str, entry: &Entry, recording: &Path, place: &Path) -> Result<BatchRow> {
        let mut row = BatchRow {
            format: FORMAT,
            result: key.into(),
            input: entry.input.clone(),
            problem: None,
            frame: None,
            shots: None,
            points: None,
            median_sigma_mm: None,
            coverage: None,
            figures: Default::default(),
            recipe: self.recipe.as_ref().map(|r| r.name.clone()),
            found: None,
            shot_rows: Vec::new(),
        };
        let scan = place.join("scan");
        let done = self.scanned(recording, &scan, &mut row).and_then(|()| self.found(place, &mut row));
        match done {
            Ok(()) => Ok(row),
            Err(fault) if is_a_result(&fault) => {
                // What was begun is no part of a result.
                crate::files::remove(&scan.join("scan.part")).map_err(|e| Fault::write(&scan, e))?;
                let problem = placeless(&fault, &[(recording, "recording"), (&scan, "scan"), (place, "results")]);
                row.problem = Some(in_a_batch(problem));
                Ok(row)
            }
            Err(fault) => Err(fault),
        }
    }

    fn scanned(&self, recording: &Path, scan: &Path, row: &mut BatchRow) -> Result<()> {
        let run = ScanOptions {
            place: self.options.place,
            latency: self.latency.clone(),
            stop: self.options.stop.clone(),
            skip_bad: self.options.skip_bad,
            ..ScanOptions::for_station(&self.settings, &self.rig, scan)
        };
        let report = scan_recording(&Recording::open(recording)?, None, &self.rig, &run, |_, _| {})?;
        let mut report = report.timeless(&format!("sha256:{}", row.input));
        let here = recording.to_string_lossy();
        report.skipped.iter_mut().for_each(|(_, why)| *why = why.replace(&*here, "recording"));
        let text = serde_json::to_string_pretty(&report).expect("plain data");
        crate::files::write(&scan.join("scan.json"), text.as_bytes())?;
        #[cfg(feature = "pages")]
        crate::station::judge::page::save(scan, None, &[])?;
        crate::files::remove(&scan.join("scan.lock")).map_err(|e| Fault::write(scan, e))?;
        (row.frame, row.shots, row.points) =
            (Some(report.frame.clone()), Some(report.shots as u64), Some(report.points));
        row.median_sigma_mm = report.median_sigma_mm;
        row.coverage = report.height_map.as_ref().map(|h| h.coverage);
        row.figures = figures(&report);
        report.has_points()?;
        row.shot_rows = rows(scan)?;
        Ok(())
    }

    fn found(&self, place: &Path, row: &mut BatchRow) -> Result<()> {
        let Some(recipe) = &self.recipe else { return Ok(()) };
        let (options, scan) = (self.options, place.join("scan"));
        let (report, picture) = find_part(&scan, recipe, Some(&options.station), &options.locate)?;
        let text = serde_json::to_string_pretty(&report).expect("plain data");
        let picture = picture.to_png();
        crate::files::write_beside(
            (&place.join("found.json"), text.as_bytes()),
            &[(&place.join("found.png"), &picture)],
        )?;
        row.problem = (!report.passed).then(|| Problem {
            what: report.reasons.join("; "),
            cause: "a gate of the recipe was not passed".into(),
            next: "look at found.png; docs/finding-and-inserting.md says what each gate means".into(),
        });
        row.found = Some(FoundAt::of(&report));
        Ok(())
    }
}

/// The problem without what holds only for a scan of its own: a batch keeps no part of a scan and does not resume one.
fn in_a_batch(problem: Problem) -> Problem {
    let Problem { what, cause, next } = problem;
    let what = what.split("; the first ").next().unwrap_or_default().to_owned();
    let next = if next.contains("--resume") {
        "copy the recording again and make the manifest anew, or run the batch with --skip-bad into another --out"
            .into()
    } else {
        next
    };
    Problem { what, cause, next }
}

/// The fault without the places of this machine.
fn placeless(fault: &Fault, places: &[(&Path, &str)]) -> Problem {
    let plain = |text: &str| {
        places.iter().fold(text.to_owned(), |text, (path, word)| text.replace(&*path.to_string_lossy(), word))
    };
    Problem { what: plain(&fault.what), cause: plain(&fault.cause), next: plain(&fault.next) }
}

/// What else a scan's report says in numbers.
fn figures(r: &ScanReport) -> std::collections::BTreeMap<String, f64> {
    let mut all: Vec<(String, f64)> = vec![
        ("dark_shots".into(), r.dark_shots.len() as f64),
        ("skipped_shots".into(), r.skipped.len() as f64),
        ("hot_pixels".into(), r.hot_pixels as f64),
        ("median_level".into(), f64::from(r.seen.median_level)),
        ("brightest_level".into(), f64::from(r.seen.brightest_level)),
        ("saturated_share".into(), r.seen.saturated),
    ];
    all.extend(r.peaks.iter().map(|(kind, n)| (format!("peaks: {kind}"), *n as f64)));
    if let Some(s) = &r.stripe {
        all.extend([("stripe_width_px".into(), f64::from(s.width_px)), ("speckle".into(), f64::from(s.speckle))]);
    }
    if let Some(h) = &r.height_map {
        all.extend([("z_low_mm".into(), h.z_low_mm), ("z_high_mm".into(), h.z_high_mm), ("cell_mm".into(), h.cell_mm)]);
    }
    // A number that JSON cannot hold would be lost on the way into the tables.
    all.into_iter().filter(|(_, v)| v.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_names_no_place_of_this_machine() {
        let fault = Fault::input("/a/rec/7/meta.json: is not text").cause("see /b/made/x/scan").next("free /b/made/x");
        let places: [(&Path, &str); 3] = [
            (Path::new("/a/rec/7"), "recording"),
            (Path::new("/b/made/x/scan"), "scan"),
            (Path::new("/b/made/x"), "results"),
        ];
        let p = placeless(&fault, &places);
        assert_eq!((p.what.as_str(), p.cause.as_str()), ("recording/meta.json: is not text", "see scan"));
        assert_eq!(p.next, "free results");
    }
}
