//! In: a ball under simulated sensors of several designs. Out: failure where its flanks are not in the cloud: across
//! a slanted stripe the sheet's light is narrower than on a level face, and no sign of something else.
//! Frame and unit: base frame, mm; slopes against the upright, degrees.

use crate::common::sheetlight;
use sheetlight::geometry::Vec3;
use sheetlight::scan::{CloudPoint, read_cloud};
use sheetlight::simulate::Truth;
use std::path::Path;

/// mm, of the ball; its top is that far above the plate.
const RADIUS: f64 = 30.0;
const SCENE: &str = r#"
name = "a ball on a plate"
region_mm = [-40, -40, 40, 40]
focus_height_mm = 15
[[solid]]
shape = { block = { size_mm = [120, 120, 10] } }
at_mm = [0, 0, 0]
material = { albedo = 0.6 }
[[part]]
name = "ball"
at_mm = [0, 0, 30]
[[part.solid]]
shape = { ball = { diameter_mm = 60 } }
at_mm = [0, 0, 0]
material = { albedo = 0.6 }
"#;

/// Of the points on the ball's flanks, slopes of 55 to 78 degrees: their number, the rms of their distances, mm, and
/// of these over the stated sigmas.
fn flanks(cloud: &[CloudPoint], truth: &Truth) -> (usize, f64, f64) {
    let part = truth.file.parts[0].base_from_part;
    let middle = part.point(&Vec3::new(0.0, 0.0, -RADIUS));
    let up = part.point(&Vec3::zeros()) - middle;
    let (mut n, mut square, mut pulls) = (0, 0.0, 0.0);
    for p in cloud {
        let from = p.at() - middle;
        let off = from.norm() - RADIUS;
        let slope = (from.dot(&up) / (from.norm() * RADIUS)).acos().to_degrees();
        if off.abs() < 0.3 && (55.0..78.0).contains(&slope) {
            n += 1;
            square += off * off;
            pulls += (off / f64::from(p.sigma_mm)).powi(2);
        }
    }
    (n, (square / n as f64).sqrt(), (pulls / n as f64).sqrt())
}

fn scanned(at: &Path, name: &str, on: &str) -> Vec<CloudPoint> {
    let [recording, station, out] = ["scan", "station", name].map(|p| at.join(p).to_str().unwrap().to_owned());
    sheetlight(&["scan", &recording, "--station", &station, "--out", &out, "--on", on, "--overlays", "0", "--quiet"]);
    read_cloud(&at.join(name).join("cloud.ply")).unwrap()
}

#[test]
fn the_flanks_of_a_ball_are_seen() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("ball.toml"), SCENE).unwrap();
    for (rig, width) in [("upright", "1280"), ("slant45", "720"), ("mp12", "2048"), ("paper", "640")] {
        let at = dir.path().join(rig);
        let design = format!("{}/data/rigs/{rig}.toml", concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
        let [out, scene] = [at.clone(), dir.path().join("ball.toml")].map(|p| p.to_str().unwrap().to_owned());
        sheetlight(&[
            "simulate", "--rig", &design, "--width", width, "--scene", &scene, "--shots", "24", "--out", &out,
            "--quiet",
        ]);
        let truth = Truth::load(&at.join("scan/truth.json")).unwrap();
        // All that the fit can place, but for what is refused for another reason.
        let settings = at.join("station/station.toml");
        let usual = std::fs::read_to_string(&settings).unwrap();
        let narrowest = usual.lines().find(|l| l.starts_with("narrowest = ")).expect("a setting");
        std::fs::write(&settings, usual.replace(narrowest, "narrowest = 0.0")).unwrap();
        let all = flanks(&scanned(&at, "all", "cpu"), &truth);
        std::fs::write(&settings, usual).unwrap();
        for on in ["cpu", "gpu"] {
            let (n, rms, pull) = flanks(&scanned(&at, on, on), &truth);
            println!("{rig} {on}: {n} points, rms {rms:.4} mm, {pull:.2} of sigma; of {all:?}");
            assert!(all.0 > 100 && n as f64 > 0.97 * all.0 as f64, "{rig} on {on}: {n} of {} points", all.0);
            assert!(
                rms < 1.1 * all.1 + 1e-4 && pull < 2.0,
                "{rig} on {on}: rms {rms:.4} of {:.4} mm, {pull:.2} of sigma",
                all.1
            );
        }
    }
}
