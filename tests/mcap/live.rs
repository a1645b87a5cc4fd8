//! In: frames of a simulated recording on a pipe. Out: whether the messages of `live --mcap` have the points that its
//! lines have, and whether options that exclude each other are explained. Frame and unit: camera frame; mm in lines,
//! metres in messages.

use super::wire::{Wire, points};
use super::{MADE, text};
use mcap::MessageStream;
use sheetlight::raster::{Channel, load};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// The station with a stripe that is stated. One that is learned from the first pictures depends on which of them a
/// busy machine skips.
fn stated(dir: &Path) -> String {
    let (from, to) = (MADE.path().join("station"), dir.join("station"));
    std::fs::create_dir_all(to.join("calibration")).unwrap();
    for file in ["calibration/camera.json", "calibration/laser_plane.json"] {
        std::fs::copy(from.join(file), to.join(file)).unwrap();
    }
    let settings = std::fs::read_to_string(from.join("station.toml")).unwrap();
    assert!(settings.contains("measure_stripe = true"));
    let settings = settings.replace("measure_stripe = true", "measure_stripe = false");
    std::fs::write(to.join("station.toml"), settings).unwrap();
    text(&to)
}

fn live(words: &[&str], frames: usize) -> Output {
    live_at(&text(&MADE.path().join("station")), words, frames)
}

fn live_at(station: &str, words: &[&str], frames: usize) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args(["live", "--raw", "320x240:gray8", "--on", "cpu", "--station", station])
        .args(words)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut pipe = child.stdin.take().unwrap();
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(MADE.path().join("scan")).unwrap().map(|f| f.unwrap().path()).collect();
    files.retain(|p| p.file_name().unwrap().to_str().unwrap().starts_with("laser"));
    files.sort();
    for file in &files[..frames] {
        // A command that refuses its options reads nothing.
        let _ = pipe.write_all(&load(file, Channel::Luma, 8).unwrap().to_u8());
    }
    drop(pipe);
    child.wait_with_output().unwrap()
}

/// The profiles of a stream: shot, and x y z sigma in metres of its points.
fn profiles(bytes: &[u8]) -> Vec<(u32, Vec<[f32; 4]>)> {
    let (mut all, mut topics) = (Vec::new(), Vec::new());
    for message in MessageStream::new(bytes).unwrap() {
        let message = message.unwrap();
        topics.push(message.channel.topic.clone());
        if message.channel.topic == "/sheetlight/profile" {
            let header = Wire::new(&message.data).header("camera");
            assert_eq!(header, message.log_time);
            let read = points(&message.data, "camera");
            assert!(read.iter().all(|(p, _)| p.shot == read[0].0.shot && p.intensity > 0.0 && p.quality <= 1.0));
            all.push((read[0].0.shot, read.into_iter().map(|(_, p)| p).collect()));
        }
    }
    assert_eq!(topics[0], "/tf_static");
    assert_eq!(topics.last().unwrap(), "/diagnostics");
    assert_eq!(topics.len(), all.len() + 2);
    all
}

#[test]
fn messages_of_a_running_camera_have_the_points_of_its_lines() {
    let dir = tempfile::tempdir().unwrap();
    let file = text(&dir.path().join("live.mcap"));
    let station = stated(dir.path());
    let done = live_at(&station, &["--points", "--mcap", &file], 8);
    let talk = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{talk}");
    let lines: Vec<serde_json::Value> =
        String::from_utf8(done.stdout).unwrap().lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let filed = profiles(&std::fs::read(&file).unwrap());
    assert_eq!(filed.len(), lines.len(), "{talk}");
    for ((shot, points), line) in filed.iter().zip(&lines) {
        assert_eq!(u64::from(*shot), line["frame"].as_u64().unwrap());
        let wanted = line["xyz_sigma_mm"].as_array().unwrap();
        assert!(points.len() == wanted.len() && points.len() > 50, "{} of {}", points.len(), wanted.len());
        for (point, wanted) in points.iter().zip(wanted) {
            for (is, mm) in point.iter().zip(wanted.as_array().unwrap()) {
                let metres = mm.as_f64().unwrap() / 1000.0;
                let step = f64::from((metres as f32).next_up() - (metres as f32)).abs();
                assert!((f64::from(*is) - metres).abs() <= step, "{is} is not {metres}");
            }
        }
    }
    // The same as a stream. Which frames are skipped is a matter of time; the last one never is.
    let done = live_at(&station, &["--mcap", "-"], 8);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let streamed = profiles(&done.stdout);
    assert_eq!((filed.last().unwrap().0, streamed.last().unwrap().0), (7, 7));
    for (shot, points) in &streamed {
        let same = filed.iter().find(|(s, _)| s == shot);
        assert!(same.is_none_or(|(_, there)| there == points), "shot {shot}");
    }
}

#[test]
fn what_cannot_be_written_with_a_running_camera_is_explained() {
    let refused = |words: &[&str], code: i32, said: &str| {
        let done = live(words, 1);
        let text = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.code() == Some(code) && text.contains(said), "{words:?}: {text}");
    };
    refused(&["--points", "--mcap", "-"], 2, "--mcap - and --points: both would write to standard output");
    refused(&["--json", "--mcap", "-"], 2, "--mcap - and --json: both would write to standard output");
    let dir = tempfile::tempdir().unwrap();
    let there = dir.path().join("there.mcap");
    std::fs::write(&there, "mine").unwrap();
    refused(&["--mcap", &text(&there)], 2, "there.mcap: is there already");
    assert_eq!(std::fs::read(&there).unwrap(), b"mine");
}
