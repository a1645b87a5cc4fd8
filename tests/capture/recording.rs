//! In: a recording that is played as a camera. Out: the same pictures and the same cloud after recording, scanning
//! while recording and scanning alone; what a crash, a second recorder and a full disk leave.
//! Frame and unit: bytes, pictures.

use super::{cloud_of, json, scan_folder, station, text};
use crate::common::tries::{judged, tries};
use crate::common::wait::until;
use crate::common::{sheetlight, sheetlight_fails};
use sheetlight::capture::Account;
use sheetlight::recording::Recording;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Every picture equals the original's, every pose too.
fn same_pictures(recorded: &Path, original: &Path) -> usize {
    let (a, b) = (Recording::open(recorded).unwrap(), Recording::open(original).unwrap());
    let (pa, pb) = (a.poses(None).unwrap(), b.poses(None).unwrap());
    let pairs = a.meta.frames.iter().zip(&b.meta.frames);
    for (fa, fb) in pairs {
        let (na, nb) = (fa.laser.as_ref().unwrap(), fb.laser.as_ref().unwrap());
        assert_eq!(a.picture(na).unwrap(), b.picture(nb).unwrap(), "{na}");
        assert_eq!(pa[fa.pose.unwrap()], pb[fb.pose.unwrap()], "{na}");
    }
    a.meta.frames.len()
}

fn account(value: &serde_json::Value) -> Account {
    serde_json::from_value(value.clone()).unwrap()
}

/// A camera loses what a machine that stands still does not take from it: then there is less to compare, and it is
/// tried again. What became of each is told in any case.
fn all_used(account: &serde_json::Value) -> Result<(), String> {
    let a = self::account(account);
    assert_eq!(a.unexplained(), 0, "{a}");
    judged((), (a.sent, a.used) == (24, 24), a)
}

#[test]
fn what_is_recorded_is_what_was_sent_and_scans_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let want = cloud_of(&scan_folder(), &dir.path().join("file"));
    let camera = format!("play:{}?rate=30", text(&scan_folder()));
    for store in ["png", "raw", "auto"] {
        let out = dir.path().join(store);
        let to = text(&out);
        let args = ["record", "--camera", &camera, "--pair", "given", "--out", &to, "--store", store, "--json"];
        tries(5, || {
            let _ = std::fs::remove_dir_all(&out);
            let report: serde_json::Value = serde_json::from_str(&sheetlight(&args)).unwrap();
            all_used(&report["account"])
        });
        assert_eq!(same_pictures(&out, &scan_folder()), 24);
        // Raw frames are what is asked for, or what a busy machine makes of auto.
        assert!(store == "auto" || out.join("pictures.raw").exists() == (store == "raw"));
        assert!(cloud_of(&out, &dir.path().join(format!("{store} scan"))) == want, "{store}: another cloud");
    }
    // While it runs: alone, and recorded beside.
    let kept = dir.path().join("kept");
    for (name, more) in [("alone", vec![]), ("beside", vec!["--record".to_owned(), text(&kept)])] {
        let out = dir.path().join(name);
        let (to, station) = (text(&out), station());
        let mut args = vec!["scan", "--camera", &camera, "--pair", "given", "--station", &station, "--out", &to];
        args.extend(["--on", "cpu", "--overlays", "0", "--quiet"]);
        args.extend(more.iter().map(String::as_str));
        tries(5, || {
            let _ = [&out, &kept].map(std::fs::remove_dir_all);
            sheetlight(&args);
            all_used(&json(&out.join("scan.json"))["camera"])
        });
        assert!(std::fs::read(out.join("cloud.ply")).unwrap() == want, "{name}: another cloud");
    }
    assert_eq!(same_pictures(&kept, &scan_folder()), 24);
}

#[test]
fn the_rooms_light_is_taken_out_of_a_cameras_pictures_as_of_a_files() {
    let dir = tempfile::tempdir().unwrap();
    let size = Recording::open(&scan_folder()).unwrap().meta.image;
    let grey = |name: &str, width: u32| {
        let path = dir.path().join(name);
        image::GrayImage::from_pixel(width, size.height, image::Luma([4])).save(&path).unwrap();
        text(&path)
    };
    let (room, narrow) = (grey("room.png", size.width), grey("narrow.png", size.width / 2));
    let (recording, station) = (text(&scan_folder()), station());
    let camera = format!("play:{recording}?rate=30");
    let file = ["scan", &recording];
    let wire = ["scan", "--camera", &camera, "--pair", "given"];
    let scanned = |from: &[&str], name: &str, more: &[&str]| {
        let out = dir.path().join(name);
        let to = text(&out);
        let common = ["--station", &station, "--out", &to, "--on", "cpu", "--overlays", "0", "--quiet"];
        tries(5, || {
            let _ = std::fs::remove_dir_all(&out);
            sheetlight(&[from, &common, more].concat());
            let camera = &json(&out.join("scan.json"))["camera"];
            if camera.is_null() { Ok(()) } else { all_used(camera) }
        });
        std::fs::read(out.join("cloud.ply")).unwrap()
    };
    let lit = scanned(&wire, "lit", &["--ambient", &room]);
    assert!(lit == scanned(&file, "file", &["--ambient", &room]), "another cloud than the file's");
    assert!(lit != scanned(&wire, "dark", &[]), "--ambient changes nothing");
    let to = text(&dir.path().join("refused"));
    let (_, said) =
        sheetlight_fails(&[&wire[..], &["--station", &station, "--out", &to, "--ambient", &narrow]].concat());
    assert!(said.contains(&format!("is {}x{}", size.width / 2, size.height)), "{said}");
}

#[test]
fn a_recorder_that_is_killed_leaves_all_but_the_last_second() {
    let camera = format!("play:{}?rate=40&loops=1000", text(&scan_folder()));
    let cut = tries(5, || {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("cut");
        let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
            .args(["record", "--camera", &camera, "--pair", "given", "--out", &text(&out), "--quiet"])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // It can be opened while it runs.
        let recorded = until(|| Recording::open(&out).is_ok_and(|r| r.meta.frames.len() > 40));
        let said = sheetlight_fails(&["record", "--camera", &camera, "--out", &text(&out)]).1;
        let killed_ns = SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_nanos() as u64;
        child.kill().unwrap();
        child.wait().unwrap();
        assert!(recorded, "it does not begin");
        assert!(said.contains("another recorder"), "{said}");
        // As if it had been cut inside its last line and its last raw frame.
        let frames = std::fs::read(out.join("frames.jsonl")).unwrap();
        std::fs::write(out.join("frames.jsonl"), &frames[..frames.len() - 7]).unwrap();
        let recording = Recording::open(&out).unwrap();
        let taken: Vec<_> = recording.meta.frames.iter().map(|f| f.taken.as_ref().unwrap()).collect();
        recording.meta.frames.iter().for_each(|f| drop(recording.picture(f.laser.as_ref().unwrap()).unwrap()));
        let (first, last) = (taken[0], taken[taken.len() - 1]);
        let lost_s = killed_ns.saturating_sub(last.host_ns) as f64 * 1e-9;
        let all = taken.len() as u64 == last.id - first.id + 1;
        judged(dir, all && lost_s < 1.0, format!("{} of {} to {}, {lost_s:.2} s lost", taken.len(), first.id, last.id))
    });
    let out = cut.path().join("cut");
    assert!(!cloud_of(&out, &cut.path().join("scan")).is_empty());
    // What is there stays: nobody records over it.
    let said = sheetlight_fails(&["record", "--camera", &camera, "--out", &text(&out)]).1;
    assert!(said.contains("holds a recording") && said.contains("another folder"), "{said}");
}

#[test]
fn a_full_disk_ends_a_recording_that_stays_whole() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("full");
    // More pictures than fit, however many a machine that stands still does not take.
    let camera = format!("play:{}?rate=100&loops=1000", text(&scan_folder()));
    let run = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
        .args(["record", "--camera", &camera, "--pair", "given", "--out", &text(&out), "--store", "raw"])
        .env("SHEETLIGHT_FULL_AT", "25")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(!run.status.success() && said.contains("the disk is full") && said.contains("shots, whole"), "{said}");
    let recording = Recording::open(&out).unwrap();
    let n = recording.meta.frames.len();
    assert!((1..24).contains(&n), "{n}");
    recording.meta.frames.iter().for_each(|f| drop(recording.picture(f.laser.as_ref().unwrap()).unwrap()));
    assert!(said.contains("dropped by disk"), "{said}");
}

/// Memory that a process holds, kB.
fn held(pid: u32) -> Option<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?.trim().trim_end_matches(" kB").parse().ok()
}

/// Short: 320x240, two seconds. `SHEETLIGHT_LONG`: 640x480 for 60 s, memory flat within 5 MB after 10 s.
#[test]
fn two_hundred_a_second_are_recorded_and_scanned_at_once_or_counted() {
    let long = std::env::var("SHEETLIGHT_LONG").is_ok();
    let dir = tempfile::tempdir().unwrap();
    let (played, seconds) = if long {
        let out = text(&dir.path().join("sim"));
        sheetlight(&["simulate", "--out", &out, "--shots", "60", "--quiet"]);
        (dir.path().join("sim/scan"), 60)
    } else {
        (scan_folder(), 2)
    };
    let station = if long { text(&dir.path().join("sim/station")) } else { station() };
    let (kept, out) = (dir.path().join("kept"), dir.path().join("scan"));
    let camera = format!("play:{}?rate=200&loops=1000000", text(&played));
    let memory = tries(5, || {
        let _ = [&kept, &out].map(std::fs::remove_dir_all);
        let mut child = Command::new(env!("CARGO_BIN_EXE_sheetlight"))
            .args(["scan", "--camera", &camera, "--pair", "given", "--seconds", &seconds.to_string(), "--quiet"])
            .args(["--record", &text(&kept), "--station", &station, "--out", &text(&out), "--overlays", "0"])
            .args(["--on", "cpu", "--memory", "4"])
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        let mut memory: Vec<(f64, u64)> = Vec::new();
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status;
            }
            memory.extend(held(child.id()).map(|kb| (begun.elapsed().as_secs_f64(), kb)));
            std::thread::sleep(Duration::from_millis(100));
        };
        assert!(status.success());
        let a = account(&json(&out.join("scan.json"))["camera"]);
        let recorded = Recording::open(&kept).unwrap().meta.frames.len() as u64;
        println!("200 a second for {seconds} s: {a}");
        assert_eq!((a.unexplained(), a.used), (0, recorded), "{a}");
        assert_eq!(json(&out.join("scan.json"))["shots"].as_u64(), Some(recorded), "what is recorded is scanned");
        judged(memory, a.sent >= 180 * (seconds as u64 - 1), a)
    });
    // Until the scan's own products are made. Of pictures that wait, 4 MB (--memory) may come and go.
    let from_10_s = memory.iter().filter(|(t, _)| (10.0..f64::from(seconds) - 1.0).contains(t)).map(|(_, kb)| *kb);
    let (least, most) = (from_10_s.clone().min().unwrap_or(0), from_10_s.max().unwrap_or(0));
    println!("memory after 10 s {least} to {most} kB");
    if long {
        assert!(most - least < 5 * 1024, "{least} to {most} kB");
    }
}
