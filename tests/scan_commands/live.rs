//! In: frames of a simulated recording on a pipe. Out: the live measurement of the newest is the one of the scan's own
//! stages, and every frame is either measured, passed over or has no stripe. Frame and unit: camera frame, mm.

use crate::common::sheetlight;
use sheetlight::raster::{Channel, load};
use std::io::Write;
use std::process::{Command, Stdio};

#[test]
fn the_newest_frame_is_measured_and_the_rest_is_counted() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("sim").to_str().unwrap().to_owned();
    sheetlight(&["simulate", "--out", &out, "--width", "320", "--shots", "12", "--quiet"]);
    let mut files: Vec<_> = std::fs::read_dir(dir.path().join("sim/scan"))
        .unwrap()
        .map(|f| f.unwrap().path())
        .filter(|p| p.file_name().unwrap().to_str().unwrap().starts_with("laser"))
        .collect();
    files.sort();
    let frames: Vec<_> = files.iter().map(|f| load(f, Channel::Luma, 8).unwrap().to_u8()).collect();
    let station = dir.path().join("sim/station");
    let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args(["live", "--raw", "320x240:gray8", "--points", "--station", station.to_str().unwrap()])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = child.stdin.take().unwrap();
    for frame in &frames {
        pipe.write_all(frame).unwrap();
    }
    drop(pipe);
    let done = child.wait_with_output().unwrap();
    let talk = String::from_utf8(done.stderr).unwrap();
    assert!(done.status.success(), "{talk}");
    let lines: Vec<serde_json::Value> = String::from_utf8(done.stdout)
        .unwrap()
        .lines()
        .map(|l| serde_json::from_str(l).expect("one JSON object a line"))
        .collect();
    let last = lines.last().expect("the last frame is never passed over");
    assert_eq!(last["frame"], frames.len() as u64 - 1, "{talk}");
    let passed = last["passed_over"].as_u64().unwrap() as usize;
    assert!(talk.contains(&format!("{} frames: {} measured", frames.len(), lines.len())), "{talk}");
    assert!(lines.len() + passed <= frames.len(), "{talk}");
    // A board at some 150 mm: points lie in front of the camera, within the station's working volume.
    let points = last["xyz_sigma_mm"].as_array().unwrap();
    assert!(points.len() as u64 == last["points"].as_u64().unwrap() && points.len() > 50, "{} points", points.len());
    for p in points {
        let z = p[2].as_f64().unwrap();
        assert!((50.0..400.0).contains(&z), "{p}");
    }
}
