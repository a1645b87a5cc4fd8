//! In: scans, recordings, parts and places for the file that do not fit. Out: one error each with what, cause and next
//! step, and no file.
//! Frame and unit: none.

use super::{at, common, made, run, text};
use std::path::Path;

/// Runs the export and expects a refusal with these words; nothing new may lie in the file's folder.
fn refused(code: i32, scan: &Path, out: &Path, options: &[&str], words: &[&str]) {
    let before = out.parent().and_then(|f| Some(std::fs::read_dir(f).ok()?.count()));
    let (scan, file) = (text(scan), text(out));
    let call = [&["mcap", &scan, "--out", &file], options].concat();
    let (exit, said) = common::sheetlight_fails(&call);
    assert_eq!(exit, code, "{said}");
    for word in words.iter().chain(&["error: ", "likely cause: ", "next step: "]) {
        assert!(said.contains(word), "'{word}' is not in: {said}");
    }
    assert_eq!(said.matches("error: ").count(), 1, "{said}");
    assert_eq!(out.parent().and_then(|f| Some(std::fs::read_dir(f).ok()?.count())), before, "{said}");
}

/// A copy of the scan, to be spoilt.
fn copy() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("scan")).unwrap();
    for entry in std::fs::read_dir(at("done")).unwrap().map(|e| e.unwrap()).filter(|e| e.path().is_file()) {
        std::fs::copy(entry.path(), dir.path().join("scan").join(entry.file_name())).unwrap();
    }
    dir
}

#[test]
fn a_spoilt_scan_is_refused() {
    let spoilt = |spoil: &dyn Fn(&Path), words: &[&str]| {
        let dir = copy();
        spoil(&dir.path().join("scan"));
        refused(1, &dir.path().join("scan"), &dir.path().join("a.mcap"), &[], words);
    };
    let cut = |scan: &Path| {
        let bytes = std::fs::read(scan.join("cloud.ply")).unwrap();
        std::fs::write(scan.join("cloud.ply"), &bytes[..bytes.len() - 50]).unwrap();
    };
    spoilt(&cut, &["bytes long", "points need", "truncated"]);
    spoilt(&|scan| std::fs::remove_file(scan.join("shots.jsonl")).unwrap(), &["shots.jsonl: is not there"]);
    spoilt(&|scan| std::fs::remove_file(scan.join("cloud.ply")).unwrap(), &["holds no cloud.ply"]);
    spoilt(&|scan| std::fs::remove_file(scan.join("scan.json")).unwrap(), &["scan.json: cannot be read"]);
    let edited = |scan: &Path| {
        let mut bytes = std::fs::read(scan.join("cloud.ply")).unwrap();
        *bytes.last_mut().unwrap() ^= 1;
        std::fs::write(scan.join("cloud.ply"), bytes).unwrap();
    };
    spoilt(&edited, &["SHA-256"]);
    let empty = |scan: &Path| {
        let report = std::fs::read_to_string(scan.join("scan.json")).unwrap();
        let mut report: serde_json::Value = serde_json::from_str(&report).unwrap();
        report["points"] = 0.into();
        std::fs::write(scan.join("scan.json"), report.to_string()).unwrap();
    };
    spoilt(&empty, &["no point in 40 shots"]);
    let dir = tempfile::tempdir().unwrap();
    refused(1, &at("scan"), &dir.path().join("a.mcap"), &[], &["it is a recording, not a scan"]);
}

#[test]
fn what_belongs_to_another_scan_is_refused() {
    let (dir, other) = (tempfile::tempdir().unwrap(), made(12, 8));
    let out = dir.path().join("a.mcap");
    let of = |name: &str| text(&other.path().join(name));
    let done = at("done");
    refused(1, &done, &out, &["--recording", &of("scan")], &["has 12 pictures", "the scan has 40 shots"]);
    refused(1, &done, &out, &["--station", &of("station")], &["was scanned with calibration", "the station now has"]);
    refused(1, &done, &out, &["--recording", &of("none")], &["is not a folder"]);
    // The same number of pictures, on another path.
    let long = made(40, 8);
    let elsewhere = text(&long.path().join("scan"));
    let station = text(&at("station"));
    let words = ["at shot 0 its pose puts the camera", "5 mm and 2 degrees"];
    refused(1, &done, &out, &["--recording", &elsewhere, "--station", &station], &words);
}

#[test]
fn a_part_without_a_pose_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let (part, out) = (tempfile::tempdir().unwrap(), dir.path().join("a.mcap"));
    let file = part.path().join("part.json");
    let report = |passed: bool, frame: &str| {
        let pose: Vec<f64> = vec![1.0, 0.0, 0.0, 1.5, 0.0, 1.0, 0.0, -2.0, 0.0, 0.0, 1.0, 30.0, 0.0, 0.0, 0.0, 1.0];
        let report = serde_json::json!({"recipe": "led", "frame": frame, "passed": passed, "reasons": ["coverage 0.2"],
            "base_from_part": pose, "edges": 7});
        std::fs::write(&file, report.to_string()).unwrap();
        text(&file)
    };
    let done = at("done");
    refused(1, &done, &out, &["--part", &report(false, "base")], &["has no pose: coverage 0.2"]);
    refused(1, &done, &out, &["--part", &report(true, "axis")], &["in the axis frame", "in the base frame"]);
    std::fs::write(&file, "{\"pictures\": []}").unwrap();
    refused(1, &done, &out, &["--part", &text(&file)], &["is not the report of a part"]);
    // A good one is a pose at the scan's end.
    run(&["mcap", &text(&done), "--part", &report(true, "base"), "--out", &text(&out), "--no-cloud", "--quiet"]);
    let all = super::messages(&std::fs::read(&out).unwrap());
    let mut w = super::Wire::new(&all["/sheetlight/part"][0].data);
    assert_eq!(w.header("base"), all["/diagnostics"][0].time);
    assert_eq!(w.f64s(7), [0.0015, -0.002, 0.03, 0.0, 0.0, 0.0, 1.0]);
    w.end();
    assert_eq!(super::told(&std::fs::read(&out).unwrap())["part.0"], "led");
}

#[test]
fn a_file_that_is_there_or_cannot_be_written_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let (there, done) = (dir.path().join("there.mcap"), at("done"));
    std::fs::write(&there, "mine").unwrap();
    refused(2, &done, &there, &[], &["is there already"]);
    assert_eq!(std::fs::read(&there).unwrap(), b"mine");
    refused(1, &done, &dir.path().join("none/a.mcap"), &[], &["cannot be written"]);
    refused(2, &done, &done.join("cloud.ply"), &[], &["that folder's own files"]);
    let out = dir.path().join("a.mcap");
    refused(2, &done, &out, &["--rate", "0"], &["a rate of 0 shots per second", "0.001 to 100000"]);
    refused(2, &done, &out, &["--frame", "base=laser"], &["both be named 'laser'"]);
}

/// The disk is full from 100 kB on: no file, nothing half-written.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("a.mcap");
    let program = env!("CARGO_BIN_EXE_sheetlight");
    let call = format!("trap '' XFSZ; ulimit -f 100; exec {program} mcap {} --out {}", text(&at("done")), text(&out));
    let done = std::process::Command::new("bash").args(["-c", &call]).output().unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(!done.status.success() && said.contains("cannot be written"), "{said}");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{said}");
}
