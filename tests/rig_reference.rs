//! In: the rendered reference rigs (public and kept back). Out: hand-eye, laser plane and pointer from
//! the pictures alone, scored by the reference data's own truth.
//! Frame and unit: mm, degrees.

mod common;

use common::{figure, reference, rigs, score, sheetlight};
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A station with the true camera, everything else still to be calibrated.
fn station(truth: &Path, folder: &Path) -> String {
    let all: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(truth.join("handeye/truth.json")).unwrap()).unwrap();
    let values = folder.join("camera.json");
    std::fs::write(&values, serde_json::json!({ "intrinsics": all["intrinsics"] }).to_string()).unwrap();
    let station = folder.join("station");
    // The camera is the truth's own: its sigma of nearly nothing leaves the sigmas of what is calibrated with it.
    let exact = ["--camera-sigma-px", "0.001"];
    let import = ["station", "import", text(&values), "--station", text(&station)];
    sheetlight(&[&import[..], &exact].concat());
    text(&station).to_owned()
}

#[test]
fn hand_eye_from_exact_and_noisy_poses() {
    let Some(reference) = reference("hand_eye_from_exact_and_noisy_poses") else { return };
    for (inputs, truth) in rigs(&reference) {
        // With the true camera, and with one from pictures: the hand-eye's own pictures are solved along with it.
        for own_camera in [false, true] {
            let dir = tempfile::tempdir().unwrap();
            let station = if own_camera {
                let station = text(&dir.path().join("station")).to_owned();
                sheetlight(&["station", "new", "--station", &station, "--robot", "denso"]);
                sheetlight(&["calibrate", "camera", text(&inputs.join("intrinsics")), "--station", &station]);
                station
            } else {
                station(&truth, dir.path())
            };
            for (poses, mm, deg) in [("poses_exact", 0.03, 0.008), ("poses_noisy", 0.08, 0.018)] {
                let input = inputs.join("handeye");
                let args = ["calibrate", "hand-eye", text(&input), "--poses", poses, "--station", &station, "--json"];
                let found: serde_json::Value = serde_json::from_str(&sheetlight(&args)).unwrap();
                let estimate = dir.path().join("estimate.json");
                sheetlight(&["station", "export", "--station", &station, "--out", text(&estimate)]);
                let Some(s) = score(&reference, &estimate, &truth) else { return };
                let (t, r) = (figure(&s, &["hand_eye", "translation_mm"]), figure(&s, &["hand_eye", "rotation_deg"]));
                println!("own camera {own_camera}, {poses}: {t:.4} mm, {r:.5} degrees\n{:#}", found["quality"]);
                assert!(t <= mm && r <= deg, "own camera {own_camera}, {poses}: {t} mm, {r} degrees");
                // With noisy poses the pictures' own small biases do not matter: the sigma must cover the error.
                if poses == "poses_noisy" {
                    let sigma = figure(&found, &["quality", "figures", "translation_sigma_mm"]);
                    assert!(t < 3.0 * sigma, "{t} mm of error, sigma {sigma}");
                }
            }
        }
    }
}

#[test]
fn laser_plane_and_pointer() {
    let Some(reference) = reference("laser_plane_and_pointer") else { return };
    for (inputs, truth) in rigs(&reference) {
        let dir = tempfile::tempdir().unwrap();
        let station = station(&truth, dir.path());
        sheetlight(&[
            "calibrate",
            "laser-plane",
            text(&inputs.join("laserplane")),
            "--station",
            &station,
            "--on",
            "cpu",
        ]);
        sheetlight(&["calibrate", "pointer", text(&inputs.join("pointer_cal")), "--station", &station]);
        let out = sheetlight(&["range", text(&inputs.join("pointer")), "--station", &station, "--json"]);
        let ranges: serde_json::Value = serde_json::from_str(&out).unwrap();
        let pointer: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(truth.join("pointer/truth.json")).unwrap()).unwrap();
        let targets = pointer["targets"].as_array().unwrap();
        let distances = ranges["distances"].as_array().unwrap();
        assert_eq!(distances.len(), targets.len(), "every spot is found: {}", ranges["missing"]);
        let (mut pull, mut n) = (0.0, 0.0);
        for (d, t) in distances.iter().zip(targets) {
            let z = t["camera_z_mm"].as_f64().unwrap();
            let e = d["along_axis_mm"].as_f64().unwrap() - z;
            let limit = if z <= 200.0 { 0.10 } else { 0.20 };
            assert!(e.abs() <= limit, "at {z} mm: {e:+.3} mm, limit {limit}");
            pull += (e / d["along_axis_sigma_mm"].as_f64().unwrap()).powi(2);
            n += 1.0;
        }
        let pull = f64::sqrt(pull / n);
        assert!((0.6..1.6).contains(&pull), "distances' errors over their sigmas: {pull}");
        let estimate = dir.path().join("estimate.json");
        sheetlight(&["station", "export", "--station", &station, "--out", text(&estimate)]);
        let Some(s) = score(&reference, &estimate, &truth) else { return };
        let angle = figure(&s, &["laser_plane", "angle_deg"]);
        let rms = figure(&s, &["laser_plane", "rms_distance_mm_in_110_210"]);
        assert!(angle <= 0.0095 && rms <= 0.015, "{angle} degrees, {rms} mm");
    }
}
