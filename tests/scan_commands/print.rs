//! In: simulated scans of a flat plate with printed bars 0.2 to 3 mm wide, turned by several angles, with shots a
//! quarter to five of the sheet's standard deviations apart. Out: judgement on how far the print pulls the points off
//! the plate that is known to be flat. SHEETLIGHT_LONG: eleven angles, and more distances.
//! Frame and unit: scene frame, mm.

use crate::common::sheetlight;
use sheetlight::geometry::{Base, Rigid};
use sheetlight::scan::{CloudPoint, read_cloud};
use sheetlight::simulate::InScene;
use std::fmt::Write;
use std::path::Path;

/// Standard deviation of the paper rig's sheet of light, mm: half of its radius.
const SHEET: f64 = 0.105;
/// Distance of the shots in those, and the largest share of the pull that may be left on average over the angles.
/// Before neighbours farther away than one shot were looked at, it was 1 at a quarter.
const SPACINGS: [(f64, f64); 5] = [(0.25, 0.4), (0.5, 0.45), (1.0, 0.5), (2.6, 0.7), (5.0, 1.0)];
/// Depth of the chart in the direction of the motion, mm.
const DEPTH: f64 = 8.0;

/// Fields of bars as wide as the gaps between them: 0.2, 0.5, 1, 2 and 3 mm.
fn scene(degrees: f64) -> String {
    let half = 0.5 * DEPTH;
    let mut text = format!(
        "name = \"print\"\nregion_mm = [-30, -{half}, 30, {half}]\nfocus_height_mm = 0\n\
         [[solid]]\nshape = {{ block = {{ size_mm = [200, 120, 5] }} }}\nat_mm = [0, 0, 0]\n\
         material = {{ albedo = 0.7 }}\n"
    );
    let (sin, cos) = degrees.to_radians().sin_cos();
    for (field, wide) in [0.2_f64, 0.5, 1.0, 2.0, 3.0].into_iter().enumerate() {
        for bar in 0..(3.0 / wide).round() as usize {
            // Print that is a micrometre thick.
            let along = 2.0 * wide * bar as f64;
            let (x, y) = (-25.0 + 12.0 * field as f64 + along * cos, along * sin);
            let _ = write!(
                text,
                "[[solid]]\nshape = {{ block = {{ size_mm = [{wide}, 12, 0.001] }} }}\nat_mm = [{x}, {y}, 0.001]\n\
                 turn_deg = {degrees}\nmaterial = {{ albedo = 0.15 }}\n"
            );
        }
    }
    text
}

/// Mean squares of the heights of the points within the chart, and of those beside it, where nothing pulls; and the
/// share of points beyond three of their standard deviations within it.
fn heights(cloud: &Path, scene_from_base: &Rigid<InScene, Base>) -> [f64; 3] {
    let cloud: Vec<CloudPoint> = read_cloud(cloud).unwrap();
    let (mut printed, mut bare, mut beyond, mut counts) = (0.0, 0.0, 0.0, [0.0; 2]);
    for p in &cloud {
        let at = scene_from_base.point(&p.at());
        if (-26.0..29.0).contains(&at.x) {
            printed += at.z * at.z;
            beyond += f64::from(at.z.abs() > 3.0 * f64::from(p.sigma_mm));
            counts[0] += 1.0;
        } else if at.x.abs() > 33.0 {
            bare += at.z * at.z;
            counts[1] += 1.0;
        }
    }
    assert!(counts.iter().all(|n| *n > 500.0), "{counts:?}");
    [printed / counts[0], bare / counts[1], beyond / counts[0]]
}

#[test]
fn print_pulls_points_less_the_finer_the_shots_are() {
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let angles: Vec<f64> = if long { (0..11).map(|k| f64::from(k) * 8.2).collect() } else { vec![41.0, 82.0] };
    for (spacing, allowed) in SPACINGS.into_iter().step_by(if long { 1 } else { 2 }) {
        let shots = (DEPTH / (spacing * SHEET)).round() as u32;
        let (mut before, mut after, mut beyond) = (0.0, 0.0, 0.0);
        for degrees in &angles {
            let dir = tempfile::tempdir().unwrap();
            let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
            std::fs::write(at("scene.toml"), scene(*degrees)).unwrap();
            let (cell, scene, shots) = (at("cell"), at("scene.toml"), shots.to_string());
            sheetlight(&["simulate", "--out", &cell, "--scene", &scene, "--shots", &shots, "--seed", "3", "--quiet"]);
            let (from, station) = (at("cell/scan"), at("cell/station"));
            let truth: serde_json::Value =
                serde_json::from_slice(&std::fs::read(dir.path().join("cell/scan/truth.json")).unwrap()).unwrap();
            let known: Rigid<Base, InScene> = serde_json::from_value(truth["base_T_scene"].clone()).unwrap();
            let scanned = |name: &str| {
                let out = at(name);
                sheetlight(&["scan", &from, "--station", &station, "--out", &out, "--overlays", "0", "--quiet"]);
                heights(&dir.path().join(name).join("cloud.ply"), &known.inverse())
            };
            let [printed, bare, share] = scanned("corrected");
            let settings = dir.path().join("cell/station/station.toml");
            let text = std::fs::read_to_string(&settings).unwrap();
            assert!(text.contains("thick_sheet = true"));
            std::fs::write(settings, text.replace("thick_sheet = true", "thick_sheet = false")).unwrap();
            let [raw, _, _] = scanned("raw");
            let [from, to, noise] = [raw, printed, bare].map(f64::sqrt);
            print!("{spacing} sigma, {degrees:.1} degrees: {from:.4} -> {to:.4} mm, {noise:.4} beside the chart; ");
            println!("{share:.4} beyond three sigma");
            before += raw - bare;
            after += printed - bare;
            beyond += share / angles.len() as f64;
        }
        let left = (after / before).sqrt();
        println!("{spacing} sigma from shot to shot: {left:.3} of the pull is left, {beyond:.4} beyond three sigma");
        assert!(left <= allowed, "{spacing} sigma: {left:.3} is left, allowed {allowed}");
        assert!(beyond <= 0.01, "{spacing} sigma: {beyond:.4} beyond three sigma");
    }
}
