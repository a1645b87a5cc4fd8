//! In: every file that a command reads, replaced by a pipe, an endless device, a file of gigabytes, a folder,
//! nothing. Out: a fault within seconds and within 3 GB of addresses, and nothing that was there is gone.
//! Frame and unit: none.
#![cfg(target_os = "linux")]

use super::bench::{Bench, run};
use super::crashes::long;
use std::path::Path;
use std::process::Command;

/// What lies where a file is wanted.
const KINDS: [&str; 5] = ["a pipe", "an endless device", "3 GB of zeros", "a folder", "nothing"];

fn put(kind: &str, path: &Path) {
    let _ = std::fs::remove_file(path);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    match kind {
        "a pipe" => assert!(Command::new("mkfifo").arg(path).status().unwrap().success()),
        "an endless device" => std::os::unix::fs::symlink("/dev/zero", path).unwrap(),
        "3 GB of zeros" => std::fs::File::create(path).unwrap().set_len(3 << 30).unwrap(),
        "a folder" => std::fs::create_dir(path).unwrap(),
        _ => {}
    }
}

fn take_away(path: &Path) {
    match std::fs::symlink_metadata(path) {
        Ok(m) if m.is_dir() => std::fs::remove_dir_all(path).unwrap(),
        Ok(_) => std::fs::remove_file(path).unwrap(),
        Err(_) => {}
    }
}

/// A file that is read (`{}` stands for the bench's folder), and the command that reads it; where the file may be
/// missing, or is read past, the command may succeed.
const READ: [(&str, &str, bool); 32] = [
    ("x", "scan {}/recording --station {}/station --out {}/o --ambient {}/x --on cpu", false),
    ("x.json", "scan --raw 320x240:gray8 --poses {}/x.json --station {}/station --out {}/o --on cpu", false),
    ("x", "scan {}/recording --station {}/station --out {}/o --truth {}/x --on cpu", false),
    ("recording/meta.json", "scan {}/recording --station {}/station --out {}/o --on cpu", false),
    ("recording/poses.json", "scan {}/recording --station {}/station --out {}/o --on cpu", false),
    ("recording/1.png", "scan {}/recording --station {}/station --out {}/o --on cpu", false),
    ("station/station.toml", "scan {}/recording --station {}/station --out {}/o --on cpu", true),
    ("station/calibration/camera.json", "scan {}/recording --station {}/station --out {}/o --on cpu", false),
    ("station/calibration/camera.json", "station seal --station {}/station --kind camera --because why", false),
    ("part/scan.part/progress.json", "scan {}/recording --station {}/station --out {}/part --resume --on cpu", true),
    ("part/scan.part/cloud.ply.part", "scan {}/recording --station {}/station --out {}/part --resume --on cpu", true),
    ("x", "find {}/scan --recipe {}/x --out {}/pose.json", false),
    ("scan/scan.json", "find {}/scan --recipe {}/led.toml --out {}/pose.json", false),
    ("scan/cloud.ply", "find {}/scan --recipe {}/led.toml --out {}/pose.json", false),
    ("scan/height.tif", "find {}/scan --recipe {}/led.toml --out {}/pose.json", false),
    ("scan/found.json", "scan {}/recording --station {}/station --out {}/scan --on cpu", true),
    ("x", "model {}/x --name a --out {}/a.toml", false),
    ("x", "simulate --out {}/sim --scene {}/x", false),
    ("x", "simulate --out {}/sim --rig {}/x", false),
    ("x", "simulate --out {}/sim --board {}/x", false),
    ("x", "station import {}/x --station {}/station", false),
    ("x.csv", "calibrate hand-eye --board-poses {}/x.csv --poses {}/recording/poses.json --station {}/station", false),
    ("x.csv", "calibrate hand-eye --board-poses {}/boards.csv --poses {}/x.csv --station {}/station", false),
    (
        "x.csv",
        "calibrate profile-hand-eye {}/x.csv --poses {}/recording/poses.json --station {}/station --ball-diameter-mm \
         20",
        false,
    ),
    (
        "x.csv",
        "calibrate profile-hand-eye {}/x.csv --poses {}/recording/poses.json --station {}/station --plane",
        false,
    ),
    (
        "x.json",
        "calibrate profile-hand-eye {}/p.csv --poses {}/recording/poses.json --ball-diameter-mm 20 --evaluate \
         {}/x.json",
        false,
    ),
    ("x.png", "match {}/x.png {}/recording/1.png", false),
    ("x.png", "import-map {}/x.png --unit-mm 0.02 --spacing-mm 0.2,0.2 --missing 0 --out {}/o", false),
    (
        "x.png",
        "import-map {}/recording/1.png --unit-mm 0.02 --spacing-mm 0.2,0.2 --missing 0 --light {}/x.png --out {}/o",
        false,
    ),
    ("recording/meta.json", "record --camera play:{}/recording --out {}/o --shots 2", false),
    ("x", "record --camera play:{}/x --out {}/o --shots 2", false),
    ("x", "record --camera sim:1?scene={}/x --out {}/o --shots 2", false),
];

#[test]
fn whatever_lies_where_a_file_is_wanted() {
    let b = Bench::new(3);
    let here = b.dir.path().to_str().unwrap();
    let led = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes/led.toml");
    std::fs::copy(led, b.at("led.toml")).unwrap();
    let boards = "# transform: camera_T_board\n# convention: \
                  matrix\nframe,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23,m30,m31,m32,m33\n\
                  0,1,0,0,0,0,1,0,0,0,0,1,300,0,0,0,1\n";
    std::fs::write(b.at("boards.csv"), boards).unwrap();
    std::fs::write(b.at("p.csv"), "profile,x,z\n0,1.5,2.5\n0,2.5,3.5\n1,1,2\n1,2,3\n2,1,2\n2,2,3\n").unwrap();
    run(&b.scan("recording", "scan", &[]));
    std::fs::create_dir_all(b.at("part/scan.part")).unwrap();
    let (mut wrong, mut tried) = (Vec::new(), 0);
    for (i, (file, words, may_succeed)) in READ.into_iter().enumerate() {
        let path = b.at(file);
        let whole = std::fs::read(&path).ok();
        // The short form puts a pipe everywhere and the others by turns.
        let kinds = KINDS.iter().enumerate().filter(|(k, _)| long() || *k == 0 || *k == 1 + i % 4);
        for (_, kind) in kinds {
            put(kind, &path);
            // A limit of addresses, so that a read without a limit ends here and not on the machine; and of time.
            let line =
                format!("ulimit -v 3000000; exec timeout 20 \"$0\" {} --quiet </dev/null", words.replace("{}", here));
            let done = Command::new("bash").args(["-c", &line, env!("CARGO_BIN_EXE_sheetlight")]).output().unwrap();
            let said = String::from_utf8_lossy(&done.stderr);
            let good = match done.status.code() {
                Some(0) => may_succeed,
                Some(1 | 2) => said.contains("next step") && !said.contains("panicked"),
                _ => false,
            };
            if !good {
                wrong.push(format!("{kind} as {file}: {words}: {:?} {said}", done.status.code()));
            }
            tried += 1;
            take_away(&path);
            let _ = std::fs::remove_dir_all(b.at("o"));
            if let Some(bytes) = &whole {
                std::fs::create_dir_all(path.parent().unwrap()).unwrap();
                std::fs::write(&path, bytes).unwrap();
            }
        }
    }
    println!("{tried} inputs that are none");
    assert!(wrong.is_empty(), "{} of {tried}:\n{}", wrong.len(), wrong.join("\n"));
}
