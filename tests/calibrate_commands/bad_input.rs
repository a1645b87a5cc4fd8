//! In: simulated recordings of boards, spoilt in every way a user meets. Out: exit codes and sentences with
//! numbers and a next step; a station that keeps what it had.
//! Frame and unit: mm, degrees.

use crate::common::{sheetlight, sheetlight_fails};
use serde_json::{Value, json};
use sheetlight::geometry::{Base, Flange, Mat3, Rigid, Vec3, exp};
use sheetlight::raster::{Channel, Image, load, save_png};
use sheetlight::recording::{load_poses, save_poses};
use std::path::{Path, PathBuf};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Recordings of one simulated station, made once for all tests; each test spoils a copy.
fn simulated() -> &'static Path {
    static MADE: std::sync::OnceLock<tempfile::TempDir> = std::sync::OnceLock::new();
    let dir = MADE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let sets = "intrinsics,handeye,laserplane,pointer_cal";
        sheetlight(&["simulate", "--out", text(dir.path()), "--set", sets, "--seed", "3"]);
        dir
    });
    dir.path()
}

struct Case {
    _dir: tempfile::TempDir,
    recording: PathBuf,
    station: String,
}

impl Case {
    /// A copy of a recording and of the station with its true calibration.
    fn new(set: &str) -> Case {
        let dir = tempfile::tempdir().unwrap();
        let copy = |from: &Path, to: &Path| {
            std::fs::create_dir_all(to).unwrap();
            for entry in std::fs::read_dir(from).unwrap().flatten().filter(|e| e.path().is_file()) {
                std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
            }
        };
        let (recording, station) = (dir.path().join(set), dir.path().join("station"));
        copy(&simulated().join(set), &recording);
        copy(&simulated().join("station"), &station);
        copy(&simulated().join("station/calibration"), &station.join("calibration"));
        Case { station: text(&station).to_owned(), _dir: dir, recording }
    }
    fn args<'a>(&'a self, what: &'a str, more: &[&'a str]) -> Vec<&'a str> {
        let mut args = vec!["calibrate", what, text(&self.recording), "--station", &self.station];
        args.extend(more);
        args
    }
    /// The command fails, says all of `wants` and a next step, and leaves the former calibration as it was.
    fn fails(&self, what: &str, more: &[&str], wants: &[&str]) -> String {
        let kind = what.replace('-', "_");
        let stored = Path::new(&self.station).join("calibration").join(format!("{kind}.json"));
        let before = std::fs::read(&stored).unwrap();
        let (code, said) = sheetlight_fails(&self.args(what, more));
        assert!(code == 1 || code == 2, "{said}");
        for want in wants.iter().chain(&["next step"]) {
            assert!(said.contains(want), "'{want}' is missing in:\n{said}");
        }
        assert!(std::fs::read(&stored).unwrap() == before, "the former {kind} calibration was replaced");
        said
    }
    fn succeeds(&self, what: &str, more: &[&str]) -> Value {
        let mut args = self.args(what, more);
        args.push("--json");
        serde_json::from_str(&sheetlight(&args)).unwrap()
    }
    fn meta(&self, change: impl Fn(&mut Value)) {
        let path = self.recording.join("meta.json");
        let mut meta: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
        change(&mut meta);
        std::fs::write(&path, meta.to_string()).unwrap();
    }
    fn poses(&self, change: impl Fn(&mut Vec<Rigid<Base, Flange>>)) {
        let path = self.recording.join("poses_noisy.json");
        let mut poses = load_poses(&path).unwrap().poses;
        change(&mut poses);
        save_poses(&path, &poses).unwrap();
    }
    /// Only these frames are left.
    fn keep(&self, frames: &[usize]) {
        self.meta(|m| {
            let kept: Vec<Value> = frames.iter().map(|&i| m["frames"][i].clone()).collect();
            m["frames"] = json!(kept);
        });
    }
    fn overwrite(&self, picture: &str, image: &Image) {
        save_png(image, &self.recording.join(picture)).unwrap();
    }
}

const NOISY: [&str; 2] = ["--poses", "poses_noisy"];

fn black() -> Image {
    Image::from_u8(640, 480, vec![2; 640 * 480])
}

#[test]
fn pictures_without_a_board_are_named_with_the_reason() {
    let c = Case::new("intrinsics");
    c.overwrite("ambient_0003.png", &black());
    let whole = load(&c.recording.join("ambient_0005.png"), Channel::Luma, 8).unwrap().to_u8();
    let cut: Vec<u8> = (0..640 * 480).map(|i| whole[i / 640 * 640 + (i % 640 + 340) % 640]).collect();
    c.overwrite("ambient_0005.png", &Image::from_u8(640, 480, cut));
    let reasons = c.succeeds("camera", &[])["quality"]["reasons"].to_string();
    for want in ["ambient_0003.png was excluded", "grey levels span", "ambient_0005.png was excluded", "cut off"] {
        assert!(reasons.contains(want), "'{want}' is missing in {reasons}");
    }
    (0..20).for_each(|i| c.overwrite(&format!("ambient_{i:04}.png"), &black()));
    c.fails("camera", &[], &["0 of 20 pictures", "ambient_0019.png", "grey levels span"]);
    let c = Case::new("handeye");
    (0..16).for_each(|i| c.overwrite(&format!("ambient_{i:04}.png"), &black()));
    c.fails("hand-eye", &NOISY, &["16 pictures", "ambient_0000.png", "grey levels span"]);
}

/// All laser pictures, or half of them, are turned or mirrored against their ambient pictures.
#[test]
fn laser_pictures_turned_against_their_ambient_ones_are_named() {
    for (half, columns, rows, wanted) in [
        (false, true, true, "the laser pictures are turned by 180 degrees against the ambient pictures"),
        (false, false, true, "the laser pictures are mirrored top to bottom against the ambient pictures"),
        (true, true, true, "laser pictures are turned by 180 degrees against the ambient pictures"),
    ] {
        let c = Case::new("laserplane");
        let meta = std::fs::read_to_string(c.recording.join("meta.json")).unwrap();
        let meta: Value = serde_json::from_str(&meta).unwrap();
        let names = meta["frames"].as_array().unwrap().iter().map(|f| f["laser"].as_str().unwrap());
        for name in names.enumerate().filter(|(i, _)| !half || i % 2 == 1).map(|(_, name)| name) {
            let image = load(&c.recording.join(name), Channel::Luma, 8).unwrap();
            let mut lines: Vec<Vec<u8>> = image.to_u8().chunks(image.width as usize).map(<[u8]>::to_vec).collect();
            if columns {
                lines.iter_mut().for_each(|line| line.reverse());
            }
            if rows {
                lines.reverse();
            }
            c.overwrite(name, &Image::from_u8(image.width, image.height, lines.concat()));
        }
        c.fails("laser-plane", &["--on", "cpu"], &[wanted, "agree on one laser plane"]);
    }
}

#[test]
fn a_wrong_board_is_told_by_its_size() {
    let c = Case::new("intrinsics");
    c.meta(|m| m["board"]["inner_corners"] = json!([8, 6]));
    c.fails("camera", &[], &["0 of 20", "9x6", "wrong board size"]);
    // Too many corners stated: the board that is there is named, once.
    c.meta(|m| m["board"]["inner_corners"] = json!([10, 6]));
    c.fails("camera", &[], &["0 of 20", "(4 pictures)", "wrong board size", "state inner_corners [9, 6]"]);
    c.meta(|m| m["board"]["inner_corners"] = json!([9, 6, 1]));
    c.fails("camera", &[], &["meta.json"]);
    // Squares 3 % smaller than stated show against the robot's lengths.
    let c = Case::new("handeye");
    c.meta(|m| m["board"]["square_mm"] = json!(15.0 / 0.97));
    c.fails("hand-eye", &NOISY, &["the board's lengths are 97.0 %", "square_mm"]);
    let c = Case::new("laserplane");
    c.meta(|m| m["frames"][3].as_object_mut().unwrap().remove("board").map_or((), drop));
    c.fails("laser-plane", &["--on", "cpu"], &["frame 3 does not say which of 2 boards it shows", "counted from 0"]);
    let c = Case::new("laserplane");
    c.meta(|m| m["boards"] = json!([{"type": "chessboard", "inner_corners": [7, 3], "square_mm": 8.0}]));
    c.fails("laser-plane", &["--on", "cpu"], &["board"]);
    // Metres: a print of 0.08 mm.
    c.meta(|m| m["boards"] = json!([{"type": "chessboard", "inner_corners": [7, 3], "square_mm": 0.01}]));
    c.fails("laser-plane", &["--on", "cpu"], &["square_mm is 0.01", "at least 2 is accepted", "look like metres"]);
}

#[test]
fn mixed_sizes_and_empty_folders_are_named() {
    let c = Case::new("intrinsics");
    c.overwrite("ambient_0002.png", &Image::from_u8(320, 240, vec![0; 320 * 240]));
    c.fails("camera", &[], &["ambient_0002.png", "320x240", "640x480"]);
    let c = Case::new("handeye");
    c.overwrite("ambient_0002.png", &Image::from_u8(320, 240, vec![0; 320 * 240]));
    c.fails("hand-eye", &NOISY, &["ambient_0002.png", "320x240", "640x480"]);
    // A station whose camera has another resolution.
    let c = Case::new("handeye");
    let camera = Path::new(&c.station).join("calibration/camera.json");
    let text = std::fs::read_to_string(&camera).unwrap();
    let mut other: serde_json::Value = serde_json::from_str(&text).unwrap();
    other.as_object_mut().unwrap().remove("seal");
    other["value"]["width"] = 1280.into();
    std::fs::write(&camera, sheetlight::rig::sealed(&other)).unwrap();
    c.fails("hand-eye", &NOISY, &["640x480", "1280x480"]);
    for what in ["camera", "hand-eye", "laser-plane", "pointer"] {
        let c = Case::new("intrinsics");
        std::fs::remove_dir_all(&c.recording).unwrap();
        std::fs::create_dir(&c.recording).unwrap();
        c.fails(what, &[], &["meta.json"]);
        std::fs::remove_dir(&c.recording).unwrap();
        c.fails(what, &[], &["not a folder"]);
    }
    let c = Case::new("intrinsics");
    c.keep(&[]);
    c.fails("camera", &[], &["frames"]);
}

#[test]
fn poses_that_cannot_be_are_named() {
    let fails = |change: &dyn Fn(&mut Vec<Rigid<Base, Flange>>), wants: &[&str]| {
        let c = Case::new("handeye");
        c.poses(change);
        c.fails("hand-eye", &NOISY, wants);
    };
    fails(&|p| p.iter_mut().for_each(|p| p.translation /= 1000.0), &["metres"]);
    fails(&|p| p.reverse(), &["reverse order"]);
    fails(&|p| p.rotate_left(1), &["1 places"]);
    fails(&|p| p[5] = p[4], &["duplicate", "ambient_0004.png", "ambient_0005.png"]);
    fails(&|p| p.truncate(12), &["needs pose 12", "has 12"]);
    fails(
        &|p| {
            let old = p.clone();
            (0..p.len()).for_each(|i| p[i] = old[(5 * i + 3) % old.len()]);
        },
        &["do not belong together"],
    );
    // Every pose inverted: flange in base taken for base in flange.
    fails(
        &|p| {
            p.iter_mut()
                .for_each(|p| *p = Rigid::new(p.rotation.transpose(), -(p.rotation.transpose() * p.translation)))
        },
        &["inverted"],
    );
    let c = Case::new("handeye");
    c.fails("hand-eye", &["--poses", "poses_of_tuesday"], &["poses_of_tuesday"]);
    c.fails("hand-eye", &[], &["poses_exact, poses_noisy"]);
}

#[test]
fn wrong_pairs_and_outlier_pictures_are_named() {
    // A fifth of the pictures with each other's poses.
    let c = Case::new("handeye");
    c.poses(|p| {
        let first = p[2];
        (p[2], p[7], p[11]) = (p[7], p[11], first);
    });
    let found = c.succeeds("hand-eye", &NOISY);
    let reasons = found["quality"]["reasons"].to_string();
    for name in ["ambient_0002.png", "ambient_0007.png", "ambient_0011.png"] {
        assert!(reasons.contains(&format!("{name} was excluded")), "{name}: {reasons}");
    }
    assert_eq!(found["quality"]["verdict"], "usable", "{reasons}");
    // One picture of the board bent by half a square: its corners no longer lie on the lattice.
    let c = Case::new("intrinsics");
    let image = load(&c.recording.join("ambient_0006.png"), Channel::Luma, 8).unwrap();
    let grey = image.to_u8();
    let bent: Vec<u8> = (0..640 * 480)
        .map(|i| {
            let (x, y) = (i % 640, i / 640);
            let shift = (8.0 * (std::f64::consts::PI * y as f64 / 480.0).sin()).round() as usize;
            grey[y * 640 + (x + shift).min(639)]
        })
        .collect();
    c.overwrite("ambient_0006.png", &Image::from_u8(640, 480, bent));
    let reasons = c.succeeds("camera", &[])["quality"]["reasons"].to_string();
    assert!(reasons.contains("ambient_0006.png was excluded"), "{reasons}");
}

#[test]
fn degenerate_sets_are_refused_with_the_reason() {
    let c = Case::new("intrinsics");
    c.keep(&[0, 1]);
    c.fails("camera", &[], &["badly determined", "2 pictures"]);
    c.keep(&[0]);
    c.fails("camera", &[], &["1 of 1 pictures"]);
    // One picture over and over: boards that are all parallel.
    let c = Case::new("intrinsics");
    c.keep(&[4; 8]);
    c.fails("camera", &[], &["parallel"]);
    let c = Case::new("handeye");
    c.keep(&[0, 1]);
    c.fails("hand-eye", &NOISY, &["2 pictures", "4 are needed"]);
    // One axis: what the robot says turns about z only.
    let c = Case::new("handeye");
    c.poses(|p| {
        for (i, p) in p.iter_mut().enumerate() {
            let turn: Mat3 = exp(&Vec3::new(0.0, 0.0, 0.1 * i as f64));
            *p = Rigid::new(turn, p.translation);
        }
    });
    c.fails("hand-eye", &NOISY, &["one axis only"]);
    // One board pose for the plane: the stripes lie on one line.
    let c = Case::new("laserplane");
    c.keep(&[2; 6]);
    c.fails("laser-plane", &["--on", "cpu"], &["too alike"]);
    c.keep(&[2]);
    c.fails("laser-plane", &["--on", "cpu"], &["1 frames", "2 are needed"]);
    // Spots in one place tell no direction.
    let c = Case::new("pointer_cal");
    c.keep(&[2; 6]);
    c.fails("pointer", &[], &["one place"]);
}
