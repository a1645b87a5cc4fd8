//! In: recordings, a station, a recipe, settings. Out: a scan of each and what was found in it, one after the other;
//! how the places repeat; a table of all as JSON and CSV. One that fails is named with its reason, and the others go
//! on.
//! Frame and unit: the scans' frame; mm, degrees; poses in the robot's notation.

use super::files::write;
use super::repeats::repeats;
use super::rows::{Batch, BatchRow, FoundAt};
use crate::capture::Latency;
use crate::fault::{Fault, Kind, Result};
use crate::find::{LocateOptions, Recipe};
use crate::recording::Recording;
use crate::rig::Rig;
use crate::scan::Where;
use crate::station::edit::changed;
use crate::station::find::find_part;
use crate::station::scan::options::ScanOptions;
use crate::station::scan::recorded::scan_recording;
use crate::station::scan::report::ScanReport;
use crate::station::settings::Settings;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is scanned, and what is looked for.
#[derive(Clone, Debug)]
pub struct BatchOptions {
    /// Folder of the station.
    pub station: PathBuf,
    /// Folders of the recordings.
    pub recordings: Vec<PathBuf>,
    /// What is looked for in each; `None`: nothing.
    pub recipe: Option<Recipe>,
    /// Folder for the scans, one each, and the table.
    pub out: PathBuf,
    /// Settings other than the station's: names of `[extraction]` with dots.
    pub settings: BTreeMap<String, Value>,
    /// Where the stages run.
    pub place: Where,
    /// How and where parts are looked for, and the notation of poses.
    pub locate: LocateOptions,
    /// Ends it; what was done is kept.
    pub stop: Arc<AtomicBool>,
}

/// Scans each and looks for the part in it; `each` hears every row as it comes. Leaves batch.json and batch.csv, a
/// folder a scan with what was found beside it.
///
/// # Errors
/// Nothing to do, settings or a station that cannot be, the disk; it was stopped.
pub fn batch(options: &BatchOptions, mut each: impl FnMut(&BatchRow)) -> Result<Batch> {
    if options.recordings.is_empty() {
        return Err(Fault::usage("0 recordings, 1 or more needed").next("name the folders of the recordings"));
    }
    let (settings, rig) = (Settings::load(&options.station)?, Rig::load(&options.station)?);
    let settings = changed(&settings, "extraction", &options.settings)?;
    let names = names(&options.recordings);
    if let Some(taken) = names.iter().map(|n| options.out.join(n)).find(|f| f.join("meta.json").exists()) {
        return Err(Fault::usage(format!("{}: is a recording, but the scan would be written there", taken.display()))
            .cause("the folder of the recordings was given for the results")
            .next("give another folder for the results"));
    }
    crate::files::make_folder(&options.out)?;
    let mut rows = Vec::new();
    for (recording, name) in options.recordings.iter().zip(names) {
        let (row, fault) = one(options, &settings, &rig, recording.clone(), name);
        if options.stop.load(Ordering::Relaxed) {
            return Err(Fault::refused(format!(
                "stopped after {} of {} recordings",
                rows.len(),
                options.recordings.len()
            ))
            .next("run it again; scans that were finished are kept in their folders"));
        }
        // A full disk is full for the next one too.
        if let Some(fault) = fault.filter(|f| f.kind == Kind::Output) {
            return Err(fault);
        }
        each(&row);
        rows.push(row);
    }
    let placed = rows.iter().filter_map(|r| r.found.as_ref()).filter_map(FoundAt::placed).collect::<Vec<_>>();
    let recipe = options.recipe.as_ref().map(|r| r.name.clone());
    let batch = Batch { format: 1, recipe, rows, repeats: repeats(&placed) };
    write(&options.out, &batch)?;
    Ok(batch)
}

/// One recording, to the end or to why not.
fn one(
    options: &BatchOptions,
    settings: &Settings,
    rig: &Rig,
    recording: PathBuf,
    name: String,
) -> (BatchRow, Option<Fault>) {
    let mut row = BatchRow {
        recording,
        scan: name,
        problem: None,
        points: None,
        median_sigma_mm: None,
        coverage: None,
        seconds: None,
        found: None,
    };
    let done = scanned(options, settings, rig, &mut row).and_then(|()| found(options, &mut row));
    let fault = done.err();
    if let Some(fault) = &fault {
        row.problem = Some(fault.what.clone());
    }
    (row, fault)
}

fn scanned(options: &BatchOptions, settings: &Settings, rig: &Rig, row: &mut BatchRow) -> Result<()> {
    let recording = Recording::open(&row.recording)?;
    let run = ScanOptions {
        place: options.place,
        latency: Latency::load(&options.station)?,
        stop: options.stop.clone(),
        ..ScanOptions::for_station(settings, rig, &options.out.join(&row.scan))
    };
    let report: ScanReport = scan_recording(&recording, None, rig, &run, |_, _| {})?;
    (row.points, row.median_sigma_mm, row.seconds) =
        (Some(report.points), report.median_sigma_mm, Some(report.seconds));
    row.coverage = report.height_map.as_ref().map(|h| h.coverage);
    report.has_points()
}

fn found(options: &BatchOptions, row: &mut BatchRow) -> Result<()> {
    let Some(recipe) = &options.recipe else { return Ok(()) };
    let scan = options.out.join(&row.scan);
    let (report, picture) = find_part(&scan, recipe, Some(&options.station), &options.locate)?;
    let text = serde_json::to_string_pretty(&report).expect("plain data");
    let beside = |ending: &str| options.out.join(format!("{}-{ending}", row.scan));
    crate::files::write_beside((&beside("found.json"), text.as_bytes()), &[(&beside("found.png"), &picture.to_png())])?;
    row.problem = (!report.passed).then(|| report.reasons.join("; "));
    row.found = Some(FoundAt::of(&report));
    Ok(())
}

/// A name for each scan: its recording's folder's, with a number where two are called alike.
fn names(recordings: &[PathBuf]) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let name = |path: &PathBuf| {
        let own = path.canonicalize().unwrap_or_else(|_| path.clone());
        let word = own.file_name().map_or_else(|| "recording".into(), |n| n.to_string_lossy().into_owned());
        let free = (1..).map(|k| if k == 1 { word.clone() } else { format!("{word}-{k}") });
        free.into_iter().find(|n| taken.insert(n.clone())).expect("some name is free")
    };
    recordings.iter().map(name).collect()
}
