//! In: a station, this machine. Out: one line a check, good or with what is wrong; the GPU's stages run in a process of their
//! own, because a driver can end it.
//! Frame and unit: mm, days, GB.

use super::run::Run;
use crate::fault::{Fault, Result};
use crate::rig::Rig;
use crate::station::Settings;
use crate::web::message::{CheckLine, Outcome};
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Older than this a calibration should be looked at again, days.
const OLD: f64 = 90.0;
/// Less than this is said, GB.
const LITTLE_DISK: f64 = 5.0;

pub(super) fn check(this: &Run) -> Result<Outcome> {
    let mut lines = Vec::new();
    let mut add = |group: &str, name: &str, state: &str, says: String| {
        lines.push(CheckLine { group: group.into(), name: name.into(), state: state.into(), says });
        this.progress(lines.len(), None);
    };
    station(this, &mut add);
    match crate::web::disk::left_gb(&this.jobs.place.station) {
        Some(gb) => add("disk", "space", if gb < LITTLE_DISK { "poor" } else { "good" }, format!("{gb:.1} GB left")),
        None => add("disk", "space", "poor", "the system does not say".into()),
    }
    let now = jiff::Timestamp::now();
    let sane = now > "2025-01-01T00:00:00Z".parse().expect("a time");
    add("clock", "clock", if sane { "good" } else { "bad" }, format!("{now:.0}"));
    for (name, state, says) in gpu(this)? {
        add("gpu", &name, state, says);
    }
    Ok(Outcome::Check { lines })
}

fn station(this: &Run, add: &mut impl FnMut(&str, &str, &str, String)) {
    let folder = &this.jobs.place.station;
    match Settings::load(folder) {
        Ok(s) => add(
            "station",
            "station.toml",
            "good",
            format!("{}; poses as {}", s.name, s.robot.map_or("matrix", |r| r.name())),
        ),
        Err(fault) => add("station", "station.toml", "bad", fault.what),
    }
    let rig = match Rig::load(folder) {
        Ok(rig) => rig,
        Err(fault) => return add("station", "calibrations", "bad", fault.what),
    };
    for c in crate::web::station::calibrations(&rig) {
        let old = c.days > OLD;
        let state = if c.verdict == "good" && !old { "good" } else { "poor" };
        let expected = c.expected_mm.map_or(String::new(), |mm| format!(", {mm:.4} mm expected"));
        add("station", &c.words, state, format!("{}, {:.0} days old{expected}", c.verdict, c.days));
    }
    match rig.belong_together() {
        Ok(()) => add("station", "one rig", "good", "all calibrations rest on the same camera".into()),
        Err(fault) => add("station", "one rig", "bad", fault.what),
    }
}

/// What `sheetlight doctor` finds, asked of this same program.
fn gpu(this: &Run) -> Result<Vec<(String, &'static str, String)>> {
    #[derive(serde::Deserialize)]
    struct Stage {
        stage: String,
        largest_difference: f64,
        limit: f64,
        #[serde(default)]
        failed: Option<String>,
    }
    #[derive(serde::Deserialize)]
    struct Findings {
        used: Option<String>,
        no_device_because: Option<String>,
        stages: Vec<Stage>,
        verdict: String,
    }
    let program = std::env::current_exe().map_err(no_check)?;
    let child = Command::new(program)
        .args(["doctor", "--json", "--no-rates"])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(no_check)?;
    let text = finish(this, child)?;
    let Ok(found) = serde_json::from_str::<Findings>(&text) else {
        return Ok(vec![("stages".into(), "bad", "the check of the GPU ended without a word".into())]);
    };
    let adapter = found.used.or(found.no_device_because).unwrap_or_else(|| "none".into());
    let mut out = vec![("adapter".into(), if found.stages.is_empty() { "absent" } else { "good" }, adapter)];
    for s in &found.stages {
        let good = s.failed.is_none() && s.largest_difference <= s.limit;
        let says = s
            .failed
            .clone()
            .unwrap_or_else(|| format!("differs from its twin by {:.3e}, limit {:.3e}", s.largest_difference, s.limit));
        out.push((s.stage.clone(), if good { "good" } else { "bad" }, says));
    }
    out.push(("verdict".into(), if found.verdict.starts_with("do not") { "bad" } else { "good" }, found.verdict));
    Ok(out)
}

fn no_check(e: std::io::Error) -> Fault {
    Fault::device(format!("the check of the GPU cannot be started: {e}"))
        .cause("the program's file was moved or replaced while it runs, or there is no memory")
        .next("start the server again, or run `sheetlight doctor` in a terminal")
}

/// What a process prints; it is ended when the job is.
fn finish(this: &Run, mut child: Child) -> Result<String> {
    let mut out = child.stdout.take().expect("piped");
    let read = move || {
        let mut text = String::new();
        out.read_to_string(&mut text).map(|_| text).unwrap_or_default()
    };
    let reader = std::thread::Builder::new().name("check".into()).spawn(read).map_err(no_check)?;
    loop {
        if this.stopped() {
            let _ = child.kill();
            let _ = child.wait();
            return Err(Fault::refused("stopped by the operator").next("check again when there is time"));
        }
        match child.try_wait() {
            Ok(None) => std::thread::sleep(Duration::from_millis(50)),
            _ => return Ok(reader.join().unwrap_or_default()),
        }
    }
}
