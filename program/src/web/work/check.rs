//! Checks the station and this machine, one line per check. The GPU stages run in a separate process, because a
//! driver can end a process.

use super::run::Run;
use crate::web::camera::Camera;
use crate::web::message::{CheckLine, Outcome};
use crate::web::robot::Robot;
use sheetlight::camera::{Intrinsics, Readout};
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::{Calibration, Rig};
use sheetlight::station::Settings;
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Age from which a calibration should be checked again, days.
const OLD: f64 = 90.0;
/// Free disk space below which a warning is given, GB.
const LITTLE_DISK: f64 = 5.0;

pub(super) fn check(this: &Run) -> Result<Outcome> {
    let mut lines = Vec::new();
    let mut add = |group: &str, name: &str, state: &str, says: String| {
        lines.push(CheckLine { group: group.into(), name: name.into(), state: state.into(), says });
        this.progress(lines.len(), None);
    };
    station(this, &mut add);
    let links = &this.jobs.desk.links;
    let calibrated = Rig::load(&this.jobs.place.station).ok().and_then(|r| r.camera);
    camera(links.camera.as_deref(), calibrated.as_ref(), &mut add);
    robot(links.watched.as_deref(), &mut add);
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

/// Compares the camera's pictures with those that it was calibrated with.
fn camera(
    camera: Option<&Camera>,
    calibrated: Option<&Calibration<Intrinsics>>,
    add: &mut impl FnMut(&str, &str, &str, String),
) {
    let Some(camera) = camera else {
        return add("camera", "camera", "absent", "the screen was served without --camera".into());
    };
    let (frames, delay, wrong) = camera.seen();
    let Some(newest) = camera.other_than(0) else {
        let why = wrong.unwrap_or_else(|| "it has sent no picture yet".into());
        return add("camera", "camera", "bad", why);
    };
    let (w, h) = (newest.image.width, newest.image.height);
    let delay = delay.map_or(String::new(), |[p50, p99]| format!(", delay p50 {p50:.0} ms, p99 {p99:.0} ms"));
    let sent = format!("pictures of {w}x{h}, {} came, {} measured{delay}", frames.seen, frames.measured);
    add("camera", "camera", if wrong.is_some() { "poor" } else { "good" }, wrong.unwrap_or(sent));
    let (state, says) = picture_size(calibrated, [w, h], camera.readout().as_ref());
    add("camera", "picture size", state, says);
}

/// Whether pictures of this size and sensor readout can be measured with the calibration.
fn picture_size(
    calibrated: Option<&Calibration<Intrinsics>>,
    size: [u32; 2],
    readout: Option<&Readout>,
) -> (&'static str, String) {
    let Some(calibrated) = calibrated else { return ("absent", "the camera is not calibrated".into()) };
    let ([w, h], Intrinsics { width, height, .. }) = (size, calibrated.value);
    match (calibrated.for_pictures(size, readout), calibrated.same_pictures(size, readout)) {
        (Err(fault), _) => ("bad", fault.what),
        (Ok(_), Ok(())) => ("good", format!("{w}x{h}, calibrated at {width}x{height}")),
        (Ok(_), Err(_)) => {
            let how = readout.map_or(String::new(), |r| format!(" ({r})"));
            ("good", format!("{w}x{h}{how}, part of the calibrated {width}x{height}; jobs of the robot need all of it"))
        }
    }
}

/// State of the controller. Tool frame and work frame must be 0, so that the reported pose is that of the flange in
/// the base; otherwise poses mean something else.
fn robot(robot: Option<&Robot>, add: &mut impl FnMut(&str, &str, &str, String)) {
    let Some(robot) = robot else {
        return add("robot", "robot", "absent", "the screen was served without --robot".into());
    };
    let seen = robot.seen();
    let Some(state) = &seen.state else {
        return add("robot", "robot", "bad", seen.wrong.unwrap_or_else(|| "no link yet".into()));
    };
    let motors = match state.motor {
        Some(true) => ", motors on",
        Some(false) => ", motors off",
        None => "",
    };
    let says =
        seen.wrong.clone().unwrap_or_else(|| format!("{}, mode {:?}{motors}", state.model, state.mode).to_lowercase());
    add("robot", "robot", if seen.wrong.is_some() { "poor" } else { "good" }, says);
    let others = [("tool frame", state.tool, "the flange"), ("work frame", state.work, "the base")];
    for (name, number, zero) in others {
        match number {
            Some(0) => add("robot", name, "good", format!("0: poses are of {zero}")),
            Some(n) => add(
                "robot",
                name,
                "poor",
                format!("{n} is chosen on the controller; poses are read by number 0, {zero}"),
            ),
            None => add("robot", name, "absent", "the controller does not say".into()),
        }
    }
}

/// Results of `sheetlight doctor`, run with this program's executable.
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
        .cause("the program's file was moved or replaced while it runs, or there is not enough memory")
        .next("start the server again, or run `sheetlight doctor` in a terminal")
}

/// Output of a process; the process is ended when the job is.
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

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::simulate::Station;

    #[test]
    fn pictures_that_say_what_they_show_are_good_and_others_of_another_size_are_bad() {
        let folder = tempfile::tempdir().unwrap();
        Station::design().store(folder.path()).unwrap();
        let camera = Rig::load(folder.path()).unwrap().camera.unwrap();
        let [w, h] = [camera.value.width, camera.value.height];
        let region = Readout { offset_px: [w / 4, h / 4], sensor_px: Some([w, h]), ..Readout::default() };
        let state = |size, readout| picture_size(Some(&camera), size, readout);
        assert_eq!(state([w, h], None).0, "good");
        let (part, says) = state([w / 2, h / 2], Some(&region));
        assert!(part == "good" && says.contains(&format!("offset {}", w / 4)), "{part} {says}");
        // The calibrated aspect ratio alone does not show what part of the sensor is read: it may be a crop.
        assert_eq!(state([w / 2, h / 2], None).0, "bad");
        let beyond = Readout { offset_px: [w, h], ..region };
        assert_eq!(state([w / 2, h / 2], Some(&beyond)).0, "bad");
        assert_eq!(picture_size(None, [w, h], None).0, "absent");
    }
}
