//! In: the programs under examples/. Out: whether each does what its first lines say, on a simulated station.
//! Frame and unit: as the examples print.

use sheetlight::simulate::{Set, SimulateOptions, simulate};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Runs an example that cargo has built beside this test; its stdout.
fn run(name: &str, arguments: &[&Path]) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_sheetlight")).with_file_name("examples").join(name);
    let out = Command::new(&program).args(arguments).output().unwrap_or_else(|e| panic!("{}: {e}", program.display()));
    assert!(out.status.success(), "{name}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

#[test]
fn every_example_does_what_it_says() {
    let dir = tempfile::tempdir().unwrap();
    let sets = vec![Set::Intrinsics, Set::Scan];
    let options = SimulateOptions { shots: 120, sets, ..SimulateOptions::default() };
    let made = simulate(dir.path(), &options, &|_, _| {}).unwrap();
    let (recording, station, scan) = (dir.path().join("scan"), &made.station, dir.path().join("result"));

    let said = run("scan_recording", &[&recording, station, &scan]);
    assert!(said.contains("points from 120 shots") && scan.join("cloud.ply").exists(), "{said}");

    let mut pictures: Vec<PathBuf> = std::fs::read_dir(&recording)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "png"))
        .collect();
    pictures.sort();
    let said = run("picture_to_points", &[&pictures[pictures.len() / 2], station]);
    let depths: Vec<f64> = said.lines().skip(1).map(|l| l.split(',').nth(4).unwrap().parse().unwrap()).collect();
    // The paper's station stands some 200 mm above its board.
    let (near, far) = (100.0, 350.0);
    assert!(depths.len() > 300, "{} points", depths.len());
    assert!(depths.iter().filter(|z| (near..far).contains(*z)).count() > depths.len() * 95 / 100, "{depths:?}");

    let said = run("calibrate_camera", &[&dir.path().join("intrinsics")]);
    assert!(said.contains("verdict: good") && said.lines().next().unwrap().starts_with("fx "), "{said}");
    assert!(!said.contains("NaN"), "{said}");

    let recipe = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes/led.toml");
    let said = run("find_part", &[&scan, &recipe, station]);
    assert!(said.contains("insertion [") && scan.join("found.png").exists(), "{said}");
}
