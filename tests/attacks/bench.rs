//! In: nothing. Out: a station and a small recording of a straight stripe in a temporary folder, and what attacks on
//! them need.
//! Frame and unit: base frame, mm; pixels.

use super::common::sheetlight;
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use sheetlight::raster::{Image, save_png};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

pub const VALUES: &str = r#"{
  "intrinsics": {"fx": 305.8, "fy": 305.8, "cx": 157, "cy": 116, "width": 320, "height": 240,
                 "distortion_k1_k2_p1_p2_k3": [0, 0, 0, 0, 0]},
  "flange_T_camera": [1, 0, 0, 90, 0, 1, 0, 0, 0, 0, 1, 40, 0, 0, 0, 1],
  "laser_plane_camera": {"normal": [0, 0.883, 0.469], "offset_mm": 72},
  "pointer_camera": {"origin": [10, 60, 0], "direction": [0, -0.6, 0.8]}}"#;

/// A straight Gaussian stripe along the rows, with a little texture so that no two pictures are alike.
pub fn stripe(row: f64, seed: usize) -> Image {
    let level = |x: usize, y: usize| {
        let light = 200.0 * (-0.5 * ((y as f64 - row) / 1.2).powi(2)).exp();
        light as u8 + 2 + ((x * 7 + y * 13 + seed * 5) % 3) as u8
    };
    Image::from_u8(320, 240, (0..240).flat_map(|y| (0..320).map(move |x| level(x, y))).collect())
}

pub struct Bench {
    pub dir: tempfile::TempDir,
    pub shots: usize,
}

impl Bench {
    pub fn new(shots: usize) -> Bench {
        let bench = Bench { dir: tempfile::tempdir().unwrap(), shots };
        std::fs::write(bench.at("values.json"), VALUES).unwrap();
        sheetlight(&["station", "import", &bench.text("values.json"), "--station", &bench.text("station")]);
        bench.record("recording", 0);
        bench
    }
    pub fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }
    pub fn text(&self, name: &str) -> String {
        self.at(name).to_str().unwrap().to_owned()
    }
    /// A recording; another `seed` gives other pictures at the same poses.
    pub fn record(&self, name: &str, seed: usize) {
        let folder = self.at(name);
        std::fs::create_dir(&folder).unwrap();
        // Heights that the pictures do not follow: a report that scatters, which a scan takes out.
        let height = |i: usize| 0.03 * (7.0 * (i * i) as f64).sin();
        let pose =
            |i: usize| Rigid::<Base, Flange>::from_vectors(&Vec3::zeros(), Vec3::new(300.0, 0.3 * i as f64, height(i)));
        let poses: Vec<_> = (0..self.shots).map(pose).collect();
        sheetlight::recording::save_poses(&folder.join("poses.json"), &poses).unwrap();
        for i in 0..self.shots {
            save_png(&stripe(115.0 + (i + seed) as f64 * 0.01, i + seed), &folder.join(format!("{i}.png"))).unwrap();
        }
        let frames: Vec<_> =
            (0..self.shots).map(|i| serde_json::json!({"laser": format!("{i}.png"), "pose": i})).collect();
        let meta = serde_json::json!({
            "format": 1, "set": "bench", "units": "mm", "beam": "line", "pose_file": "poses", "frames": frames,
            "image": {"width": 320, "height": 240, "bits": 8, "channels": 1, "response": "linear",
                      "pixel_centre": "integer coordinates"}});
        std::fs::write(folder.join("meta.json"), meta.to_string()).unwrap();
    }
    /// Arguments of a scan of `recording` into `out`.
    pub fn scan(&self, recording: &str, out: &str, more: &[&str]) -> Vec<String> {
        let mut args = vec!["scan".to_owned(), self.text(recording), "--station".into(), self.text("station")];
        args.extend(["--out".to_owned(), self.text(out)]);
        let overlays: &[&str] = if more.contains(&"--overlays") { &[] } else { &["--overlays", "1"] };
        args.extend(["--on", "cpu", "--quiet"].iter().chain(overlays).chain(more).map(|s| (*s).to_owned()));
        args
    }
    /// Replaces a text that must be there.
    pub fn edit(&self, file: &str, from: &str, to: &str) {
        let text = std::fs::read_to_string(self.at(file)).unwrap();
        assert!(text.contains(from), "{file} has no {from}:\n{text}");
        std::fs::write(self.at(file), text.replacen(from, to, 1)).unwrap();
    }
}

pub fn run(args: &[String]) -> String {
    sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Runs, expects exit code 1 or 2 with a next step, and gives what was said.
pub fn refused(args: &[String]) -> String {
    let (code, said) = super::common::sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(
        matches!(code, 1 | 2) && said.contains("next step") && !said.contains("panicked"),
        "{args:?}: {code}\n{said}"
    );
    said
}

/// Every file under a folder with its bytes; locks are no content.
pub fn snapshot(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut todo = vec![folder.to_owned()];
    while let Some(next) = todo.pop() {
        for path in std::fs::read_dir(&next).into_iter().flatten().map(|e| e.unwrap().path()) {
            if path.is_dir() {
                todo.push(path);
            } else if path.extension().is_none_or(|e| e != "lock") {
                all.insert(path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    all
}
