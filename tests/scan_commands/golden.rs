//! In: a small simulated recording, always the same. Out: a failure when the scan of it changes.
//! Frame and unit: base frame, mm. A wanted change is recorded with UPDATE_GOLDEN=1 and explained in the commit.

use crate::common::sheetlight;
use serde_json::{Value, json};
use std::path::Path;

/// How far a figure may move: by 1e-4 of itself, a thousand times what processors' exp() differ by. Where a figure is
/// nearly 0 its unit says what nothing is: 1e-6 mm is a thousandth of the finest sigma, 1e-5 px that of the finest
/// peak. A place has no size of its own, its frame's origin lies anywhere: 1e-3 mm, a thirtieth of a point's sigma.
fn allowed(path: &str, was: f64) -> f64 {
    if path.contains("position_mm") {
        return 1e-3;
    }
    let floor: f64 = if path.ends_with("_px") { 1e-5 } else { 1e-6 };
    floor.max(1e-4 * was.abs())
}

/// Counts may differ by rounding between processors' exp(): a peak at an edge falls on the other side of it.
fn close(path: &str, was: &Value, is: &Value, faults: &mut Vec<String>) {
    match (was, is) {
        (Value::Object(a), Value::Object(b)) => {
            for key in a.keys().chain(b.keys().filter(|k| !a.contains_key(*k))) {
                close(
                    &format!("{path}/{key}"),
                    a.get(key).unwrap_or(&Value::Null),
                    b.get(key).unwrap_or(&Value::Null),
                    faults,
                );
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                close(&format!("{path}/{i}"), a, b, faults);
            }
        }
        _ => {
            let same = match (was.as_f64(), is.as_f64()) {
                (Some(a), Some(b)) if was.is_f64() => (a - b).abs() <= allowed(path, a),
                (Some(a), Some(b)) => (a - b).abs() <= 2.0f64.max(2e-3 * a),
                _ => was == is,
            };
            if !same {
                faults.push(format!("{path}: was {was}, is {is}"));
            }
        }
    }
}

#[test]
fn the_scan_of_the_small_recording_is_what_it_was() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    sheetlight(&["simulate", "--out", &at("sim"), "--width", "320", "--shots", "16", "--seed", "7", "--quiet"]);
    let report = sheetlight(&[
        "scan",
        &at("sim/scan"),
        "--station",
        &at("sim/station"),
        "--out",
        &at("out"),
        "--on",
        "cpu",
        "--overlays",
        "0",
        "--json",
    ]);
    let report: Value = serde_json::from_str(&report).unwrap();
    let points = sheetlight::scan::read_cloud(&dir.path().join("out/cloud.ply")).unwrap();
    let mean = |f: &dyn Fn(&sheetlight::scan::CloudPoint) -> f32| {
        points.iter().map(|p| f64::from(f(p))).sum::<f64>() / points.len() as f64
    };
    let is = json!({
        "points": report["points"], "peaks": report["peaks"], "dark_shots": report["dark_shots"],
        "stripe": report["stripe"], "median_sigma_mm": report["median_sigma_mm"],
        "mean_position_mm": [mean(&|p| p.position[0]), mean(&|p| p.position[1]), mean(&|p| p.position[2])],
        "mean_quality": mean(&|p| p.quality),
    });
    let golden = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("tests/golden/scan_320.json");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&golden, serde_json::to_string_pretty(&is).unwrap() + "\n").unwrap();
    }
    let was: Value = serde_json::from_str(&std::fs::read_to_string(&golden).unwrap()).unwrap();
    let mut faults = Vec::new();
    close("", &was, &is, &mut faults);
    assert!(faults.is_empty(), "the scan changed:\n{}", faults.join("\n"));
}

#[test]
fn a_figure_that_moved_by_a_thousandth_of_itself_is_seen() {
    let was = json!({
        "median_sigma_mm": 0.0325, "mean_position_mm": [481.68], "stripe": { "width_px": 0.5274, "grain_px": 0.0 },
        "mean_quality": 0.94,
    });
    let seen = |path: &str, by: f64| {
        let mut is = was.clone();
        let figure = is.pointer_mut(path).unwrap();
        *figure = json!(figure.as_f64().unwrap() + by);
        let mut faults = Vec::new();
        close("", &was, &is, &mut faults);
        !faults.is_empty()
    };
    for (path, moved, rounded) in [
        ("/median_sigma_mm", 0.0325e-3, 0.0325e-6),
        ("/mean_position_mm/0", 2e-3, 1e-4),
        ("/stripe/width_px", 0.5e-3, 0.5e-6),
        ("/stripe/grain_px", 2e-5, 1e-7),
        ("/mean_quality", 1e-3, 1e-6),
    ] {
        assert!(seen(path, moved) && seen(path, -moved), "{path}: {moved} is not seen");
        assert!(!seen(path, rounded), "{path}: {rounded} is seen");
    }
}
