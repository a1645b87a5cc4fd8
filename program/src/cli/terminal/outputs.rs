//! In: the destinations of results, and the folders and files that a command reads. Out: a refusal if one would
//! replace another.
//! Frame and unit: none.

use sheetlight::fault::{Fault, Result};
use sheetlight::files::{not_over, not_over_any};
use sheetlight::rig::Rig;
use sheetlight::simulate::Set;
use sheetlight::station::{load_report, of_a_scan};
use std::path::Path;

/// The inputs of a command: none of them may be among its results.
#[derive(Default)]
pub struct Inputs<'a> {
    pub files: &'a [&'a Path],
    pub scans: &'a [&'a Path],
    pub station: Option<&'a Path>,
}

/// Refuses results that would replace an input, and two results with the same name.
pub fn check(results: &[&Path], inputs: &Inputs) -> Result<()> {
    for (i, out) in results.iter().enumerate() {
        not_over(out, inputs.files.iter().copied())?;
        not_over(out, results[..i].iter().copied())?;
        for scan in inputs.scans {
            not_over_any(out, scan, of_a_scan)?;
        }
        if let Some(station) = inputs.station {
            not_over_any(out, station, |name| name == "station.toml" || name == "calibration")?;
            not_over_any(out, &station.join("calibration"), |_| true)?;
        }
    }
    Ok(())
}

/// Refuses to simulate into a folder with recordings or a station that were not simulated.
pub fn check_simulation(out: &Path) -> Result<()> {
    let refuse = |what: String| {
        Err(Fault::usage(what)
            .cause("the folder of real recordings was given for simulated ones")
            .next("give the simulation a folder of its own"))
    };
    if out.join("meta.json").exists() || out.join("station.toml").exists() {
        return refuse(format!("{}: is a recording or a station itself", out.display()));
    }
    for set in Set::ALL.into_iter().chain([Set::Axis]) {
        let folder = out.join(set.name());
        if folder.join("meta.json").exists() && !folder.join("truth.json").exists() {
            return refuse(format!("{}: holds a recording that was not simulated", folder.display()));
        }
    }
    let station = out.join("station");
    let there = station.join("station.toml").exists() || station.join("calibration").exists();
    let simulated = || {
        let camera = Rig::load_camera(&station).ok()?.camera?;
        Some(camera.quality.reasons == [sheetlight::simulate::TRUE_VALUES])
    };
    if there && simulated() != Some(true) {
        return refuse(format!("{}: is a station that was not simulated", station.display()));
    }
    Ok(())
}

/// Refuses a folder that is a recording or a station, or whose scan does not have the label `label`.
pub fn check_scan(out: &Path, label: &str) -> Result<()> {
    if let Some(file) = ["meta.json", "station.toml"].iter().find(|f| out.join(f).exists()) {
        return Err(Fault::usage(format!("{}: holds a {file}", out.display()))
            .cause("the folder of a recording or a station was given for results")
            .next("give another --out"));
    }
    if !out.join("scan.json").exists() {
        return Ok(());
    }
    match load_report(out) {
        Ok(report) if report.recording == label => Ok(()),
        _ => Err(Fault::usage(format!("{}: contains a scan of another recording", out.display()))
            .cause("the folder of a real scan was given")
            .next("give another --out")),
    }
}
