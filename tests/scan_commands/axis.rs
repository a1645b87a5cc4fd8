//! In: one simulated sensor over one stepped block, moved by a robot, or standing still while a linear axis or a
//! turntable moves the block. Out: whether the scans are as accurate per pixel as the robot's, with the true axis and
//! with one calibrated from pictures, on GPU and twins; and what becomes of gaps, counts backward, uneven counts and
//! second passes.
//! Frame and unit: part frame of the block, mm.

use crate::common;
use crate::common::clouds::apart;
use crate::common::{sheetlight, sheetlight_fails};
use serde_json::{Value, json};
use sheetlight::geometry::{Base, Vec3, fit_plane};
use sheetlight::scan::{CloudPoint, read_cloud};
use sheetlight::simulate::rig_scene::{STEPS_MM, TREAD_MM};
use sheetlight::simulate::{RigSpec, Truth};
use std::path::{Path, PathBuf};

const RIG: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../data/rigs/paper.toml");

fn text(p: PathBuf) -> String {
    p.to_str().unwrap().to_owned()
}

fn simulated(at: &Path, motion: &str, sets: &str, shots: &str) {
    let out = text(at.to_owned());
    sheetlight(&[
        "simulate", "--rig", RIG, "--width", "320", "--motion", motion, "--set", sets, "--shots", shots, "--out", &out,
        "--quiet",
    ]);
}

fn scanned(at: &Path, recording: &str, out: &str, more: &[&str]) -> (Value, Vec<CloudPoint>) {
    let (recording, station, out) = (text(at.join(recording)), text(at.join("station")), at.join(out));
    let folder = text(out.clone());
    let mut args = vec!["scan", &recording, "--station", &station, "--out", &folder, "--overlays", "0", "--quiet"];
    args.extend(if more.contains(&"--on") { &[][..] } else { &["--on", "cpu"] });
    args.extend(more);
    sheetlight(&args);
    let report = serde_json::from_slice(&std::fs::read(out.join("scan.json")).unwrap()).unwrap();
    (report, read_cloud(&out.join("cloud.ply")).unwrap())
}

fn refused(at: &Path, out: &str) -> String {
    let (recording, station, out) = (text(at.join("scan")), text(at.join("station")), text(at.join(out)));
    sheetlight_fails(&["scan", &recording, "--station", &station, "--out", &out, "--on", "cpu"]).1
}

/// Own-plane rms of the treads, largest error of a rise, points on the treads, and their median stated sigma; mm.
#[derive(Debug)]
struct Found {
    rms: f64,
    steps: f64,
    points: usize,
    sigma: f64,
}

fn judged(cloud: &[CloudPoint], truth: &Path) -> Found {
    let u = RigSpec::paper().scale();
    let truth = Truth::load(truth).unwrap();
    let steps = truth.file.parts.iter().find(|p| p.name == "steps").unwrap().base_from_part;
    let back = steps.inverse();
    let (mut top, mut square, mut sigmas) = (0.0, 0.0, Vec::new());
    let mut heights = Vec::new();
    for (i, rise) in [0.0].iter().chain(&STEPS_MM).enumerate() {
        top += rise * u;
        let x = TREAD_MM[0] * (i as f64 - 2.0) * u;
        let on: Vec<(Vec3, f32)> = cloud
            .iter()
            .map(|p| (back.point(&p.at()), p.sigma_mm))
            .filter(|(q, _)| {
                (q.x - x).abs() < 0.3 * TREAD_MM[0] * u
                    && q.y.abs() < 0.35 * TREAD_MM[1] * u
                    && (q.z - top).abs() < 0.4 * u
            })
            .collect();
        assert!(on.len() > 60, "tread {i} has {} points", on.len());
        let places: Vec<Vec3> = on.iter().map(|o| o.0).collect();
        let (plane, rms) = fit_plane::<Base>(&places).unwrap();
        square += rms * rms * on.len() as f64;
        sigmas.extend(on.iter().map(|o| f64::from(o.1)));
        let n = plane.normal;
        heights.push((plane.offset - n.x * x) / n.z);
    }
    let rises = heights.windows(2).zip(STEPS_MM).map(|(h, rise)| (h[1] - h[0] - rise * u).abs());
    sigmas.sort_by(f64::total_cmp);
    Found {
        rms: (square / sigmas.len() as f64).sqrt(),
        steps: rises.fold(0.0, f64::max),
        points: sigmas.len(),
        sigma: sigmas[sigmas.len() / 2],
    }
}

/// The calibration's verdict and reasons.
fn calibrated(at: &Path) -> Value {
    let (recording, station) = (text(at.join("axis")), text(at.join("station")));
    sheetlight(&["calibrate", "axis", &recording, "--station", &station, "--quiet"]);
    let name = if at.ends_with("linear") { "linear_axis" } else { "turntable" };
    let file = at.join("station/calibration").join(format!("{name}.json"));
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

#[test]
fn an_axis_scans_as_accurately_per_pixel_as_the_robot() {
    let dir = tempfile::tempdir().unwrap();
    let at = |n: &str| dir.path().join(n);
    simulated(&at("robot"), "robot", "scan", "26");
    let robot = judged(&scanned(&at("robot"), "scan", "out", &[]).1, &at("robot/scan/truth.json"));
    println!("robot: {robot:?}");
    for (motion, shots) in [("linear", "26"), ("turntable", "90")] {
        let (at, truth) = (at(motion), at(motion).join("scan/truth.json"));
        simulated(&at, motion, "axis,scan", shots);
        // Nothing of a robot is asked for.
        std::fs::remove_file(at.join("station/calibration/hand_eye.json")).unwrap();
        let (report, cloud) = scanned(&at, "scan", "true", &[]);
        assert_eq!(report["frame"], "axis");
        assert_eq!(report["motion"]["kind"], motion);
        let exact = judged(&cloud, &truth);
        println!("{motion}, true axis: {exact:?}");
        let c = calibrated(&at);
        println!("{motion}: {}, {}", c["quality"]["verdict"], c["quality"]["reasons"]);
        assert!(["good", "usable"].contains(&c["quality"]["verdict"].as_str().unwrap()));
        let own = judged(&scanned(&at, "scan", "own", &[]).1, &truth);
        println!("{motion}, calibrated: {own:?}");
        for (of, found) in [("true", &exact), ("calibrated", &own)] {
            assert!(found.rms < 1.15 * robot.rms, "{motion}, {of}: {:.4} mm, the robot's {:.4}", found.rms, robot.rms);
            let limit = 1.5 * robot.steps + 3.0 * robot.rms / (robot.points as f64 / 5.0).sqrt() + 0.001;
            assert!(found.steps < limit, "{motion}, {of}: a rise is {:.4} mm off, limit {limit:.4}", found.steps);
        }
        // What is not known of the axis is in the points' sigma.
        assert!(own.sigma > exact.sigma, "{} {}", own.sigma, exact.sigma);
        if common::device().is_some() && (motion == "turntable" || std::env::var_os("SHEETLIGHT_LONG").is_some()) {
            let gpu = scanned(&at, "scan", "gpu", &["--on", "gpu"]).1;
            let cpu = scanned(&at, "scan", "cpu", &[]).1;
            let a = apart(&cpu, &gpu);
            println!("{motion}: of {} points {a:?}", cpu.len());
            assert!(a.worst_mm < 1e-3 && a.alone * 10_000 <= cpu.len(), "{a:?} of {}", cpu.len());
        }
    }
}

#[test]
fn counts_are_taken_as_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path().join("linear");
    simulated(&at, "linear", "scan", "26");
    let truth = at.join("scan/truth.json");
    let read = || -> Value { serde_json::from_slice(&std::fs::read(at.join("scan/meta.json")).unwrap()).unwrap() };
    let write = |meta: &Value| std::fs::write(at.join("scan/meta.json"), meta.to_string()).unwrap();
    let whole = read();
    let frames = whole["frames"].as_array().unwrap().clone();
    let (_, usual) = scanned(&at, "scan", "usual", &[]);
    let plain = judged(&usual, &truth);
    let edited = |frames: Vec<Value>| {
        let mut meta = whole.clone();
        meta["frames"] = json!(frames);
        write(&meta);
    };
    let sorted = |mut cloud: Vec<CloudPoint>| {
        cloud.sort_by(|a, b| {
            a.position.to_array().map(|x| (x * 1e3) as i64).cmp(&b.position.to_array().map(|x| (x * 1e3) as i64))
        });
        cloud.into_iter().map(|p| p.position).collect::<Vec<_>>()
    };

    // A count that was lost: the shot is refused, or left out by name. Its neighbours stay where they are.
    let mut gap = frames.clone();
    for i in [7, 8, 15] {
        gap[i].as_object_mut().unwrap().remove("count");
    }
    edited(gap);
    let said = refused(&at, "gap");
    assert!(said.contains("frame 7") && said.contains("has no count") && said.contains("--skip-bad"), "{said}");
    let (report, cloud) = scanned(&at, "scan", "gap", &["--skip-bad"]);
    assert_eq!(report["skipped"].as_array().unwrap().len(), 3, "{}", report["skipped"]);
    assert!(cloud.iter().all(|p| ![7, 8, 15].contains(&p.shot)));
    let left = judged(&cloud, &truth);
    assert!(left.rms < 1.1 * plain.rms && left.steps < plain.steps + 0.01, "{left:?} {plain:?}");

    // Backward: the same points.
    edited(frames.iter().rev().cloned().collect());
    let back = sorted(scanned(&at, "scan", "back", &[]).1);
    let forth = sorted(usual.clone());
    assert!(back.len().abs_diff(forth.len()) * 200 < forth.len(), "{} {}", back.len(), forth.len());
    let found = judged(&scanned(&at, "scan", "back2", &[]).1, &truth);
    assert!((found.rms / plain.rms - 1.0).abs() < 0.03, "{found:?} {plain:?}");

    // Uneven: every shot whose number is no multiple of three.
    edited(frames.iter().enumerate().filter(|(i, _)| i % 3 != 1).map(|f| f.1.clone()).collect());
    let found = judged(&scanned(&at, "scan", "uneven", &[]).1, &truth);
    assert!(found.rms < 1.1 * plain.rms, "{found:?} {plain:?}");

    // Two passes, there and back: twice the points, as good.
    edited(frames.iter().chain(frames.iter().rev()).cloned().collect());
    let found = judged(&scanned(&at, "scan", "passes", &[]).1, &truth);
    assert!(found.points > 19 * plain.points / 10 && found.rms < 1.05 * plain.rms, "{found:?} {plain:?}");

    // An encoder that has counted for days, with its zero stated: the cloud lies where it lay.
    let mut far = whole.clone();
    far["motion"]["zero"] = json!(4_000_000_000u64);
    for f in far["frames"].as_array_mut().unwrap() {
        f["count"] = json!(f["count"].as_f64().unwrap() + 4e9);
    }
    write(&far);
    assert_eq!(sorted(scanned(&at, "scan", "far", &[]).1), forth);
    far["motion"].as_object_mut().unwrap().remove("zero");
    write(&far);
    let said = refused(&at, "far2");
    assert!(said.contains("from its zero") && said.contains("\"zero\""), "{said}");

    // Counts in another unit than the axis was calibrated in.
    let mut mm = whole.clone();
    mm["motion"]["unit"] = json!("mm");
    write(&mm);
    let said = refused(&at, "mm");
    assert!(said.contains("in 'mm'") && said.contains("calibrated in 'count'"), "{said}");
}

/// Poses are stated in the axis frame, and the report says so. On a turntable the stripe crosses the part in another
/// direction at every place. `SHEETLIGHT_LONG`: the linear axis too, and as many shots as the simulated station takes.
#[test]
fn a_part_on_an_axis_is_found_in_its_frame() {
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let dir = tempfile::tempdir().unwrap();
    for motion in if long { &["linear", "turntable"][..] } else { &["turntable"] } {
        let at = dir.path().join(motion);
        let out = text(at.clone());
        let mut simulate =
            vec!["simulate", "--rig", RIG, "--motion", motion, "--set", "axis,scan", "--out", &out, "--quiet"];
        simulate.extend(if long { &[][..] } else { &["--shots", "400"] });
        sheetlight(&simulate);
        calibrated(&at);
        scanned(&at, "scan", "out", &[]);
        let (found, scan) = (at.join("found.json"), text(at.join("out")));
        let (station, recipe) = (text(at.join("station")), text(at.join("notched.toml")));
        sheetlight(&[
            "find",
            &scan,
            "--recipe",
            &recipe,
            "--station",
            &station,
            "--out",
            found.to_str().unwrap(),
            "--quiet",
        ]);
        let report: Value = serde_json::from_slice(&std::fs::read(&found).unwrap()).unwrap();
        assert_eq!(report["frame"], "axis");
        let terms: Vec<&str> =
            report["budget"]["terms"].as_array().unwrap().iter().map(|t| t["name"].as_str().unwrap()).collect();
        assert!(terms.contains(&"axis") && !terms.contains(&"hand-eye"), "{terms:?}");
        let truth = Truth::load(&at.join("scan/truth.json")).unwrap();
        let part = truth.file.parts.iter().find(|p| p.name == "notched").unwrap().base_from_part;
        let rows: [f64; 16] = serde_json::from_value(report["base_from_part"].clone()).unwrap();
        let (is, _) = sheetlight::geometry::Rigid::from_rows(&rows).unwrap();
        let (angle, mm) = part.difference(&is);
        let sizes = ["along_percent", "across_percent"].map(|k| report["sizes"][k].as_f64().unwrap());
        println!("{motion}: {mm:.3} mm, {:.3} degrees off, sizes {sizes:.3?} percent", angle.to_degrees());
        assert!(mm < 0.02 && angle.to_degrees() < 0.05, "{motion}: {mm} mm, {} degrees", angle.to_degrees());
        assert!(sizes.iter().all(|s| s.abs() < 0.2), "{motion}: {sizes:?} percent");
    }
}
