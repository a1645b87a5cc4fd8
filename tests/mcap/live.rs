//! In: frames of a simulated recording on a pipe. Out: whether the messages of `live --mcap` have the points that its
//! lines have, and whether options that exclude each other are explained. Frame and unit: camera frame; mm in lines,
//! metres in messages.

use super::wire::{Wire, points};
use super::{MADE, text};
use mcap::MessageStream;
use sheetlight::raster::{Channel, load};
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

fn live(words: &[&str], frames: usize) -> Output {
    let station = text(&MADE.path().join("station"));
    let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args(["live", "--raw", "320x240:gray8", "--on", "cpu", "--station", &station])
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
    let done = live(&["--points", "--mcap", &file], 8);
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
    assert_eq!(filed.last().unwrap().0, 7, "the last frame is never skipped");
    // The same as a stream. Of several frames a busy machine skips others each time, and learns another stripe from the
    // first ones; a single frame is always measured.
    let (one, done) = (text(&dir.path().join("one.mcap")), live(&["--mcap", "-"], 1));
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(live(&["--mcap", &one], 1).status.success());
    let streamed = profiles(&done.stdout);
    assert!(streamed.len() == 1 && streamed == profiles(&std::fs::read(&one).unwrap()));
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
