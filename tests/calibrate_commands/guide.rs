//! In: a simulated station: the pointer's spots on a circuit board, the line over the part on it. Out:
//! `sheetlight guide` from the touch to the retract, against the station's truth, and where it must stop.
//! Frame and unit: base frame, part axes; mm, degrees.

use crate::common::{sheetlight, sheetlight_fails};
use serde_json::Value;
use sheetlight::geometry::{Base, Part, Rigid, Vec3};
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn pose(value: &Value) -> Rigid<Base, Part> {
    serde_json::from_value(value.clone()).unwrap()
}

#[test]
fn an_operator_is_led_from_the_touch_to_the_retract() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    sheetlight(&["--quiet", "simulate", "--out", text(dir.path()), "--set", "surface,scan", "--seed", "3"]);
    let recipe = format!("{}/data/recipes/led.toml", concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let (station, surface, scan, out) = (at("station"), at("surface"), at("scan"), at("job"));
    let common = |scan: &Path| -> Vec<String> {
        let args = [
            "--quiet",
            "guide",
            "--station",
            text(&station),
            "--touch",
            text(&surface),
            "--scan",
            text(scan),
            "--recipe",
            &recipe,
            "--out",
            text(&out),
            "--robot",
            "denso",
            "--on",
            "cpu",
        ];
        args.map(str::to_owned).to_vec()
    };
    let with = |scan: &Path, more: &[&str]| -> Vec<String> {
        common(scan).into_iter().chain(more.iter().map(|s| s.to_string())).collect()
    };
    let args = with(&scan, &["--yes", "--json"]);
    let guided: Value =
        serde_json::from_str(&sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>())).unwrap();
    assert_eq!(guided, json(&out.join("guide.json")), "what is said and what is kept are the same");
    let names: Vec<&str> = guided["steps"].as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["touch", "look squarely", "scan", "find", "approach", "insert", "retract"]);
    assert!(guided["finished"].as_bool().unwrap() && out.join("found.png").is_file());

    // The board's normal by the pointer, the part by the line, both against the truth.
    let truth = json(&scan.join("truth.json"));
    let parts = truth["parts"].as_array().unwrap();
    let part = parts.iter().find(|p| p["name"] == "led").expect("the scene holds the recipe's part");
    let base_from_part = pose(&part["base_T_part"]);
    let up = base_from_part.direction(&Vec3::z());
    let normal: Vec<f64> = serde_json::from_value(guided["normal"].clone()).unwrap();
    let off = Vec3::from_column_slice(&normal).cross(&up).norm().asin().to_degrees();
    let d = base_from_part.inverse() * pose(&guided["report"]["base_from_part"]);
    let (lateral, angle) = (d.translation.xy().norm(), d.rotation_vector().norm().to_degrees());
    println!("normal {off:.4} degrees, part {lateral:.4} mm and {angle:.4} degrees");
    assert!(off < 0.1, "the board's normal is {off} degrees off");
    assert!(lateral < 0.05 && d.translation.z.abs() < 0.05 && angle < 0.15, "{lateral} mm, {angle} degrees: {d:?}");
    // Approach and retreat are above the insertion, along the part's axis, as far as the recipe says.
    let of = |name: &str| -> Vec<f64> {
        let step = guided["steps"].as_array().unwrap().iter().find(|s| s["name"] == name).unwrap();
        serde_json::from_value(step["pose"].clone()).unwrap()
    };
    let recipe = std::fs::read_to_string(&recipe).unwrap();
    let spec = sheetlight::find::Recipe::parse(&recipe).unwrap().insertion;
    for (name, mm) in [("approach", spec.approach_mm), ("retract", spec.retract_mm)] {
        let (a, b) = (of(name), of("insert"));
        let lift = Vec3::new(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
        assert!((lift - up * mm).norm() < 0.01 * mm, "{name}: {lift}, {mm} mm wanted along {up}");
    }

    // Where nobody can answer, nothing moves; a part that is askew against the board stops it; so do bad numbers.
    let fails = |more: &[&str]| {
        let args = with(&scan, more);
        let (code, said) = sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
        println!("{code}: {said}");
        (code, said)
    };
    let (code, said) = fails(&[]);
    assert!(code == 2 && said.contains("--yes"), "{said}");
    let (code, said) = fails(&["--yes", "--view-mm", "0"]);
    assert!(code == 2 && said.contains("view_mm is 0"), "{said}");
    // The same part three degrees askew would be refused; here a limit below what was measured.
    let (code, said) = fails(&["--yes", "--max-tilt-deg", "0.01"]);
    assert!(code == 2 && said.contains("max_tilt_deg is 0.01"), "{said}");
    // Touch and scan swapped: the line's pictures hold no spot.
    let swapped: Vec<String> = with(&scan, &["--yes"])
        .into_iter()
        .map(|a| if a == text(&surface) { text(&scan).to_owned() } else { a })
        .collect();
    let (code, said) = sheetlight_fails(&swapped.iter().map(String::as_str).collect::<Vec<_>>());
    println!("{code}: {said}");
    assert!(code == 1 && said.contains("the pointer is needed here"), "{said}");
}
