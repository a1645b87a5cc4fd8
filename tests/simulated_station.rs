//! In: random specimens of the simulated station, each other in every number. Out: scans through the
//! whole chain judged by the exact surface.
//! Frame and unit: base and part frame, mm.

use sheetlight::geometry::Vec3;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{Extraction, GridOptions, RecordingSource, Where, read_cloud};
use sheetlight::simulate::{Set, SimulateOptions, simulate};
use sheetlight::station::judge;
use sheetlight::station::{Judged, ScanOptions};
use std::path::{Path, PathBuf};

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes").join(name)
}

/// Simulates a scan into `out` and scans it with the twins.
fn scanned(out: &Path, options: &SimulateOptions) -> Judged {
    simulate(out, options, &|_, _| {}).unwrap();
    let recording = Recording::open(&out.join("scan")).unwrap();
    let rig = Rig::load(&out.join("station")).unwrap();
    let scan = ScanOptions {
        latency: None,
        out: out.join("result"),
        place: Where::Cpu,
        extraction: Extraction::default(),
        grid: GridOptions::default(),
        volume: None,
        motion: sheetlight::recording::Motion::default(),
        ambient: None,
        overlays: 1,
        skip_bad: false,
        resume: false,
        stop: Default::default(),
        watch: Default::default(),
    };
    let open = |first| Ok(Box::new(RecordingSource::open(&recording, None, first)?) as Box<_>);
    sheetlight::station::scan("test", "test", open, &rig, &scan, |_, _| {}).unwrap();
    judge(&scan.out, &out.join("scan/truth.json"), &[]).unwrap()
}

#[test]
fn scans_of_random_stations_lie_on_the_true_surface() {
    for seed in [2, 9] {
        let dir = tempfile::tempdir().unwrap();
        let options = SimulateOptions { seed, shots: 30, ..SimulateOptions::default() };
        let judged = scanned(dir.path(), &options);
        let e = &judged.cloud;
        println!(
            "seed {seed}: {} points, median {:.4}, rms {:.4}, 95 % {:.4} mm, {:.3} % beyond 1 mm, within sigmas {:.3?}",
            e.points,
            e.median_mm,
            e.rms_without_outliers_mm,
            e.p95_mm,
            100.0 * e.outliers_share,
            judged.within_sigmas
        );
        assert!(e.points > 12_000, "{}", e.points);
        assert!(e.median_mm < 0.02 && e.rms_without_outliers_mm < 0.06, "seed {seed}: {e:?}");
        assert!(e.outliers_share < 1e-3, "seed {seed}: {}", e.outliers_share);
        // A normal distribution has 0.683; what the points say of themselves is neither boast nor alarm.
        assert!((0.6..0.8).contains(&judged.within_sigmas[0]), "seed {seed}: {:?}", judged.within_sigmas);
        let page = std::fs::read_to_string(dir.path().join("result/index.html")).unwrap();
        assert!(page.contains("Errors against the truth") && !page.contains("http://") && !page.contains("src=\"/"));
    }
}

/// Four grey levels of noise in every pixel, coarse speckle, half the light: what is noise must not become points.
#[test]
fn a_noisy_sensor_gives_fewer_points_and_no_false_ones() {
    let dir = tempfile::tempdir().unwrap();
    let mut options = SimulateOptions { seed: 5, shots: 30, ..SimulateOptions::default() }.with_noise(2.0);
    options.sensor.laser_white = 0.5;
    options.sensor.speckle = 0.3;
    let judged = scanned(dir.path(), &options);
    let e = &judged.cloud;
    println!(
        "{} points, median {:.4}, 95 % {:.4} mm, {:.3} % beyond 1 mm, within sigmas {:.3?}",
        e.points,
        e.median_mm,
        e.p95_mm,
        100.0 * e.outliers_share,
        judged.within_sigmas
    );
    assert!(e.points > 12_000, "{}", e.points);
    assert!(e.outliers_share < 1e-3, "{}", e.outliers_share);
    assert!(e.median_mm < 0.06 && e.p95_mm < 0.2, "{e:?}");
    assert!((0.6..0.85).contains(&judged.within_sigmas[0]), "{:?}", judged.within_sigmas);
}

/// A real laser's speckle goes over several pixels: errors are larger than pixel noise would make them, and the
/// points say so.
#[test]
fn speckle_with_grains_is_in_what_the_points_state() {
    for (seed, grain_px) in [(6, 0.7), (7, 1.3)] {
        let dir = tempfile::tempdir().unwrap();
        let mut options = SimulateOptions { seed, shots: 30, ..SimulateOptions::default() };
        (options.sensor.grain_px, options.sensor.speckle, options.sensor.blur_px) = (grain_px, 0.2, 1.5);
        let judged = scanned(dir.path(), &options);
        let report: serde_json::Value =
            serde_json::from_slice(&std::fs::read(dir.path().join("result/scan.json")).unwrap()).unwrap();
        println!("grains of {grain_px} px, {}: within sigmas {:.3?}", report["stripe"], judged.within_sigmas);
        let seen = report["stripe"]["grain_px"].as_f64().unwrap();
        assert!((seen / grain_px - 1.0).abs() < 0.3, "grains of {grain_px} px, seen {seen}");
        assert!((0.6..0.8).contains(&judged.within_sigmas[0]), "{grain_px}: {:?}", judged.within_sigmas);
    }
}

#[test]
fn steps_are_right_to_four_micrometres() {
    let dir = tempfile::tempdir().unwrap();
    let options =
        SimulateOptions { seed: 4, shots: 70, scene: Some(scene("steps.toml")), ..SimulateOptions::default() };
    scanned(dir.path(), &options);
    let truth = sheetlight::simulate::Truth::load(&dir.path().join("scan/truth.json")).unwrap();
    let part_from_base = truth.file.parts[0].base_from_part.inverse();
    let cloud = read_cloud(&dir.path().join("result/cloud.ply")).unwrap();
    let points: Vec<Vec3> = cloud.iter().map(|p| part_from_base.point(&p.at())).collect();
    // The middle of each tread, 2 mm from its edges.
    let mean = |i: usize| {
        let x = -24.0 + 12.0 * i as f64;
        let on: Vec<f64> =
            points.iter().filter(|p| (p.x - x).abs() < 4.0 && p.y.abs() < 12.0 && p.z > -1.0).map(|p| p.z).collect();
        assert!(on.len() > 500, "tread {i}: {} points", on.len());
        on.iter().sum::<f64>() / on.len() as f64
    };
    let heights: Vec<f64> = (0..5).map(mean).collect();
    for (pair, want) in heights.windows(2).zip([0.1, 0.5, 1.0, 5.0]) {
        let error = pair[1] - pair[0] - want;
        println!("step {want} mm: error {error:.4} mm");
        assert!(error.abs() < 0.004, "step {want}: {error:.4}");
    }
}

#[test]
fn the_same_options_give_the_same_files() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let options = SimulateOptions {
        sets: vec![Set::Scan, Set::Laserplane],
        shots: 3,
        width: 320,
        height: 240,
        seed: 11,
        ..SimulateOptions::default()
    };
    simulate(a.path(), &options, &|_, _| {}).unwrap();
    simulate(b.path(), &options, &|_, _| {}).unwrap();
    for name in ["scan/laser_0001.png", "scan/poses.json", "scan/truth.json", "laserplane/ambient_0003.png"] {
        let [x, y] = [&a, &b].map(|d| std::fs::read(d.path().join(name)).unwrap());
        assert!(x == y, "{name}");
    }
    let other = tempfile::tempdir().unwrap();
    simulate(other.path(), &SimulateOptions { seed: 12, ..options }, &|_, _| {}).unwrap();
    let name = "scan/laser_0001.png";
    assert!(std::fs::read(a.path().join(name)).unwrap() != std::fs::read(other.path().join(name)).unwrap());
}
