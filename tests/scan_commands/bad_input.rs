//! In: recordings and stations damaged in every way a user meets. Out: exit codes, sentences with
//! numbers, and nothing half-written under a final name.
//! Frame and unit: none.

use crate::common::{sheetlight, sheetlight_fails};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::raster::{Image, save_png};
use std::path::{Path, PathBuf};

const VALUES: &str = r#"{
  "intrinsics": {"fx": 611.6, "fy": 611.6, "cx": 315, "cy": 232, "width": 640, "height": 480,
                 "distortion_k1_k2_p1_p2_k3": [0, 0, 0, 0, 0]},
  "flange_T_camera": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1],
  "laser_plane_camera": {"normal": [0, 0.883, 0.469], "offset_mm": 72}}"#;

/// A straight Gaussian stripe along the rows.
fn stripe(row: f64) -> Image {
    let level = |y: usize| (200.0 * (-0.5 * ((y as f64 - row) / 1.2).powi(2)).exp()) as u8 + 2;
    Image::from_u8(640, 480, (0..480).flat_map(|y| std::iter::repeat_n(level(y), 640)).collect())
}

/// A station and a recording of `shots` shots, 0.3 mm apart, in a temporary folder.
struct Bench {
    _dir: tempfile::TempDir,
    recording: PathBuf,
    station: String,
    out: String,
}

impl Bench {
    fn new(shots: usize) -> Bench {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        std::fs::write(at("values.json"), VALUES).unwrap();
        let station = at("station").to_str().unwrap().to_owned();
        sheetlight(&["station", "import", at("values.json").to_str().unwrap(), "--station", &station]);
        let recording = at("recording");
        std::fs::create_dir(&recording).unwrap();
        let poses: Vec<Rigid<Base, Flange>> =
            (0..shots).map(|i| Rigid::from_vectors(&Vec3::zeros(), Vec3::new(0.0, 0.3 * i as f64, 0.0))).collect();
        sheetlight::recording::save_poses(&recording.join("poses.json"), &poses).unwrap();
        let frames: Vec<_> = (0..shots).map(|i| serde_json::json!({"laser": format!("{i}.png"), "pose": i})).collect();
        for i in 0..shots {
            save_png(&stripe(230.0 + i as f64 * 0.01), &recording.join(format!("{i}.png"))).unwrap();
        }
        let meta = serde_json::json!({
            "format": 1, "set": "bench", "units": "mm", "beam": "line", "pose_file": "poses", "frames": frames,
            "image": {"width": 640, "height": 480, "bits": 8, "channels": 1, "response": "linear",
                      "pixel_centre": "integer coordinates"}});
        std::fs::write(recording.join("meta.json"), meta.to_string()).unwrap();
        let out = at("out").to_str().unwrap().to_owned();
        Bench { _dir: dir, recording, station, out }
    }
    fn args<'a>(&'a self, more: &[&'a str]) -> Vec<&'a str> {
        let mut args = vec![
            "scan",
            self.recording.to_str().unwrap(),
            "--station",
            &self.station,
            "--out",
            &self.out,
            "--overlays",
            "1",
            "--on",
            "cpu",
        ];
        args.extend(more);
        args
    }
    fn fails(&self, more: &[&str], wants: &[&str]) {
        let (code, text) = sheetlight_fails(&self.args(more));
        assert_eq!(code, 1, "{text}");
        for want in wants.iter().chain(&["next step"]) {
            assert!(text.contains(want), "'{want}' is missing in:\n{text}");
        }
        assert!(!Path::new(&self.out).join("cloud.ply").exists(), "a cloud under its final name");
        assert!(!Path::new(&self.out).join("scan.json").exists(), "a report under its final name");
    }
    fn edit(&self, file: &str, from: &str, to: &str) {
        let path = self.recording.join(file);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file} has no {from}");
        std::fs::write(&path, text.replacen(from, to, 1)).unwrap();
    }
}

#[test]
fn a_good_recording_scans() {
    let b = Bench::new(20);
    let report: serde_json::Value = serde_json::from_str(&sheetlight(&b.args(&["--json"]))).unwrap();
    assert_eq!(report["shots"], 20);
    assert!(report["points"].as_u64().unwrap() > 20 * 500, "{report}");
    assert!(Path::new(&b.out).join("cloud.ply").exists());
}

#[test]
fn a_missing_picture_is_named_and_the_rest_is_not_lost() {
    let b = Bench::new(40);
    std::fs::rename(b.recording.join("30.png"), b.recording.join("kept.png")).unwrap();
    b.fails(&[], &["30.png", "--resume", "--skip-bad"]);
    // Repaired and resumed, the cloud is the one of an undisturbed scan.
    std::fs::rename(b.recording.join("kept.png"), b.recording.join("30.png")).unwrap();
    sheetlight(&b.args(&["--resume"]));
    let resumed = sheetlight::scan::read_cloud(&Path::new(&b.out).join("cloud.ply")).unwrap();
    sheetlight(&b.args(&[]));
    let whole = sheetlight::scan::read_cloud(&Path::new(&b.out).join("cloud.ply")).unwrap();
    assert_eq!(resumed.len(), whole.len());
    assert!(resumed == whole, "resuming changed the points");
}

#[test]
fn a_bad_shot_can_be_left_out_and_is_listed() {
    let b = Bench::new(20);
    let whole = std::fs::read(b.recording.join("7.png")).unwrap();
    std::fs::write(b.recording.join("7.png"), &whole[..whole.len() / 2]).unwrap();
    b.fails(&[], &["7.png"]);
    let report: serde_json::Value = serde_json::from_str(&sheetlight(&b.args(&["--skip-bad", "--json"]))).unwrap();
    assert!(report["skipped"][0][0].as_str().unwrap().contains("7.png"), "{report}");
}

#[test]
fn frames_that_name_no_pose_are_paired_in_order_where_none_is_missing() {
    let b = Bench::new(20);
    let points = || {
        sheetlight(&b.args(&[]));
        let points = sheetlight::scan::read_cloud(&Path::new(&b.out).join("cloud.ply")).unwrap();
        std::fs::remove_dir_all(&b.out).unwrap();
        points
    };
    let named = points();
    (0..20).for_each(|i| b.edit("meta.json", &format!(",\"pose\":{i}}}"), "}"));
    assert!(points() == named, "other points where the poses were paired in order");
    let path = b.recording.join("poses.json");
    let poses = sheetlight::recording::load_poses(&path).unwrap().poses;
    sheetlight::recording::save_poses(&path, &poses[..19]).unwrap();
    b.fails(&[], &["names no pose", "20 frames and 19 poses", "or a pose was lost"]);
}

#[test]
fn repeated_pictures_and_poses_are_named() {
    let b = Bench::new(20);
    let remarks = || {
        let report: serde_json::Value = serde_json::from_str(&sheetlight(&b.args(&["--json"]))).unwrap();
        report["remarks"].to_string()
    };
    let said = remarks();
    assert!(!said.contains("two poses") && !said.contains("same pose"), "{said}");
    std::fs::copy(b.recording.join("7.png"), b.recording.join("8.png")).unwrap();
    b.edit("meta.json", "\"pose\":12", "\"pose\":11");
    let said = remarks();
    assert!(said.contains("shots 7 and 8 have the same picture at two poses"), "{said}");
    assert!(said.contains("shots 11 and 12 have two pictures at the same pose"), "{said}");
}

#[test]
fn wrong_sizes_depths_and_poses_are_named_with_their_numbers() {
    let b = Bench::new(12);
    save_png(&Image::from_u8(320, 240, vec![0; 320 * 240]), &b.recording.join("3.png")).unwrap();
    b.fails(&[], &["3.png", "320x240", "640x480"]);
    let b = Bench::new(12);
    save_png(&Image::from_u16(640, 480, 12, vec![0; 640 * 480]), &b.recording.join("3.png")).unwrap();
    b.fails(&[], &["3.png", "16 bits"]);
    let b = Bench::new(12);
    b.edit("meta.json", "\"pose\":11", "\"pose\":12");
    b.fails(&[], &["needs pose 12", "has 12"]);
    let b = Bench::new(12);
    let path = b.recording.join("poses.json");
    let poses = sheetlight::recording::load_poses(&path).unwrap().poses;
    sheetlight::recording::save_poses(&path, &poses[..9]).unwrap();
    b.fails(&[], &["needs pose 9", "has 9"]);
    let b = Bench::new(12);
    b.edit("poses.json", "1.0", "\"NaN\"");
    b.fails(&[], &["poses.json"]);
    let b = Bench::new(12);
    b.edit("poses.json", "1.0", "1.1");
    b.fails(&[], &["pose 0", "orthonormal"]);
    let b = Bench::new(12);
    b.edit("meta.json", "\"mm\"", "\"inch\"");
    b.fails(&[], &["inch"]);
    let b = Bench::new(12);
    b.edit("meta.json", "\"channels\":1", "\"channels\":2");
    b.fails(&[], &["image.channels is 2"]);
    let b = Bench::new(12);
    b.edit("meta.json", "\"beam\"", "\"beem\"");
    b.fails(&[], &["beem"]);
}

#[test]
fn black_and_white_shots_are_data() {
    let b = Bench::new(12);
    save_png(&Image::from_u8(640, 480, vec![0; 640 * 480]), &b.recording.join("4.png")).unwrap();
    save_png(&Image::from_u8(640, 480, vec![255; 640 * 480]), &b.recording.join("5.png")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&sheetlight(&b.args(&["--json"]))).unwrap();
    assert_eq!(report["dark_shots"], serde_json::json!([4, 5]));
}

#[test]
fn stations_and_outputs_are_checked() {
    let b = Bench::new(4);
    let (code, text) =
        sheetlight_fails(&["scan", b.recording.to_str().unwrap(), "--station", "/nowhere", "--out", &b.out]);
    assert!(code == 1 && text.contains("station"), "{text}");
    std::fs::write(Path::new(&b.station).join("station.toml"), "nmae = 'x'").unwrap();
    b.fails(&[], &["nmae"]);
    let b = Bench::new(4);
    std::fs::remove_file(Path::new(&b.station).join("calibration/laser_plane.json")).unwrap();
    b.fails(&[], &["no laser plane calibration"]);
    // A file where the folder should be cannot be written into, whoever runs the test.
    let b = Bench::new(4);
    std::fs::write(&b.out, "in the way").unwrap();
    let (code, text) = sheetlight_fails(&b.args(&[]));
    assert!(code == 1 && text.contains("cannot be written"), "{text}");
    let (code, _) = sheetlight_fails(&["scan", "--nonsense"]);
    assert_eq!(code, 2);
}

#[test]
fn a_scan_without_any_stripe_says_what_was_seen() {
    for (level, wants) in [(0u8, ["black", "the pictures are dark"]), (255, ["white", "the pictures are white"])] {
        let b = Bench::new(4);
        for i in 0..4 {
            save_png(&Image::from_u8(640, 480, vec![level; 640 * 480]), &b.recording.join(format!("{i}.png"))).unwrap();
        }
        let (code, text) = sheetlight_fails(&b.args(&["--json"]));
        assert!(code == 1 && text.contains("no point in 4 shots") && text.contains(wants[1]), "{}: {text}", wants[0]);
        assert!(text.contains(&format!("brightest {level} of 255")) && text.contains("next step"), "{text}");
        let report = sheetlight::station::load_report(Path::new(&b.out)).unwrap();
        assert_eq!((report.points, report.median_sigma_mm, report.dark_shots.len()), (0, None, 4));
        assert!(Path::new(&b.out).join("index.html").exists());
    }
}
