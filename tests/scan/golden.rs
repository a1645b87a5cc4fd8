//! In: a small simulated recording, always the same. Out: a failure when the scan of it changes.
//! Frame and unit: base frame, mm. A wanted change is recorded with UPDATE_GOLDEN=1 and explained in the commit.

use crate::common::sheetlight;
use serde_json::{Value, json};
use std::path::Path;

/// Counts may differ by rounding between processors' exp(); lengths are compared to 1e-3 of their unit.
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
                (Some(a), Some(b)) if was.is_f64() => (a - b).abs() <= 1e-3,
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
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/scan_320.json");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&golden, serde_json::to_string_pretty(&is).unwrap() + "\n").unwrap();
    }
    let was: Value = serde_json::from_str(&std::fs::read_to_string(&golden).unwrap()).unwrap();
    let mut faults = Vec::new();
    close("", &was, &is, &mut faults);
    assert!(faults.is_empty(), "the scan changed:\n{}", faults.join("\n"));
}
