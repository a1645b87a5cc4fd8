//! In: simulated recordings with several exposures of each pose. Out: whether the merged shots show what no single
//! exposure does, whether their points scatter as they say, and whether what is no bracket is refused.
//! Frame and unit: base frame, mm.

use sheetlight::fault::Fault;
use sheetlight::geometry::{Base, Rigid, Vec3};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::{CloudPoint, Where, read_cloud};
use sheetlight::simulate::{InScene, SimulateOptions, simulate};
use sheetlight::station::{Judged, ScanOptions, ScanReport, Settings, judge, scan_recording};
use std::path::{Path, PathBuf};

/// A simulated recording, and scans of it.
struct Bench {
    dir: tempfile::TempDir,
}

/// A scan's report, its points and its distances from the truth.
struct Scanned {
    report: ScanReport,
    cloud: Vec<CloudPoint>,
    judged: Judged,
}

impl Bench {
    fn new(scene: &Path, exposures: &[f64], change: impl FnOnce(&mut SimulateOptions)) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let mut options = SimulateOptions {
            scene: Some(scene.to_owned()),
            exposures: exposures.to_vec(),
            seed: 3,
            shots: 40,
            ..SimulateOptions::default()
        };
        change(&mut options);
        simulate(dir.path(), &options, &|_, _| {}).unwrap();
        Bench { dir }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn recording(&self) -> Recording {
        Recording::open(&self.at("scan")).unwrap()
    }

    fn try_scan(&self, recording: &Recording, change: impl FnOnce(&mut ScanOptions)) -> Result<Scanned, Fault> {
        let rig = Rig::load(&self.at("station"))?;
        let out = self.at("out");
        let mut options = ScanOptions::for_station(&Settings::default(), &rig, &out);
        options.place = Where::Cpu;
        change(&mut options);
        let report = scan_recording(recording, None, &rig, &options, |_, _| {})?;
        let judged = judge(&out, &self.at("scan/truth.json"), &[])?;
        Ok(Scanned { report, cloud: read_cloud(&out.join("cloud.ply"))?, judged })
    }

    fn scan(&self) -> Scanned {
        self.try_scan(&self.recording(), |_| {}).unwrap()
    }

    fn scan_one(&self, exposure: usize) -> Scanned {
        let mut recording = self.recording();
        recording.use_exposure(exposure).unwrap();
        self.try_scan(&recording, |_| {}).unwrap()
    }

    /// Share of the visible points of the middle of the sheet that have a scanned point within a quarter millimetre.
    fn completeness(&self, cloud: &[CloudPoint]) -> f64 {
        const NEAR: f64 = 0.25;
        let cell = |p: &[f64; 3]| p.map(|x| (x / NEAR).floor() as i64);
        let mut cells: std::collections::HashMap<[i64; 3], Vec<[f64; 3]>> = Default::default();
        for p in cloud {
            let p = p.position.as_dvec3().to_array();
            cells.entry(cell(&p)).or_default().push(p);
        }
        let bytes = std::fs::read(self.at("scan/visible.ply")).unwrap();
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let number = |b: &[u8]| f64::from(f32::from_le_bytes(b.try_into().unwrap()));
        let visible: Vec<[f64; 3]> =
            bytes[end..].chunks_exact(12).map(|p| [0, 4, 8].map(|i| number(&p[i..i + 4]))).collect();
        let found = visible.iter().filter(|v| {
            let [x, y, z] = cell(v);
            let beside = (0..27).map(|i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
            let near = |p: &[f64; 3]| (0..3).map(|k| (p[k] - v[k]).powi(2)).sum::<f64>() < NEAR * NEAR;
            beside.filter_map(|at| cells.get(&at)).flatten().any(near)
        });
        found.count() as f64 / visible.len() as f64
    }

    /// Changes the text of the recording's meta.json; the fault when it is opened.
    fn refused(&self, change: impl FnOnce(&mut serde_json::Value)) -> String {
        let path = self.at("scan/meta.json");
        let text = std::fs::read_to_string(&path).unwrap();
        let mut meta = serde_json::from_str(&text).unwrap();
        change(&mut meta);
        std::fs::write(&path, meta.to_string()).unwrap();
        let fault = Recording::open(&self.at("scan")).unwrap_err().to_string();
        std::fs::write(&path, text).unwrap();
        fault
    }
}

fn contrast() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data/scenes/contrast.toml")
}

fn plate(dir: &Path) -> PathBuf {
    let path = dir.join("plate.toml");
    let text = "name = 'plate'\nregion_mm = [-15, -12, 15, 12]\n[[solid]]\n\
                shape = { block = { size_mm = [160, 140, 5] } }\nat_mm = [0, 0, 0]\nmaterial = { albedo = 0.5 }";
    std::fs::write(&path, text).unwrap();
    path
}

/// Exposures as peaks of the stripe on white: black plastic, a white label and bare solder need all three.
const THREE: [f64; 3] = [0.15, 1.0, 6.0];

/// The best single exposure is searched from one that shows only label and solder to one in which the room's light
/// is as bright as the stripe on black.
#[test]
fn three_exposures_show_black_white_and_shiny_parts_better_than_one() {
    let bench = Bench::new(&contrast(), &THREE, |_| {});
    let merged = bench.scan();
    let complete = bench.completeness(&merged.cloud);
    let rms = merged.judged.cloud.rms_without_outliers_mm;
    println!("merged: completeness {complete:.4}, rms {rms:.4} mm");
    assert!(complete >= 0.97, "{complete}");
    let mut best = f64::INFINITY;
    for (exposures, n) in [([0.5, 1.0, 2.0], 3), ([3.0, 4.0, 5.0], 3), ([6.0, 8.0, 12.0], 3)] {
        let singles = Bench::new(&contrast(), &exposures, |_| {});
        for i in 1..=n {
            let single = singles.scan_one(i);
            let (complete, rms) = (bench.completeness(&single.cloud), single.judged.cloud.rms_without_outliers_mm);
            println!("one of {}: completeness {complete:.4}, rms {rms:.4} mm", exposures[i - 1]);
            if complete >= 0.97 {
                best = best.min(rms);
            }
        }
    }
    assert!(rms <= best, "merged {rms} mm, the best single exposure {best} mm");
    let exposures = merged.report.exposures.expect("merged");
    assert_eq!((merged.report.shots, exposures.pictures, exposures.shares.len()), (40, 120, 3));
    let all: f64 = exposures.shares.iter().sum::<f64>() + exposures.saturated;
    assert!((all - 1.0).abs() < 1e-12 && exposures.shares.iter().all(|s| *s > 1e-4), "{exposures:?}");
}

/// The error of a point is along the sheet, where a wrong centre moves it; the camera looks straight at the plate.
#[test]
fn points_of_a_plate_scatter_as_they_say() {
    let dir = tempfile::tempdir().unwrap();
    let scene = plate(dir.path());
    // Crests in the longest exposure, above its full scale, and above that of the second.
    for (times, speckle) in [(1.0, 0.12), (1.0, 0.0), (4.0, 0.0), (16.0, 0.12), (16.0, 0.0)] {
        let bench = Bench::new(&scene, &[0.06, 0.24, 0.96].map(|e| times * e), |o| o.sensor.speckle = speckle);
        let Scanned { cloud, report, .. } = bench.scan();
        let truth: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(bench.at("scan/truth.json")).unwrap()).unwrap();
        let base_from_scene: Rigid<Base, InScene> = serde_json::from_value(truth["base_T_scene"].clone()).unwrap();
        let sheet = Rig::load(&bench.at("station")).unwrap().need_laser_plane().unwrap().value;
        let along = Vec3::new(sheet.normal.y, -sheet.normal.x, 0.0).normalize();
        let steep = sheet.normal.cross(&along).z.abs();
        let scene_from_base = base_from_scene.inverse();
        let relative = |p: &CloudPoint| (scene_from_base.point(&p.at()).z / steep / f64::from(p.sigma_mm)).powi(2);
        let rms = (cloud.iter().map(relative).sum::<f64>() / cloud.len() as f64).sqrt();
        println!("times {times}, speckle {speckle}: {} points, error over sigma {rms:.3}", cloud.len());
        assert!(cloud.len() > 20_000 && report.exposures.is_some());
        assert!((0.8..1.25).contains(&rms), "times {times}, speckle {speckle}: {rms}");
    }
}

#[test]
fn what_a_recording_states_of_its_exposures_is_honoured_or_refused() {
    let bench = Bench::new(&contrast(), &THREE, |o| o.shots = 4);
    let says = |change: fn(&mut serde_json::Value), words: &[&str]| {
        let fault = bench.refused(change);
        assert!(words.iter().all(|w| fault.contains(w)), "{fault}");
    };
    says(|m| drop(m["frames"][1]["longer"].as_array_mut().unwrap().pop()), &["frame 1 has 2 pictures", "states 3"]);
    says(|m| drop(m["frames"][2].as_object_mut().unwrap().remove("longer")), &["frame 2 has 1 pictures"]);
    says(|m| drop(m.as_object_mut().unwrap().remove("exposures_us")), &["'longer'", "microseconds"]);
    says(
        |m| {
            let times = m.as_object_mut().unwrap().remove("exposures_us").unwrap();
            m["exposures"] = times;
        },
        &["unknown field `exposures`", "exposures_us"],
    );
    says(|m| m["exposures_us"] = serde_json::json!([500, 100, 900]), &["100 us after one of 500 us"]);
    says(|m| m["exposures_us"] = serde_json::json!(["0.5 ms", "2 ms", "8 ms"]), &["invalid type", "f64"]);
    says(|m| m["frames"][1]["longer"][0] = m["frames"][0]["longer"][0].clone(), &["two exposures or two poses"]);
    says(|m| m["frames"][0]["taken"] = serde_json::json!({"id": 1, "host_ns": 1, "exposure_ns": 5000}), &["5 us"]);
    says(|m| m["black_level"] = serde_json::json!(90), &["black level is 90"]);
    // Older versions know neither key, and refuse it.
    let path = bench.at("scan/meta.json");
    assert!(std::fs::read_to_string(&path).unwrap().contains("\"longer\""));
    let ends = |frames: &[&str]| frames.iter().for_each(|n| assert!(bench.at("scan").join(n).exists(), "{n}"));
    ends(&["laser_0003.png", "laser_0003_2.png", "laser_0003_3.png"]);
    // A camera sends one picture a pose.
    let camera: sheetlight::capture::CameraUri = format!("play:{}", bench.at("scan").display()).parse().unwrap();
    let fault = camera.open(None).err().unwrap();
    assert!(fault.what.contains("each pose has 3 pictures"), "{fault}");
}

#[test]
fn pictures_that_are_no_bracket_stop_the_scan() {
    let bench = Bench::new(&contrast(), &THREE, |o| o.shots = 6);
    let picture = |name: &str| bench.at("scan").join(name);
    let refused = || bench.try_scan(&bench.recording(), |_| {}).err().unwrap();
    let swap = |a: &str, b: &str| {
        std::fs::rename(picture(a), picture("aside")).unwrap();
        std::fs::rename(picture(b), picture(a)).unwrap();
        std::fs::rename(picture("aside"), picture(b)).unwrap();
    };
    // The poses are 10 mm apart over surfaces of the same heights: the light is the same, its speckle is not.
    swap("laser_0002_3.png", "laser_0000_3.png");
    let fault = refused();
    assert!(fault.what.contains("laser_0000.png") && fault.what.contains("disagree"), "{fault}");
    assert!(fault.cause.contains("moved"), "{fault}");
    swap("laser_0002_3.png", "laser_0000_3.png");
    // The camera did other exposures than stated.
    let fault = {
        let path = bench.at("scan/meta.json");
        let text = std::fs::read_to_string(&path).unwrap();
        let mut meta: serde_json::Value = serde_json::from_str(&text).unwrap();
        meta["exposures_us"] = serde_json::json!([157.9, 700.0, 6315.8]);
        std::fs::write(&path, meta.to_string()).unwrap();
        let fault = refused();
        std::fs::write(&path, text).unwrap();
        fault
    };
    assert!(fault.what.contains("times the light that the one of 6315.8 us"), "{fault}");
    // A picture of another size, and none at all.
    let small = sheetlight::raster::Image::from_u8(320, 240, vec![0; 320 * 240]);
    sheetlight::raster::save_png(&small, &picture("laser_0003_2.png")).unwrap();
    assert!(refused().what.contains("320x240"), "{}", refused());
    std::fs::remove_file(picture("laser_0003_2.png")).unwrap();
    assert!(refused().what.contains("laser_0003_2.png"), "{}", refused());
}

/// Light with the laser off is merged as the shots are, and subtracted. One exposure alone is scanned as ever.
#[test]
fn ambient_pictures_and_single_exposures() {
    let bench = Bench::new(&contrast(), &THREE, |o| o.shots = 12);
    let recording = bench.recording();
    let dark = |levels: &[u8]| {
        let pictures = levels.iter().map(|&l| sheetlight::raster::Image::from_u8(640, 480, vec![l; 640 * 480]));
        recording.dark(pictures.collect())
    };
    assert!(dark(&[]).unwrap().is_none());
    assert!(dark(&[1]).unwrap_err().what.contains("1 ambient pictures, the shots have 3 exposures"));
    let ambient = dark(&[0, 1, 6]).unwrap().unwrap();
    // 6 levels of the longest exposure: full scale is 40 times its 255.
    assert!((f64::from(ambient.get(5, 5)) / 65535.0 * 40.0 * 255.0 - 6.0).abs() < 0.1, "{}", ambient.get(5, 5));
    let with = bench.try_scan(&recording, |o| o.ambient = Some(ambient)).unwrap();
    let without = bench.scan();
    assert!(with.cloud.len() * 10 > without.cloud.len() * 9 && with.cloud != without.cloud);
    let mut other = bench.recording();
    assert!(other.use_exposure(4).unwrap_err().what.contains("exposure 4 is wanted, it has 3"));
    other.use_exposure(3).unwrap();
    assert!(other.use_exposure(1).unwrap_err().what.contains("one picture each"));
    let one = bench.try_scan(&other, |_| {}).unwrap();
    assert!(one.report.exposures.is_none() && one.report.image.bits == 8 && !one.cloud.is_empty());
    assert!(one.report.remarks.iter().any(|r| r.contains("exposure 3 of each pose")), "{:?}", one.report.remarks);
}
