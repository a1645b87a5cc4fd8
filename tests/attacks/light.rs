//! In: boards whose pictures are black or white. Out: calibrations that say what light they saw.
//! Frame and unit: grey levels.

use super::bench::refused;
use super::common::sheetlight;
use sheetlight::raster::{Image, save_png};
use std::path::Path;

fn flood(folder: &Path, kind: &str, level: u8) {
    for path in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if path.file_name().unwrap().to_str().unwrap().starts_with(kind) {
            save_png(&Image::from_u8(320, 240, vec![level; 320 * 240]), &path).unwrap();
        }
    }
}

#[test]
fn what_was_seen_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    for (set, kind, command, level, wants) in [
        ("laserplane", "laser_", "laser-plane", 2, ["levels 2 to 2 of 255", "dark"]),
        ("laserplane", "laser_", "laser-plane", 255, ["100.0 % saturated", "white"]),
        ("laserplane", "ambient_", "camera", 3, ["levels 3 to 3 of 255", "dark"]),
        ("laserplane", "ambient_", "camera", 255, ["100.0 % saturated", "white"]),
        ("pointer_cal", "laser_", "pointer", 2, ["levels 2 to 2 of 255", "dark"]),
        ("pointer_cal", "laser_", "pointer", 255, ["100.0 % saturated", "white"]),
    ] {
        if !Path::new(&at(set)).exists() {
            sheetlight(&["simulate", "--out", &at("sim"), "--set", set, "--width", "320", "--quiet"]);
            std::fs::rename(at(&format!("sim/{set}")), at(set)).unwrap();
        }
        let kept: Vec<_> = std::fs::read_dir(at(set))
            .unwrap()
            .map(|e| e.unwrap().path())
            .filter(|p| p.file_name().unwrap().to_str().unwrap().starts_with(kind))
            .map(|p| (p.clone(), std::fs::read(p).unwrap()))
            .collect();
        flood(Path::new(&at(set)), kind, level);
        let said =
            refused(&["calibrate", command, &at(set), "--station", &at("sim/station"), "--quiet"].map(str::to_owned));
        assert!(wants.iter().all(|w| said.contains(w)), "{command} {level}: {said}");
        assert_eq!(said.matches("next step").count(), 1, "{said}");
        kept.iter().for_each(|(path, bytes)| std::fs::write(path, bytes).unwrap());
    }
}
