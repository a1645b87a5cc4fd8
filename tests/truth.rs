//! In: the rendered recordings, their true calibration put into a station. Out: the scan's clouds judged
//! by the reference data's own scorer.
//! Frame and unit: base frame, mm.

mod common;

use common::{figure, reference, rigs, score, sheetlight};

const SETS: [&str; 8] = ["flat", "steps", "shiny", "scan_dimm", "scan_led", "scan_osc", "scan_flash", "scan_led_hires"];

/// One line per figure that is worse than its bar.
fn worse(score: &serde_json::Value) -> Vec<String> {
    let mut faults = Vec::new();
    let mut limit = |path: &[&str], least: f64, most: f64| {
        let value = figure(score, path);
        if !(least..=most).contains(&value) {
            faults.push(format!("{} is {value:.5}, allowed {least}..={most}", path.join(" ")));
        }
    };
    limit(&["flat", "flat", "own_plane_rms_mm"], 0.0, 0.035);
    limit(&["flat", "flat", "mean_height_mm"], -0.003, 0.003);
    limit(&["flat", "cloud", "outliers_over_1mm"], 0.0, 0.0);
    limit(&["flat", "cloud", "completeness_0.3"], 0.98, 1.0);
    limit(&["steps", "steps", "tread_noise_rms_mm"], 0.0, 0.035);
    limit(&["shiny", "cloud", "outliers_over_1mm"], 0.0, 0.001);
    limit(&["shiny", "cloud", "rms_mm_without_outliers"], 0.0, 0.06);
    for set in ["scan_dimm", "scan_led", "scan_osc", "scan_flash"] {
        limit(&[set, "cloud", "rms_mm_without_outliers"], 0.0, 0.06);
        limit(&[set, "cloud", "outliers_over_1mm"], 0.0, 0.001);
        limit(&[set, "cloud", "completeness_0.3"], 0.96, 1.0);
    }
    limit(&["scan_dimm", "cloud_part", "outliers_over_1mm"], 0.0, 0.005);
    limit(&["scan_dimm", "cloud_part", "rms_mm_without_outliers"], 0.0, 0.08);
    limit(&["scan_led_hires", "cloud", "rms_mm_without_outliers"], 0.0, 0.045);
    limit(&["scan_led_hires", "cloud", "outliers_over_1mm"], 0.0, 0.001);
    for (set, most) in [("steps", 0.004), ("shiny", 0.01)] {
        for error in score[set]["steps"]["step_errors_mm"].as_array().expect("step errors") {
            let error = error.as_f64().expect("a number");
            if error.abs() > most {
                faults.push(format!("{set}: a step is wrong by {error:.4} mm, allowed {most}"));
            }
        }
    }
    faults
}

#[test]
fn scans_with_the_true_calibration_meet_their_bars() {
    let Some(reference) = reference("scan accuracy") else { return };
    for (inputs, truth) in rigs(&reference) {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
        let known = truth.join("flat/truth.json");
        sheetlight(&["station", "import", known.to_str().unwrap(), "--station", &at("station")]);
        let mut sets = serde_json::Map::new();
        for set in SETS {
            let recording = inputs.join(set);
            sheetlight(&[
                "scan",
                recording.to_str().unwrap(),
                "--station",
                &at("station"),
                "--out",
                &at(set),
                "--overlays",
                "0",
                "--quiet",
            ]);
            sets.insert(set.into(), serde_json::json!({"cloud": format!("{set}/cloud.ply")}));
        }
        let estimate = dir.path().join("estimate.json");
        std::fs::write(&estimate, serde_json::json!({ "sets": sets }).to_string()).unwrap();
        let Some(score) = score(&reference, &estimate, &truth) else { return };
        let faults = worse(&score);
        assert!(faults.is_empty(), "{}:\n{}", inputs.display(), faults.join("\n"));
    }
}
