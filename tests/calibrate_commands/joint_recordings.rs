//! In: recordings with pictures, simulated ones and the rendered reference. Out: whether `calibrate joint` comes to
//! the true rig from them, in any order, beside separate calibrations.
//! Frame and unit: mm, degrees.

use crate::common::{reference, rigs, sheetlight, sheetlight_fails};
use serde_json::Value;
use sheetlight::calibrate::hand_eye::closed::Near;
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::calibrate::joint::unknowns::State;
use sheetlight::calibrate::joint::volume::{apart, places};
use sheetlight::calibrate::limits::Asked;
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::geometry::{Camera, Flange, Plane, Ray, Rigid, Vec3};
use sheetlight::recording::Recording;
use sheetlight::rig::{Rig, Volume};
use sheetlight::scan::{Extraction, Where};
use sheetlight::simulate::{RigSpec, Set, SimulateOptions, simulate};
use sheetlight::station::{JointResult, JointRun, calibrate_joint};
use std::path::{Path, PathBuf};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn joint(recordings: &[PathBuf], rig: &Rig, working: [f64; 2]) -> JointResult {
    let open: Vec<Recording> = recordings.iter().map(|r| Recording::open(r).unwrap()).collect();
    let asked = Asked { working: Some(Volume::new(working[0], working[1], "stated")), tolerance_mm: None };
    let run = JointRun::new(Mount::EyeInHand, asked, &Extraction::default(), Where::Cpu);
    let run = JointRun { poses: Some("poses_noisy".into()), ..run };
    calibrate_joint(&open, rig, &run, &|_, _| {}).unwrap_or_else(|e| panic!("{e}"))
}

fn truth(camera: Intrinsics, x: Rigid<Flange, Camera>, plane: Plane<Camera>) -> State {
    State {
        camera,
        near_from_camera: Rigid::<Near, Camera>::new(x.rotation, x.translation),
        far_from_board: vec![],
        plane,
        beam: Ray::new(Vec3::zeros(), Vec3::z()).unwrap(),
        boards: vec![],
    }
}

/// Errors of scanned points, mm rms: joint, separate, expected.
fn compared(result: &JointResult, truth: &State, working: [f64; 2]) -> [f64; 3] {
    let lit = places(truth, working);
    let off = [&result.fit.state, &result.separate].map(|s| apart(s, truth, &lit));
    println!(
        "points off {:.4} mm, after separate calibrations {:.4}; expected {:.4}\n  {}",
        off[0],
        off[1],
        result.expected_mm(),
        result.quality.reasons.join("\n  ")
    );
    [off[0], off[1], result.expected_mm()]
}

#[test]
fn any_recordings_in_any_order_give_the_rig() {
    let dir = tempfile::tempdir().unwrap();
    let options = SimulateOptions {
        sets: vec![Set::Handeye, Set::Laserplane, Set::PointerCal],
        seed: 3,
        width: 320,
        height: 240,
        pose_noise_mm: 0.02,
        pose_noise_deg: 0.004,
        ..SimulateOptions::of(RigSpec::paper())
    };
    let made = simulate(dir.path(), &options, &|_, _| {}).unwrap();
    let folders: Vec<PathBuf> = made.recordings.iter().map(|r| r.1.clone()).collect();
    let station = options.station();
    let working = [station.rig.working.near_mm, station.rig.working.far_mm];
    let result = joint(&folders, &Rig::default(), working);
    let truth = truth(station.camera, station.flange_from_camera, station.laser.plane());
    let [off, separate, expected] = compared(&result, &truth, working);
    assert!(off <= 2.0 * expected && expected < 0.2, "{off} {expected}");
    // One draw of the robot's noise: either may be the luckier one.
    assert!(off <= 1.5 * separate, "{off} {separate}");
    // The program, from the other end, comes to the same records.
    let cell = dir.path().join("cell");
    sheetlight(&["station", "new", "--station", text(&cell), "--robot", "denso"]);
    let mut args = vec!["calibrate", "joint"];
    args.extend(folders.iter().rev().map(|f| text(f)));
    args.extend(["--poses", "poses_noisy", "--station", text(&cell), "--on", "cpu", "--keep-badly-determined"]);
    sheetlight(&args);
    let rig = Rig::load(&cell).unwrap();
    rig.belong_together().unwrap();
    let (a, b) = (rig.need_hand_eye().unwrap(), result.rig.need_hand_eye().unwrap());
    let (turn, shift) = a.value.difference(&b.value);
    assert!(turn < 2e-6 && shift < 1e-3, "{turn} {shift}");
    assert!(rig.need_pointer().is_ok() && rig.need_laser_plane().is_ok());
    let together: Value =
        serde_json::from_str(&std::fs::read_to_string(cell.join("calibration/joint.json")).unwrap()).unwrap();
    assert_eq!(together["of"]["hand_eye"], a.content());
    assert_eq!(together["parameters"].as_array().unwrap().len(), together["matrix"].as_array().unwrap().len());
    // Recordings of another rig beside it.
    let other = dir.path().join("other");
    std::fs::create_dir(&other).unwrap();
    let meta = std::fs::read_to_string(folders[0].join("meta.json")).unwrap();
    std::fs::write(other.join("meta.json"), meta.replacen("320", "400", 1)).unwrap();
    let (code, said) =
        sheetlight_fails(&["calibrate", "joint", text(&folders[0]), text(&other), "--station", text(&cell)]);
    assert!(code == 1 && said.contains("not of one rig"), "{code} {said}");
}

#[test]
fn the_rendered_station_is_found_as_well_as_its_robot_lets_it_be() {
    let Some(reference) = reference("joint calibration of the rendered station") else { return };
    for (inputs, truths) in rigs(&reference) {
        let file = std::fs::read_to_string(truths.join("handeye/truth.json")).unwrap();
        let t: Value = serde_json::from_str(&file).unwrap();
        let n = |path: &str| t.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}"));
        let k = |i: usize| n(&format!("/intrinsics/distortion_k1_k2_p1_p2_k3/{i}"));
        let camera = Intrinsics {
            fx: n("/intrinsics/fx"),
            fy: n("/intrinsics/fy"),
            cx: n("/intrinsics/cx"),
            cy: n("/intrinsics/cy"),
            skew: 0.0,
            distortion: Distortion::from_opencv(&[k(0), k(1), k(2), k(3), k(4)]).unwrap(),
            width: 640,
            height: 480,
        };
        let x: Rigid<Flange, Camera> = serde_json::from_value(t["flange_T_camera"].clone()).unwrap();
        let normal: Vec3 = serde_json::from_value(t["laser_plane_camera"]["normal"].clone()).unwrap();
        let plane = Plane::new(normal, n("/laser_plane_camera/offset_mm")).unwrap();
        let folders = ["intrinsics", "handeye", "laserplane", "pointer_cal"].map(|s| inputs.join(s));
        let working = [120.0, 200.0];
        let result = joint(&folders, &Rig::default(), working);
        let [off, separate, expected] = compared(&result, &truth(camera, x, plane), working);
        assert!(off <= 1.2 * separate && off <= 2.0 * expected, "{off} {separate} {expected}");
        // What the renderer gave the robot.
        let [mm, deg] = [n("/pose_noise/sigma_mm"), n("/pose_noise/sigma_deg")];
        let found = &result.fit.noise;
        assert!((found.robot_mm / mm - 1.0).abs() < 0.4, "{} mm for {mm}", found.robot_mm);
        assert!((found.robot_rad.to_degrees() / deg - 1.0).abs() < 0.4, "{found:?} for {deg} degrees");
    }
}
