//! In: simulated parts on a linear axis and a turntable, and under a robot, seen by a running camera; a board that rides past it. Out: whether
//! scans of it are as accurate as the robot's, with the true axis and with one calibrated from the pictures of the board.
//! Frame and unit: mm; counts.

use super::{json, text};
use crate::common::sheetlight;
use serde_json::Value;
use sheetlight::geometry::Vec3;
use std::path::Path;

/// A block with wedges that rise and fall each way.
const SCENE: &str = "name = 'wedges'\nregion_mm = [-15, -9, 15, 9]\n\
    [[solid]]\nshape = { block = { size_mm = [60, 60, 5] } }\nat_mm = [0, 0, 0]\n\
    [[solid]]\nshape = { wedge = { size_mm = [12, 12, 9], drop_mm = 7 } }\nat_mm = [-6, 0, 7]\nturn_deg = 70\n\
    [[solid]]\nshape = { wedge = { size_mm = [12, 12, 9], drop_mm = 7 } }\nat_mm = [7, 0, 7]\nturn_deg = 250\n";

struct Live<'a> {
    at: &'a Path,
    motion: &'a str,
    scene: String,
}

impl Live<'_> {
    fn path(&self, name: &str) -> String {
        text(&self.at.join(self.motion).join(name))
    }

    fn axis(&self) -> String {
        if self.motion == "robot" { String::new() } else { format!("&axis={}", self.motion) }
    }

    /// The station, the truth of the scene and, where it has more than two shots, a recording to compare with.
    fn simulate(&self, shots: &str) {
        let out = text(&self.at.join(self.motion));
        let args =
            ["simulate", "--seed", "4", "--width", "320", "--scene", &self.scene, "--shots", shots, "--set", "scan"];
        let more = ["--motion", self.motion, "--out", &out, "--quiet"];
        sheetlight(&[&args[..], &more].concat());
        if self.motion != "robot" {
            std::fs::remove_file(self.path("station/calibration/hand_eye.json")).unwrap();
        }
    }

    /// Rms of the points about the truth, mm, and their number.
    fn scan(&self, out: &str, speed: &str, shots: &str) -> (f64, u64) {
        let camera = format!("sim:4?rate=12&speed={speed}&size=320x240&scene={}{}", self.scene, self.axis());
        let (station, truth, to) = (self.path("station"), self.path("scan/truth.json"), self.path(out));
        sheetlight(&[
            "scan",
            "--camera",
            &camera,
            "--pair",
            "clock",
            "--pose-stream",
            "sim:4",
            "--station",
            &station,
            "--truth",
            &truth,
            "--shots",
            shots,
            "--out",
            &to,
            "--on",
            "cpu",
            "--overlays",
            "0",
            "--quiet",
        ]);
        let report = json(&Path::new(&to).join("scan.json"));
        let account: sheetlight::capture::Account = serde_json::from_value(report["camera"].clone()).unwrap();
        assert_eq!(account.unexplained(), 0, "{account}");
        let rms = json(&Path::new(&to).join("errors.json"))["cloud"]["rms_without_outliers_mm"].as_f64().unwrap();
        println!("{} live, {out}: rms {rms:.4} mm, {} points, {account}", self.motion, report["points"]);
        (rms, report["points"].as_u64().unwrap())
    }

    /// The same of the simulated recording.
    fn recorded(&self) -> f64 {
        let [from, station, truth, to] = ["scan", "station", "scan/truth.json", "file"].map(|name| self.path(name));
        let args = ["scan", &from, "--station", &station, "--truth", &truth, "--out", &to, "--on", "cpu"];
        sheetlight(&[&args[..], &["--overlays", "0", "--quiet"]].concat());
        let rms = json(&Path::new(&to).join("errors.json"))["cloud"]["rms_without_outliers_mm"].as_f64().unwrap();
        println!("{}, its recording: rms {rms:.4} mm", self.motion);
        rms
    }

    /// A board that rides past is recorded, and the axis calibrated from it.
    fn calibrate(&self, speed: &str) -> Value {
        let camera = format!("sim:4?rate=5&speed={speed}&size=320x240&shows=board{}", self.axis());
        let (board, to) = (text(&self.at.join("board")), self.path("board rides"));
        sheetlight(&["board", "chessboard", "9x6", "--square-mm", "6", "--border-mm", "5", "--out", &board, "--quiet"]);
        let board = format!("{board}.json");
        sheetlight(&[
            "record",
            "--camera",
            &camera,
            "--pair",
            "clock",
            "--pose-stream",
            "sim:4",
            "--shows",
            "room",
            "--board",
            &board,
            "--shots",
            "16",
            "--out",
            &to,
            "--quiet",
        ]);
        sheetlight(&["calibrate", "axis", &to, "--station", &self.path("station"), "--quiet"]);
        self.axis_file()
    }

    fn axis_file(&self) -> Value {
        let name = if self.motion == "linear" { "linear_axis" } else { "turntable" };
        json(&self.at.join(self.motion).join("station/calibration").join(format!("{name}.json")))
    }
}

fn direction(axis: &Value) -> Vec3 {
    let m = axis["value"]["camera_T_axis"].as_array().unwrap();
    // A belt goes along its frame's x, a table turns about z.
    let column = if axis["kind"] == "turntable" { 2 } else { 0 };
    let at = |row: usize| m[4 * row + column].as_f64().unwrap();
    Vec3::new(at(0), at(1), at(2))
}

/// Short: the linear axis. `SHEETLIGHT_LONG`: the turntable too.
#[test]
#[ignore = "red once in four beside other work: 0.0349 mm where 0.0333 is asked, by the clocks of a loaded machine"]
fn an_axis_before_a_running_camera_scans_as_accurately_as_a_robot() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("wedges.toml"), SCENE).unwrap();
    let live = |motion| Live { at: dir.path(), motion, scene: text(&dir.path().join("wedges.toml")) };
    let robot = live("robot");
    robot.simulate("2");
    let (want, _) = robot.scan("out", "20", "26");
    let axes = [("linear", "20", "4", "26"), ("turntable", "100", "20", "44")];
    let long = std::env::var("SHEETLIGHT_LONG").is_ok();
    for (motion, speed, past, shots) in &axes[..if long { 2 } else { 1 }] {
        let axis = live(motion);
        // A turntable shows steep sides from all around, which the robot passes: its own recording is its measure.
        let table = *motion == "turntable";
        axis.simulate(if table { shots } else { "2" });
        let want = if table { axis.recorded() } else { want };
        let truth = axis.axis_file();
        let (exact, points) = axis.scan("true", speed, shots);
        assert!(points > 1000 && exact < 1.15 * want, "{motion}, true axis: {exact:.4} mm, measured by {want:.4}");
        let found = axis.calibrate(past);
        let (of, is) = (direction(&truth), direction(&found));
        let turned = of.angle(&is).to_degrees();
        let [pitch, true_pitch] = [&found, &truth].map(|c| c["value"]["pitch"].as_f64().unwrap());
        println!(
            "{motion}, calibrated from pictures of a board that rode past: {}, direction {turned:.4} degrees off, pitch by {:.2e} of it",
            found["quality"]["verdict"],
            pitch / true_pitch - 1.0
        );
        assert!(turned < 0.1 && (pitch / true_pitch - 1.0).abs() < 1e-3, "{found}");
        assert!(["good", "usable"].contains(&found["quality"]["verdict"].as_str().unwrap()), "{}", found["quality"]);
        assert!(found["covariance"]["matrix"].as_array().is_some_and(|v| !v.is_empty()), "{}", found["covariance"]);
        let (own, _) = axis.scan("own", speed, shots);
        assert!(own < 1.15 * want, "{motion}, calibrated: {own:.4} mm, measured by {want:.4}");
    }
}
