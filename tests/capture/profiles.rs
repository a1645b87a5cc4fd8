//! In: a test device that sends heights over GigE Vision, the poses of a robot. Out: whether each place of each profile
//! is recorded as its bytes say, with its pose, scans to where it was, and what is not understood is refused.
//! Frame and unit: the camera's A and C as x and z, base frame, mm.

use super::device::{Device, Faults, Several};
use super::text;
use crate::common::tries::{judged, tries};
use crate::common::{sheetlight, sheetlight_fails};
use nalgebra::DMatrix;
use sheetlight::geometry::{Base, Flange, Rigid, Sensor, Vec3};
use sheetlight::raster::Image;
use sheetlight::rig::{Calibration, Covariance, Kind, Quality, Rig, Verdict};
use std::net::Ipv4Addr;
use std::path::Path;
use std::process::Command;

const TRIES: usize = 8;
const WIDTH: u32 = 64;
const SHOTS: u64 = 12;
/// Scale and offset of A and of C, mm; single precision holds them exactly.
const A: [f32; 2] = [0.25, -8.0];
const C: [f32; 2] = [0.015625, 90.0];

fn address(last: u8) -> Ipv4Addr {
    Ipv4Addr::new(127, 0, 78, last)
}

/// The number of a place; 0 is not measured.
fn number(shot: u32, column: u32) -> u16 {
    if column % 7 == 3 { 0 } else { (1000 + 37 * shot + 5 * column) as u16 }
}

fn pictures(rows: u32) -> Vec<Image> {
    let levels = |shot: u32| (0..rows * WIDTH).map(|i| number(shot + i / WIDTH, i % WIDTH)).collect();
    (0..SHOTS as u32).map(|shot| Image::from_u16(WIDTH, rows, 16, levels(shot))).collect()
}

fn pose(shot: usize) -> Rigid<Base, Flange> {
    Rigid::from_vectors(&Vec3::new(3.0, 0.1, -0.05), Vec3::new(400.0 + 0.5 * shot as f64, -20.0, 300.0))
}

fn poses(at: &Path) {
    let names: Vec<String> = (0..16).map(|i| format!("m{}{}", i / 4, i % 4)).collect();
    let rows = (0..SHOTS as usize).map(|shot| {
        let numbers: Vec<String> = pose(shot).to_rows().iter().map(f64::to_string).collect();
        format!("{shot},{}\n", numbers.join(","))
    });
    std::fs::write(at, format!("frame,{}\n", names.join(",")) + &rows.collect::<String>()).unwrap();
}

/// What `record` made of the shots of a camera with these faults, with their poses.
fn recorded(last: u8, faults: Faults) -> tempfile::TempDir {
    tries(TRIES, || {
        let dir = tempfile::tempdir().unwrap();
        let device = Device::start(address(last), pictures(1), 25.0, SHOTS, faults);
        let (out, file) = (text(&dir.path().join("rec")), dir.path().join("poses.csv"));
        poses(&file);
        let (camera, file, shots) = (format!("gige://{}", address(last)), text(&file), SHOTS.to_string());
        let args = ["record", "--camera", &camera, "--pair", "count", "--poses", &file, "--shots", &shots];
        let args = [&args[..], &["--seconds", "10", "--json", "--out", &out]].concat();
        let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(&args).output().unwrap();
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        if !done.status.success() {
            return Err(said);
        }
        let report: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
        drop(device);
        judged(dir, report["shots"] == SHOTS, report)
    })
}

/// The bytes' numbers, scaled here by hand.
fn holds_every_place(out: &Path) {
    for shot in 0..SHOTS as u32 {
        let csv = std::fs::read_to_string(out.join(format!("profiles/profile_{shot:06}.csv"))).unwrap();
        let rows: Vec<&str> = csv.lines().skip(1).collect();
        assert_eq!(rows.len(), WIDTH as usize);
        for (column, row) in (0..WIDTH).zip(rows) {
            let (x, z) = row.split_once(',').unwrap();
            let n = number(shot, column);
            assert!((x.parse::<f64>().unwrap() - (-8.0 + 0.25 * f64::from(column))).abs() < 1e-9, "{row}");
            match z.parse::<f64>() {
                Ok(z) if z.is_finite() => assert!((z - (90.0 + f64::from(n) / 64.0)).abs() < 1e-5, "{row} {n}"),
                _ => assert!(n == 0, "{row} {n}"),
            }
        }
    }
}

#[test]
fn heights_among_several_components_are_those_of_a_camera_without() {
    let heights = Faults { heights: Some([A, C]), ..Faults::default() };
    let several = Faults { several: Some(Several::Told), ..heights };
    let recorded = recorded(7, several);
    holds_every_place(&recorded.path().join("rec"));
    // The user's choice of a component remains, and without the others the heights arrive as a picture.
    let single = tries(TRIES, || {
        let dir = tempfile::tempdir().unwrap();
        let camera = format!("gige://{}", address(11));
        let _device = Device::start(address(11), pictures(1), 25.0, SHOTS, several);
        let out = dir.path().join("rec");
        let run = |args: &[&str]| {
            let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(args).args(["--camera", &camera]).output();
            let done = done.unwrap();
            let said = String::from_utf8_lossy(&done.stderr).into_owned() + &String::from_utf8_lossy(&done.stdout);
            if done.status.success() { Ok(said) } else { Err(said) }
        };
        let shown = run(&["camera", "show"])?;
        let value = |name: &str| shown.lines().find(|l| l.contains(name)).unwrap_or_default().to_owned();
        let own = value("ComponentSelector").contains("Reflectance") && value("PixelFormat").contains("Mono8");
        run(&["camera", "set", "ComponentEnable", "false"])?;
        let all = SHOTS.to_string();
        let said = run(&["record", "--shots", &all, "--seconds", "10", "--out", &text(&out)])?;
        let read = sheetlight::recording::profiles::load(&out.join("profiles")).unwrap();
        judged(dir, own && read.len() == SHOTS as usize, shown + &said)
    });
    holds_every_place(&single.path().join("rec"));
}

/// An independent reader of such payloads judges what the test device sends.
#[test]
fn aravis_reads_the_test_devices_parts_as_they_were() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/capture/parts.py");
    let read = || {
        let several = Faults { heights: Some([A, C]), several: Some(Several::Told), ..Faults::default() };
        let _device = Device::start(address(12), pictures(1), 50.0, SHOTS, several);
        Command::new("/usr/bin/python3").args([script, &address(12).to_string(), &SHOTS.to_string()]).output()
    };
    tries(TRIES, || {
        let done = read().unwrap();
        let (said, wrong) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
        if ["No module named", "Namespace Aravis", "this Aravis is older"].iter().any(|w| wrong.contains(w)) {
            assert!(std::env::var("CI").is_err(), "{wrong}");
            eprintln!("SKIPPED: Aravis for Python (Debian gir1.2-aravis-0.8, python3-gi) is not installed: {wrong}");
            return Ok(());
        }
        let rows: Vec<serde_json::Value> = said.lines().map(|row| serde_json::from_str(row).unwrap()).collect();
        let hex = |bytes: Vec<u8>| bytes.iter().map(|b| format!("{b:02x}")).collect::<String>();
        let want = |shot: u32| {
            let light = (0..WIDTH).map(|c| number(shot, c).to_le_bytes()[0]).collect();
            let heights = (0..WIDTH).flat_map(|c| number(shot, c).to_le_bytes()).collect();
            serde_json::json!({"status": "success", "payload": "multipart", "parts": [
                ["2d-image", 0x0108_0001, [WIDTH, 1], hex(light)],
                ["3d-image", 0x0110_00b8, [WIDTH, 1], hex(heights)],
            ]})
        };
        judged((), rows.iter().cloned().eq((0..SHOTS as u32).map(want)), format!("{said} {wrong}"))
    });
}

/// Each packet of a payload matters: what was lost and is not sent again makes it incomplete, never wrong.
#[test]
fn lost_packets_of_several_components_are_asked_for_or_reported() {
    let several =
        Faults { heights: Some([A, C]), several: Some(Several::Told), lost_per_mille: 40, ..Faults::default() };
    let tried = |last: u8, faults: Faults, good: &dyn Fn(u64, u64, u64) -> bool| {
        tries(TRIES, || {
            let dir = tempfile::tempdir().unwrap();
            let device = Device::start(address(last), pictures(1), 50.0, 60, faults);
            let (out, camera) = (text(&dir.path().join("rec")), format!("gige://{}", address(last)));
            let args = ["record", "--camera", &camera, "--shots", "60", "--seconds", "4", "--json", "--out", &out];
            let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(args).output().unwrap();
            let report: serde_json::Value = serde_json::from_slice(&done.stdout)
                .map_err(|e| format!("{e}: {}", String::from_utf8_lossy(&done.stderr)))?;
            let lost = device.lost.load(std::sync::atomic::Ordering::Relaxed);
            let of = |name: &str| report["account"][name].as_u64().unwrap_or(0);
            judged(dir, good(lost, of("used"), of("resent")), report)
        })
    };
    let asked =
        tried(9, Faults { resends: true, ..several }, &|lost, shots, resent| lost > 0 && shots > 57 && resent > 0);
    drop(asked);
    let recorded = tried(10, several, &|lost, shots, _| lost > 0 && shots > 30 && shots < 60);
    let read = sheetlight::recording::profiles::load(&recorded.path().join("rec/profiles")).unwrap();
    for profile in &read {
        let is = |shot: u32| {
            (0..WIDTH).zip(&profile.points).all(|(column, p)| {
                let n = number(shot, column);
                if n == 0 { p[1].is_nan() } else { (p[1] - (90.0 + f64::from(n) / 64.0)).abs() < 1e-5 }
            })
        };
        assert!((0..SHOTS as u32).any(is), "{:?}", profile.points);
    }
}

#[test]
fn heights_over_gige_vision_are_recorded_with_poses_and_scanned() {
    let recorded = recorded(1, Faults { heights: Some([A, C]), ..Faults::default() });
    let out = recorded.path().join("rec");
    holds_every_place(&out);
    let source = super::json(&out.join("source.json"));
    assert_eq!(source["coordinates"]["output_mode"], "RectifiedC", "{source}");
    // The whole way: each place lies where sensor and robot put it.
    let station = recorded.path().join("station");
    let sensor: Rigid<Flange, Sensor> = Rigid::from_vectors(&Vec3::new(0.02, -0.01, 1.5), Vec3::new(30.0, 5.0, 70.0));
    let quality = Quality {
        verdict: Verdict::Good,
        reasons: vec![],
        advice: vec![],
        figures: Default::default(),
        per_picture: vec![],
    };
    let names = ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"];
    let covariance = Covariance::new(&names, &DMatrix::identity(6, 6).scale(1e-8));
    sheetlight(&["station", "new", "--station", &text(&station)]);
    Rig::store(&station, &Calibration::new(Kind::ProfileHandEye, sensor, None, covariance, quality), None).unwrap();
    let (scan, profiles, file) =
        (recorded.path().join("scan"), text(&out.join("profiles")), text(&out.join("poses.csv")));
    let (station, to) = (text(&station), text(&scan));
    let args = ["scan-profiles", &profiles, "--poses", &file, "--station", &station, "--sigma-mm", "0.01"];
    sheetlight(&[&args[..], &["--out", &to]].concat());
    let cloud = sheetlight::station::cloud_of(&scan).unwrap();
    let measured = (0..SHOTS as u32).flat_map(|s| (0..WIDTH).map(move |c| (s, c))).filter(|&(s, c)| number(s, c) > 0);
    let measured: Vec<(u32, u32)> = measured.collect();
    assert_eq!(cloud.len(), measured.len());
    for (p, (shot, column)) in cloud.iter().zip(measured) {
        assert_eq!((p.shot, p.u, p.v), (shot, column as f32, 0.0));
        let x = -8.0 + 0.25 * f64::from(column);
        let z = 90.0 + f64::from(number(shot, column)) / 64.0;
        let want = (pose(shot as usize) * sensor).point(&Vec3::new(x, 0.0, z));
        assert!((p.at() - want).norm() < 1e-3, "shot {shot} column {column}: {} {want}", p.at());
    }
}

#[test]
fn cameras_whose_heights_cannot_be_used_are_refused_by_name() {
    let camera = |last: u8| format!("gige://{}", address(last));
    let heights = Faults { heights: Some([A, C]), ..Faults::default() };
    let says = |device: Device, args: &[&str], words: &[&str]| {
        tries(TRIES, || {
            let said = sheetlight_fails(args).1;
            judged((), words.iter().all(|w| said.contains(w)), said)
        });
        drop(device);
    };
    let dir = tempfile::tempdir().unwrap();
    let out = text(&dir.path().join("out"));
    // What it sends is no length.
    let device = Device::start(address(2), pictures(1), 50.0, 5, Faults { uncalibrated: true, ..heights });
    let args = ["record", "--camera", &camera(2), "--shots", "5", "--seconds", "5", "--out", &out];
    says(device, &args, &["Scan3dOutputMode is UncalibratedC", "choose RectifiedC"]);
    // A view needs light.
    let device = Device::start(address(3), pictures(1), 50.0, 5, heights);
    says(device, &["camera", "snap", &out, "--camera", &camera(3)], &["sends coordinates", "scan-profiles"]);
    // Several rows of a picture have one pose only where the robot stands still.
    let (device, file) = (Device::start(address(4), pictures(3), 50.0, 5, heights), dir.path().join("p.csv"));
    poses(&file);
    let file = text(&file);
    let args = ["record", "--camera", &camera(4), "--pair", "count", "--poses", &file, "--seconds", "5", "--out", &out];
    says(device, &args, &["Height is 3", "Height 1"]);
    // Parts that it does not announce, and a payload that is neither a picture nor parts.
    for (last, several) in [(5, Several::Unsaid), (8, Several::Foreign)] {
        let other = Faults { several: Some(several), ..heights };
        let device = Device::start(address(last), pictures(1), 50.0, 500, other);
        let out = text(&dir.path().join(last.to_string()));
        let args = ["record", "--camera", &camera(last), "--seconds", "20", "--out", &out];
        says(device, &args, &["another payload than a picture", "GenDC", "one component"]);
    }
}

/// Profiles without poses, three in a picture, and the camera's features can be shown while it sends heights.
#[test]
fn rows_are_profiles_of_their_own_where_nothing_moves() {
    tries(TRIES, || {
        let dir = tempfile::tempdir().unwrap();
        let heights = Faults { heights: Some([A, C]), ..Faults::default() };
        let _device = Device::start(address(6), pictures(3), 25.0, 4, heights);
        let camera = format!("gige://{}", address(6));
        let run = |args: &[&str]| {
            let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).args(args).output().unwrap();
            let said = String::from_utf8_lossy(&done.stderr).into_owned() + &String::from_utf8_lossy(&done.stdout);
            if done.status.success() { Ok(said) } else { Err(said) }
        };
        let shown = run(&["camera", "show", "--camera", &camera])?;
        assert!(shown.contains("PixelFormat") && shown.contains("Coord3D_C16"), "{shown}");
        let out = text(&dir.path().join("rec"));
        let said = run(&["record", "--camera", &camera, "--shots", "4", "--seconds", "8", "--out", &out])?;
        let read = sheetlight::recording::profiles::load(&dir.path().join("rec/profiles")).unwrap();
        if read.len() == 12 {
            // The second row of the third picture.
            let z = read[7].points[11][1];
            assert!((z - (90.0 + f64::from(number(3, 11)) / 64.0)).abs() < 1e-5, "{z}");
        }
        judged((), read.len() == 12 && !dir.path().join("rec/poses.csv").exists(), said)
    });
}
