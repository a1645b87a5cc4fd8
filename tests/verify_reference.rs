//! In: the rendered plate at three distances and the rendered treads. Out: `sheetlight verify` on them, with the true
//! calibration and with one from pictures alone, against what the truth says.
//! Frame and unit: base frame, mm; scene frame for the treads.

mod common;

use common::{figure, reference, rigs, sheetlight};
use serde_json::Value;
use sheetlight::geometry::{Base, Plane, Rigid, Vec3};
use sheetlight::scan::read_cloud;
use std::path::Path;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Scene;
impl sheetlight::geometry::Frame for Scene {
    const NAME: &'static str = "scene";
}

fn points(scan: &Path) -> Vec<(u32, Vec3)> {
    let cloud = read_cloud(&scan.join("cloud.ply")).unwrap();
    cloud.iter().map(|p| (p.shot, p.at())).collect()
}

/// Where the scan puts the middle of each tread, and where a tip that follows the same line down would touch it.
fn touches(scan: &Path, truth: &Value) -> String {
    let base_from_scene: Rigid<Base, Scene> = serde_json::from_value(truth["base_T_scene"].clone()).unwrap();
    let heights: Vec<f64> = serde_json::from_value(truth["tread_heights_mm"].clone()).unwrap();
    let scene: Vec<Vec3> = points(scan).iter().map(|p| base_from_scene.inverse().point(&p.1)).collect();
    let mut out = String::from("x,y,z,touched_x,touched_y,touched_z\n");
    for (i, height) in heights.iter().enumerate() {
        let middle = (i as f64 - (heights.len() - 1) as f64 / 2.0) * 12.0;
        for y in [-12.0, 0.0, 12.0] {
            let near: Vec<f64> = scene
                .iter()
                .filter(|p| (p.x - middle).abs() < 2.0 && (p.y - y).abs() < 2.0 && (p.z - height).abs() < 1.0)
                .map(|p| p.z)
                .collect();
            assert!(near.len() > 50, "tread {i} at {y}: {} points", near.len());
            let z = near.iter().sum::<f64>() / near.len() as f64;
            let (a, b) = (base_from_scene.point(&Vec3::new(middle, y, z)), Vec3::new(middle, y, *height));
            let b = base_from_scene.point(&b);
            out += &format!("{},{},{},{},{},{}\n", a.x, a.y, a.z, b.x, b.y, b.z);
        }
    }
    out
}

#[test]
fn a_plate_and_touched_treads_tell_a_good_station_from_a_worse_one() {
    let Some(reference) = reference("verify --flat and --touch") else { return };
    for (inputs, truths) in rigs(&reference) {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let (known, own) = (at("known"), at("own"));
        sheetlight(&["station", "import", text(&truths.join("flat/truth.json")), "--station", text(&known)]);
        sheetlight(&["station", "new", "--station", text(&own), "--robot", "denso"]);
        let calibrate = |what: &str, set: &str, more: &[&str]| {
            let input = inputs.join(set);
            sheetlight(&[&["--quiet", "calibrate", what, text(&input), "--station", text(&own)], more].concat());
        };
        calibrate("camera", "intrinsics", &[]);
        calibrate("hand-eye", "handeye", &["--poses", "poses_noisy"]);
        calibrate("laser-plane", "laserplane", &["--on", "cpu"]);
        let mut found = Vec::new();
        for station in [&known, &own] {
            let name = station.file_name().unwrap().to_str().unwrap();
            let scan = |set: &str| {
                let out = at(&format!("{set}_{name}"));
                let input = inputs.join(set);
                let args = ["--quiet", "scan", text(&input), "--station", text(station), "--out", text(&out)];
                sheetlight(&[&args[..], &["--overlays", "0", "--on", "cpu"]].concat());
                out
            };
            let (flat, steps) = (scan("flat"), scan("steps"));
            let file = at(&format!("touches_{name}.csv"));
            std::fs::write(&file, touches(&steps, &json(&truths.join("steps/truth.json")))).unwrap();
            // The plate was recorded from three distances, 16 shots each.
            let args = ["verify", "--station", text(station), "--flat", text(&flat), "--shots-per-view", "16"];
            let said = sheetlight(&[&args[..], &["--touch", text(&file), "--json"]].concat());
            let report: Value = serde_json::from_str(&said).unwrap();
            println!("{name}: {}\n{}", report["flat"], report["touch"]);
            // The views' heights against the true plate, without any fit.
            let plane = &json(&truths.join("flat/truth.json"))["plane_base"];
            let normal: Vec<f64> = serde_json::from_value(plane["normal"].clone()).unwrap();
            let plane = Plane::<Base>::new(Vec3::from_column_slice(&normal), figure(plane, &["offset_mm"])).unwrap();
            let cloud = points(&flat);
            let mean = |view: u32| {
                let off = cloud.iter().filter(|p| p.0 / 16 == view).map(|p| plane.distance(&p.1));
                // From the third place the stripe reaches over the plate's edge.
                let mut off: Vec<f64> = off.filter(|d| d.abs() < 1.0).collect();
                off.sort_by(f64::total_cmp);
                off[off.len() / 2]
            };
            let truth: Vec<f64> = (0..3).map(mean).collect();
            let range = truth.iter().copied().fold(f64::MIN, f64::max) - truth.iter().copied().fold(f64::MAX, f64::min);
            println!("{name}: heights over the true plate {truth:.4?}");
            assert_eq!(report["flat"]["views"].as_array().unwrap().len(), 3);
            let said = figure(&report, &["flat", "height_range_mm"]);
            // A tilt that all views share moves their medians by as much as their middles are apart; micrometres here.
            assert!((said - range).abs() < 0.01, "{name}: heights range over {said} mm, truly over {range}");
            found.push(report);
        }
        let [known, own] = &found[..] else { unreachable!() };
        let f = |r: &Value, path: &[&str]| figure(r, path);
        // With the true calibration nothing is left but noise.
        assert!(f(known, &["flat", "height_range_mm"]) < 0.01, "{}", known["flat"]);
        assert!(f(known, &["flat", "largest_tilt_deg"]) < 0.01, "{}", known["flat"]);
        assert!(f(known, &["touch", "rms_mm"]) < 0.02, "{}", known["touch"]);
        // From pictures and noisy poses the error is the hand-eye's: all points are off together.
        assert!(f(own, &["touch", "rms_mm"]) < 0.3, "{}", own["touch"]);
        assert!(f(own, &["touch", "rms_mm"]) > f(known, &["touch", "rms_mm"]), "{}", own["touch"]);
        assert!(f(own, &["touch", "scatter_mm"]) < 0.06, "{}", own["touch"]);
    }
}
