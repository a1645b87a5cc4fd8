//! In: recordings written by `sheetlight simulate`. Out: every calibration command run as a command, from the
//! board to the insertion, each result against the station's truth.
//! Frame and unit: mm, degrees.

use crate::common::{figure, sheetlight, sheetlight_fails};
use nalgebra::Matrix4;
use serde_json::Value;
use sheetlight::raster::{Channel, load};
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::station::{RangeRun, measure_range};
use std::path::{Path, PathBuf};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A simulated station with recordings of `sets`, and a fresh station folder beside it.
struct Simulated {
    _dir: tempfile::TempDir,
    at: PathBuf,
    station: String,
}

impl Simulated {
    fn new(sets: &str, more: &[&str]) -> Simulated {
        let dir = tempfile::tempdir().unwrap();
        let at = dir.path().to_owned();
        let mut args = vec!["simulate", "--out", text(&at), "--set", sets];
        args.extend(more);
        sheetlight(&args);
        let station = text(&at.join("mine")).to_owned();
        sheetlight(&["station", "new", "--station", &station, "--robot", "denso"]);
        Simulated { _dir: dir, at, station }
    }
    fn run(&self, command: &[&str], recording: &str, more: &[&str]) -> Value {
        let recording = self.at.join(recording);
        let mut args = command.to_vec();
        args.extend([text(&recording), "--station", &self.station, "--json"]);
        args.extend(more);
        serde_json::from_str(&sheetlight(&args)).unwrap()
    }
    fn calibrate(&self, what: &str, recording: &str, more: &[&str]) -> Value {
        self.run(&["calibrate", what], recording, more)
    }
    /// The true camera and its place on the flange, for tests of what comes after them.
    fn copy_truth(&self, kinds: &[&str]) {
        let folder = Path::new(&self.station).join("calibration");
        std::fs::create_dir_all(&folder).unwrap();
        for kind in kinds {
            let name = format!("{kind}.json");
            std::fs::copy(self.at.join("station/calibration").join(&name), folder.join(name)).unwrap();
        }
    }
    fn truth(&self, kind: &str) -> Value {
        json(&self.at.join("station/calibration").join(format!("{kind}.json")))
    }
}

fn pose(v: &Value) -> Matrix4<f64> {
    let rows: Vec<f64> = serde_json::from_value(v.clone()).unwrap();
    Matrix4::from_row_slice(&rows)
}

/// The same recording as a colour camera takes it with the lamps on: room light of another exposure in the laser's
/// pictures, the laser in the red alone.
fn with_lamps_on(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    let mut meta = json(&from.join("meta.json"));
    meta["image"]["channels"] = 3.into();
    let load = |name: &Value| load(&from.join(name.as_str().unwrap()), Channel::Luma, 8).unwrap();
    for (i, frame) in meta["frames"].as_array_mut().unwrap().iter_mut().enumerate() {
        let (ambient, laser) = (load(&frame["ambient"]), load(&frame["laser"]));
        let header = format!("P6\n{} {}\n255\n", ambient.width, ambient.height).into_bytes();
        let (mut room, mut lit) = (header.clone(), header);
        for (&a, &l) in ambient.to_u8().iter().zip(&laser.to_u8()) {
            let dim = (0.5 * f32::from(a)).round() as u8;
            room.extend([a, a, a]);
            lit.extend([dim.saturating_add(l), dim, dim]);
        }
        for (kind, bytes) in [("ambient", room), ("laser", lit)] {
            let name = format!("{kind}{i}.ppm");
            std::fs::write(to.join(&name), bytes).unwrap();
            frame[kind] = name.into();
        }
    }
    std::fs::write(to.join("meta.json"), meta.to_string()).unwrap();
}

/// The pointer's pictures as they are where an edge along the beam's image hides one half of each spot.
fn with_spots_cut(from: &Path, to: &Path, spots: &[[f64; 2]]) {
    std::fs::create_dir_all(to).unwrap();
    let mut meta = json(&from.join("meta.json"));
    let (a, b) = (spots[0], spots[spots.len() - 1]);
    let beam = nalgebra::Vector2::new(b[0] - a[0], b[1] - a[1]).normalize();
    let frames = meta["frames"].as_array_mut().unwrap();
    frames.truncate(spots.len());
    for (i, (frame, spot)) in frames.iter_mut().zip(spots).enumerate() {
        let picture = load(&from.join(frame["laser"].as_str().unwrap()), Channel::Luma, 8).unwrap();
        let mut bytes = picture.to_u8();
        let dark = *bytes.clone().select_nth_unstable(picture.width as usize * picture.height as usize / 2).1;
        for (k, byte) in bytes.iter_mut().enumerate() {
            let [x, y] = [k % picture.width as usize, k / picture.width as usize].map(|p| p as f64);
            let (dx, dy) = (x - spot[0], y - spot[1]);
            if beam.x * dy - beam.y * dx > 0.0 && dx.hypot(dy) < 20.0 {
                *byte = dark;
            }
        }
        let name = format!("cut{i}.pgm");
        let header = format!("P5\n{} {}\n255\n", picture.width, picture.height).into_bytes();
        std::fs::write(to.join(&name), [header, bytes].concat()).unwrap();
        frame["laser"] = name.into();
    }
    std::fs::write(to.join("meta.json"), meta.to_string()).unwrap();
}

/// Distance in mm and angle in degrees between two poses.
fn apart(a: &Value, b: &Value) -> (f64, f64) {
    let (a, b) = (pose(a), pose(b));
    let d = a.fixed_view::<3, 1>(0, 3) - b.fixed_view::<3, 1>(0, 3);
    let r = a.fixed_view::<3, 3>(0, 0).transpose() * b.fixed_view::<3, 3>(0, 0);
    // Through the sine: near zero the cosine has lost its digits.
    let s = 0.5
        * ((r[(2, 1)] - r[(1, 2)]).powi(2) + (r[(0, 2)] - r[(2, 0)]).powi(2) + (r[(1, 0)] - r[(0, 1)]).powi(2)).sqrt();
    (d.norm(), s.atan2(0.5 * (r.trace() - 1.0)).to_degrees())
}

#[test]
fn a_station_is_calibrated_ranged_and_verified_by_its_commands() {
    let s = Simulated::new(
        "intrinsics,handeye,laserplane,pointer_cal,pointer,surface",
        &["--seed", "5", "--pose-noise-mm", "0.02", "--pose-noise-deg", "0.005"],
    );
    // The board of the hand-eye recording is seen by the same camera: both together know it better than one.
    let both = s.calibrate("camera", "intrinsics", &[text(&s.at.join("handeye"))]);
    // A board that is as drawn, its shape asked for: the camera is known less well, and as well as it says.
    let mut meta = json(&s.at.join("intrinsics/meta.json"));
    meta["frames"].as_array_mut().unwrap().truncate(9);
    std::fs::create_dir(s.at.join("some")).unwrap();
    for frame in meta["frames"].as_array().unwrap() {
        let name = frame["ambient"].as_str().unwrap();
        std::fs::copy(s.at.join("intrinsics").join(name), s.at.join("some").join(name)).unwrap();
    }
    std::fs::write(s.at.join("some/meta.json"), meta.to_string()).unwrap();
    let shaped = s.calibrate("camera", "some", &["--board", "shaped"]);
    let said = &shaped["quality"];
    let words = said["reasons"].to_string();
    assert!(
        words.contains("estimated with the camera, as was asked") && !words.contains("differs from its drawing"),
        "{words}"
    );
    let said = &said["figures"];
    assert!(said["board_off_out_of_its_plane_rms_mm"].as_f64().unwrap() < 0.05, "{said}");
    let (code, talk) = sheetlight_fails(&[
        "calibrate",
        "camera",
        text(&s.at.join("intrinsics")),
        "--station",
        &s.station,
        "--board",
        "bent",
    ]);
    assert!(code == 2 && ["bent", "evidence", "drawn", "shaped"].iter().all(|w| talk.contains(w)), "{code} {talk}");
    let camera = s.calibrate("camera", "intrinsics", &[]);
    assert!(camera["quality"]["figures"].get("board_off_out_of_its_plane_rms_mm").is_none());
    let k = &s.truth("camera")["value"];
    let sigma = |camera: &Value, name: &str| {
        let all: Vec<String> = serde_json::from_value(camera["covariance"]["parameters"].clone()).unwrap();
        let i = all.iter().position(|p| *p == format!("{name}_px")).unwrap();
        camera["covariance"]["matrix"][i][i].as_f64().unwrap().sqrt()
    };
    for name in ["fx", "fy", "cx", "cy"] {
        for found in [&camera, &both, &shaped] {
            let (off, sigma) = (figure(found, &["value", name]) - figure(k, &[name]), sigma(found, name));
            assert!(off.abs() < 4.0 * sigma, "{name} is {off:+.4} px off, sigma {sigma:.4}");
        }
        let (one, two) = (sigma(&camera, name), sigma(&both, name));
        assert!(two < 0.95 * one, "{name}: sigma {two:.4} px from two recordings, {one:.4} from one");
    }
    let found = s.calibrate("hand-eye", "handeye", &["--poses", "poses_noisy"]);
    let (mm, deg) = apart(&found["value"], &s.truth("hand_eye")["value"]);
    let sigma = |name: &str| figure(&found, &["quality", "figures", name]);
    assert!(mm < 3.0 * sigma("translation_sigma_mm"), "hand-eye: {mm} mm of {}", sigma("translation_sigma_mm"));
    assert!(deg < 3.0 * sigma("rotation_sigma_deg"), "hand-eye: {deg} of {}", sigma("rotation_sigma_deg"));

    let plane = s.calibrate("laser-plane", "laserplane", &["--on", "cpu"]);
    let normal =
        |v: &Value| nalgebra::Vector3::from_iterator((0..3).map(|i| v["value"]["normal"][i].as_f64().unwrap()));
    let truth = s.truth("laser_plane");
    let angle = normal(&plane).cross(&normal(&truth)).norm().atan2(normal(&plane).dot(&normal(&truth))).to_degrees();
    assert!(angle < 0.02, "laser plane: {angle} degrees");
    for recording in ["laserplane", "pointer_cal"] {
        with_lamps_on(&s.at.join(recording), &s.at.join(format!("{recording}_lamps")));
    }
    let lamps = s.calibrate("laser-plane", "laserplane_lamps", &["--on", "cpu", "--channel", "red"]);
    let angle = normal(&lamps).cross(&normal(&truth)).norm().asin().to_degrees();
    assert!(angle < 0.02, "laser plane with the lamps on: {angle} degrees");
    let lamps = s.calibrate("pointer", "pointer_cal_lamps", &["--channel", "red"]);
    let aims =
        |v: &Value| nalgebra::Vector3::from_iterator((0..3).map(|i| v["value"]["direction"][i].as_f64().unwrap()));
    let (found, wanted) = (aims(&lamps), aims(&s.truth("pointer")));
    let angle = found.cross(&wanted).norm().asin().to_degrees();
    assert!(angle < 0.05, "pointer with the lamps on: {angle} degrees");

    s.calibrate("pointer", "pointer_cal", &[]);
    let ranges = s.run(&["range"], "pointer", &[]);
    let wanted: Vec<f64> =
        serde_json::from_value(json(&s.at.join("pointer/truth.json"))["distances_mm"].clone()).unwrap();
    let distances = ranges["distances"].as_array().unwrap();
    assert_eq!(distances.len(), wanted.len(), "missing: {}", ranges["missing"]);
    for (d, z) in distances.iter().zip(&wanted) {
        let e = figure(d, &["along_axis_mm"]) - z;
        let sigma = figure(d, &["along_axis_sigma_mm"]);
        assert!(e.abs() < 4.0 * sigma.max(0.005), "at {z} mm: {e:+.4} mm, sigma {sigma:.4}");
    }
    // Half a spot is not where the beam is, and is refused; asked roughly it tells how far the surface is. Near by,
    // where spots are wide.
    let spots: Vec<[f64; 2]> =
        distances.iter().map(|d| serde_json::from_value(d["spot_px"].clone()).unwrap()).collect();
    with_spots_cut(&s.at.join("pointer"), &s.at.join("cut"), &spots[..4]);
    let (recording, rig) = (Recording::open(&s.at.join("cut")).unwrap(), Rig::load(Path::new(&s.station)).unwrap());
    let refused = measure_range(&recording, &rig, &RangeRun::default()).unwrap_err().to_string();
    assert!(refused.contains("beside the beam's image"), "{refused}");
    let roughly = measure_range(&recording, &rig, &RangeRun { coarse: true, ..RangeRun::default() }).unwrap();
    assert!(roughly.missing.is_empty(), "{:?}", roughly.missing);
    for (d, z) in roughly.distances.iter().zip(&wanted) {
        assert!((d.along_axis_mm / z - 1.0).abs() < 0.01, "{:.2} mm at {z}", d.along_axis_mm);
    }
    // Without robot poses there is no surface; with them the scene's normal is the board's.
    let (code, said) = sheetlight_fails(&["range", text(&s.at.join("pointer")), "--station", &s.station, "--surface"]);
    assert!(code != 0 && said.contains("next step"), "{said}");
    let surface = s.run(&["range"], "surface", &["--surface"]);
    let base_from_scene = pose(&json(&s.at.join("surface/truth.json"))["base_T_scene"]);
    let up = base_from_scene.fixed_view::<3, 1>(0, 2).into_owned();
    let n = nalgebra::Vector3::from_iterator((0..3).map(|i| surface["surface"]["normal"][i].as_f64().unwrap()));
    let off = n.cross(&up).norm().asin().to_degrees();
    assert!(off < 4.0 * surface["surface"]["tilt_sigma_deg"][0].as_f64().unwrap().max(0.02), "normal: {off} degrees");

    let touches = s.at.join("touches.csv");
    std::fs::write(&touches, "x,y,z,tx,ty,tz\n0,0,0,0.1,0,0\n10,0,0,10.1,0,0.02\n0,10,5,0.1,10,4.98\n").unwrap();
    let args = ["verify", "--station", &s.station, "--touch", text(&touches), "--json"];
    let report: Value = serde_json::from_str(&sheetlight(&args)).unwrap();
    assert!((figure(&report, &["touch", "rms_mm"]) - 0.1013).abs() < 1e-3, "{}", report["touch"]);
    for (name, c) in report["calibrations"].as_object().unwrap() {
        assert!(!c["verification"].as_object().unwrap().is_empty(), "{name} says nothing of data it did not see");
        let mixed = c["fit"].as_object().unwrap().keys().any(|k| c["verification"].get(k).is_some());
        assert!(!mixed, "{name} mixes fit and verification");
    }
    std::fs::write(&touches, "0,0,0,0.1,0\n").unwrap();
    let (code, said) = sheetlight_fails(&args);
    assert!(code == 1 && said.contains("line 1") && said.contains("six numbers"), "{said}");
}

#[test]
fn a_flat_surface_is_verified_from_several_scans() {
    let dir = tempfile::tempdir().unwrap();
    let scene = dir.path().join("plate.toml");
    std::fs::write(
        &scene,
        "name = 'plate'\nregion_mm = [-25, -6, 25, 6]\n[[solid]]\nshape = { block = { size_mm = [90, 60, 5] } \
         }\nat_mm = [0, 0, 0]\n",
    )
    .unwrap();
    let s = Simulated::new("scan", &["--seed", "7", "--shots", "12", "--scene", text(&scene)]);
    let (out, station, recording) = (dir.path().join("result"), s.at.join("station"), s.at.join("scan"));
    let (out, station) = (text(&out), text(&station));
    sheetlight(&["scan", text(&recording), "--station", station, "--out", out, "--on", "cpu"]);
    // The same scan twice: nothing but itself to differ from.
    let same = sheetlight(&["verify", "--station", station, "--flat", out, "--flat", out, "--json"]);
    let same: Value = serde_json::from_str(&same).unwrap();
    assert!(figure(&same, &["flat", "height_range_mm"]) < 1e-9, "{}", same["flat"]);
    let views = ["verify", "--station", station, "--flat", out, "--shots-per-view", "4", "--json"];
    let views: Value = serde_json::from_str(&sheetlight(&views)).unwrap();
    assert_eq!(views["flat"]["views"].as_array().unwrap().len(), 3);
    let tilt = figure(&views, &["flat", "largest_tilt_deg"]);
    assert!(tilt < 0.5 && figure(&views, &["flat", "own_rms_mm"]) < 0.05, "{}", views["flat"]);
    let none = dir.path().join("none");
    let (code, said) = sheetlight_fails(&["verify", "--station", station, "--flat", text(&none)]);
    assert!(code == 1 && said.contains("none") && said.contains("next step"), "{said}");
}

#[test]
fn charuco_and_symmetric_boards_are_simulated_and_calibrated() {
    let dir = tempfile::tempdir().unwrap();
    let board = |kind: &str, size: &str, square: &str| {
        let out = dir.path().join(format!("{kind}-{size}"));
        sheetlight(&["board", kind, size, "--square-mm", square, "--out", text(&out)]);
        out.with_extension("json")
    };
    let charuco = board("charuco", "9x6", "16");
    let s = Simulated::new("intrinsics,handeye", &["--seed", "6", "--board", text(&charuco)]);
    let camera = s.calibrate("camera", "intrinsics", &[]);
    let corners = figure(&camera, &["quality", "figures", "corners"]);
    assert!(corners > 20.0 * 25.0, "{corners} corners of 20 pictures, 40 on the board");
    let off = figure(&camera, &["value", "fx"]) / figure(&s.truth("camera"), &["value", "fx"]) - 1.0;
    assert!(off.abs() < 1e-3, "focal length off by {off:.5}");
    let found = s.calibrate("hand-eye", "handeye", &["--poses", "poses_exact"]);
    let (mm, deg) = apart(&found["value"], &s.truth("hand_eye")["value"]);
    assert!(mm < 0.05 && deg < 0.02, "{mm} mm, {deg} degrees");

    // Even by even: each picture could be read the other way round.
    let even = board("chessboard", "8x6", "15");
    let s = Simulated::new("handeye", &["--seed", "6", "--board", text(&even)]);
    s.copy_truth(&["camera"]);
    let found = s.calibrate("hand-eye", "handeye", &["--poses", "poses_noisy"]);
    let (mm, _) = apart(&found["value"], &s.truth("hand_eye")["value"]);
    assert!(mm < 3.0 * figure(&found, &["quality", "figures", "translation_sigma_mm"]), "{mm} mm");
    let reasons = found["quality"]["reasons"].to_string();
    assert!(reasons.contains("looks the same after a turn") && reasons.contains("of 16 pictures"), "{reasons}");
}

#[test]
fn a_profile_sensor_is_calibrated_from_files() {
    use sheetlight::geometry::{Base, Flange, Rigid, Sensor, Vec3, exp};
    let dir = tempfile::tempdir().unwrap();
    let sensor: Rigid<Flange, Sensor> = Rigid::from_vectors(&Vec3::new(0.3, -1.2, 0.4), Vec3::new(40.0, -25.0, 90.0));
    let ball = Vec3::new(500.0, -120.0, 60.0);
    let (mut profiles, mut listing) = (String::from("profile,x,z\n"), String::from("/PROG BALL\n/POS\n"));
    for i in 0..16u32 {
        let a = f64::from(i);
        let turn = exp(&Vec3::new(0.5 * (1.3 * a).sin(), 0.5 * (2.1 * a).cos(), 0.6 * (0.7 * a).sin()));
        let q = Vec3::new(10.0 * a.sin(), 11.0 * (1.7 * a).cos(), 150.0 + 10.0 * (0.9 * a).sin());
        let base_from_sensor: Rigid<Base, Sensor> = Rigid::new(turn, ball - turn * q);
        let r = (400.0 - q.y * q.y).sqrt();
        for k in 0..120 {
            let b = -1.2 + 2.4 * f64::from(k) / 119.0;
            profiles += &format!("{i},{:.4},{:.4}\n", q.x + r * b.sin(), q.z - r * b.cos());
        }
        let flange: Rigid<Base, Flange> = base_from_sensor * sensor.inverse();
        let n = sheetlight::robot::Convention::Fanuc.write(&flange);
        listing += &format!(
            "P[{}]{{\n   GP1:\n    UF : 0, UT : 0, CONFIG : 'N U T, 0, 0, 0',\n    X = {:.3} mm, Y = {:.3} mm, Z = \
             {:.3} mm,\n    W = {:.4} deg, P = {:.4} deg, R = {:.4} deg\n}};\n",
            i + 1,
            n[0],
            n[1],
            n[2],
            n[3],
            n[4],
            n[5]
        );
    }
    listing += "/END\n";
    let [points, poses] = ["profiles.csv", "BALL.LS"].map(|n| dir.path().join(n));
    std::fs::write(&points, profiles).unwrap();
    std::fs::write(&poses, listing).unwrap();
    let station = dir.path().join("station");
    sheetlight(&["station", "new", "--station", text(&station)]);
    let args = |diameter: &'static str| {
        vec![
            "calibrate",
            "profile-hand-eye",
            text(&points),
            "--poses",
            text(&poses),
            "--ball-diameter-mm",
            diameter,
            "--station",
            text(&station),
            "--json",
        ]
    };
    let found: Value = serde_json::from_str(&sheetlight(&args("40"))).unwrap();
    let truth = serde_json::to_value(sensor.to_rows().to_vec()).unwrap();
    let (mm, deg) = apart(&found["value"], &truth);
    assert!(mm < 0.02 && deg < 0.01, "{mm} mm, {deg} degrees");
    assert!(station.join("calibration/profile_hand_eye.html").exists());
    assert!((110.0..170.0).contains(&found["quality"]["figures"]["working_distance_mm"].as_f64().unwrap()));
    let (code, said) = sheetlight_fails(&args("20"));
    assert!(code == 1 && said.contains("next step"), "a wrong diameter: {said}");
    // The stored transform put to the test, on the same profiles written as plain sequences, one a line.
    let mut lines = vec![String::new(); 16];
    for row in std::fs::read_to_string(&points).unwrap().lines().skip(1) {
        let (i, xz) = row.split_once(',').unwrap();
        lines[i.parse::<usize>().unwrap()] += &format!("{} ", xz.replace(',', " "));
    }
    let plain = dir.path().join("plain.txt");
    std::fs::write(&plain, lines.join("\n")).unwrap();
    let stored = station.join("calibration/profile_hand_eye.json");
    let evaluate = |transform: &Path| -> Value {
        let more = ["--poses", text(&poses), "--ball-diameter-mm", "40", "--evaluate", text(transform), "--json"];
        serde_json::from_str(&sheetlight(&[&["calibrate", "profile-hand-eye", text(&plain)], &more[..]].concat()))
            .unwrap()
    };
    let rms = |v: &Value| v["rms_mm"].as_f64().unwrap();
    let mut moved = sensor.to_rows();
    moved[3] += 2.0;
    let theirs = dir.path().join("theirs.json");
    std::fs::write(&theirs, serde_json::json!({ "flange_T_sensor": moved.to_vec() }).to_string()).unwrap();
    let (own, other) = (evaluate(&stored), evaluate(&theirs));
    assert!(rms(&own) < 0.01 && rms(&other) > 0.3, "{own} {other}");
    assert_eq!(own["profiles"].as_array().unwrap().len(), 16);
}

#[test]
fn a_profile_sensor_is_calibrated_from_files_of_a_plate() {
    use sheetlight::geometry::{Base, Flange, Rigid, Sensor, Vec3, exp};
    let dir = tempfile::tempdir().unwrap();
    let sensor: Rigid<Flange, Sensor> = Rigid::from_vectors(&Vec3::new(0.3, -1.2, 0.4), Vec3::new(40.0, -25.0, 90.0));
    let (normal, middle) = (Vec3::new(0.1, -0.05, 1.0).normalize(), Vec3::new(500.0, -120.0, 60.0));
    // 16 profiles, each tilted by as many rad as `size` says. The sensor looks down.
    let scanned = |name: &str, size: &dyn Fn(u32) -> f64| {
        let folder = dir.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        let mut poses = String::from("# convention: denso\nframe,x,y,z,rx,ry,rz\n");
        for i in 0..16u32 {
            let (a, tilt) = (f64::from(i), size(i));
            let turn = exp(&Vec3::new(std::f64::consts::PI, 0.0, 0.0))
                * exp(&Vec3::new(tilt * (1.3 * a).sin(), tilt * (1.3 * a).cos(), 0.0));
            let place = middle + Vec3::new(20.0 * a.sin(), 30.0 * (1.7 * a).cos(), 0.0);
            let from_sensor: Rigid<Base, Sensor> =
                Rigid::new(turn, place - turn * Vec3::new(0.0, 0.0, 150.0 + 15.0 * (0.9 * a).sin()));
            let mut rows = String::from("x,z\n");
            for k in 0..120u32 {
                let x = f64::from(k) / 3.0 - 20.0;
                let from = from_sensor.point(&Vec3::new(x, 0.0, 0.0));
                let z = (middle - from).dot(&normal) / (turn * Vec3::z()).dot(&normal);
                // A table lies beside the plate.
                rows += &format!("{x:.4},{:.4}\n", if k < 10 * (i % 4) { z + 9.0 } else { z });
            }
            std::fs::write(folder.join(format!("{i}.csv")), rows).unwrap();
            let flange: Rigid<Base, Flange> = from_sensor * sensor.inverse();
            let n = sheetlight::robot::Convention::Denso.write(&flange);
            poses += &format!("{i},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5}\n", n[0], n[1], n[2], n[3], n[4], n[5]);
        }
        let path = dir.path().join(format!("{name}.csv"));
        std::fs::write(&path, poses).unwrap();
        [folder, path].map(|p| text(&p).to_owned())
    };
    let station = text(&dir.path().join("station")).to_owned();
    sheetlight(&["station", "new", "--station", &station]);
    let command = |[profiles, poses]: &[String; 2], more: &[&str]| -> Vec<String> {
        let args = [&["calibrate", "profile-hand-eye", profiles, "--poses", poses], more].concat();
        args.into_iter().map(str::to_owned).collect()
    };
    let run = |args: Vec<String>| -> Value {
        serde_json::from_str(&sheetlight(&args.iter().map(String::as_str).collect::<Vec<_>>())).unwrap()
    };
    let fails = |args: Vec<String>| sheetlight_fails(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let tilted = scanned("tilted", &|i| 0.25 * f64::from(i % 4));
    let found = run(command(&tilted, &["--plane", "--station", &station, "--json"]));
    let (mm, deg) = apart(&found["value"], &serde_json::to_value(sensor.to_rows().to_vec()).unwrap());
    assert!(mm < 0.02 && deg < 0.01, "{mm} mm, {deg} degrees");
    let figures = &found["quality"]["figures"];
    assert!((figures["plane_normal_z"].as_f64().unwrap() - normal.z).abs() < 1e-5, "{figures}");
    assert!((figures["plane_offset_mm"].as_f64().unwrap() - normal.dot(&middle)).abs() < 0.02, "{figures}");
    assert_eq!(found["quality"]["verdict"], "good", "{found}");
    assert!(Path::new(&station).join("calibration/profile_hand_eye.html").exists());
    // The stored transform put to the test, and one that is 2 mm off.
    let stored = Path::new(&station).join("calibration/profile_hand_eye.json");
    let mut moved = sensor.to_rows();
    moved[3] += 2.0;
    let theirs = dir.path().join("theirs.json");
    std::fs::write(&theirs, serde_json::json!({ "flange_T_sensor": moved.to_vec() }).to_string()).unwrap();
    let rms = |transform: &Path| {
        let judged = run(command(&tilted, &["--plane", "--evaluate", text(transform), "--json"]));
        assert_eq!(judged["profiles"].as_array().unwrap().len(), 16);
        judged["rms_mm"].as_f64().unwrap()
    };
    assert!(rms(&stored) < 0.01 && rms(&theirs) > 0.3, "{} {}", rms(&stored), rms(&theirs));
    // Not tilted: refused with what is missing, and the stored record stays.
    let before = std::fs::read(&stored).unwrap();
    let (code, said) = fails(command(&scanned("flat", &|_| 0.0), &["--plane", "--station", &station]));
    assert!(code == 1 && said.contains("at the same angle") && said.contains("next step: tilt the sensor"), "{said}");
    assert_eq!(std::fs::read(&stored).unwrap(), before);
    // One target, and a side of the ball only.
    for wrong in [&["--ball-diameter-mm", "30", "--plane"][..], &[], &["--plane", "--side", "plus"]] {
        let (code, said) = fails(command(&tilted, &[wrong, &["--station", &station]].concat()));
        assert!(code == 2, "{wrong:?}: {said}");
    }
}

/// Robot and board poses from other programs, in two notations, the robot scattering by 2 mm and 1 degree: refused as
/// badly determined, but the transform is said; with a good robot it is stored.
#[test]
fn a_hand_eye_is_calibrated_from_pose_pairs_alone() {
    use rand::{Rng, SeedableRng};
    use sheetlight::geometry::{Base, Board, Camera, Flange, Rigid, Vec3, exp};
    let dir = tempfile::tempdir().unwrap();
    let rng = &mut rand_pcg::Pcg64::seed_from_u64(5);
    let mut vector = |size: f64| Vec3::from_fn(|_, _| size * (2.0 * rng.random::<f64>() - 1.0));
    let truth: Rigid<Flange, Camera> = Rigid::from_vectors(&Vec3::new(0.2, -0.1, 1.5), Vec3::new(60.0, -15.0, 80.0));
    let base_from_board: Rigid<Base, Board> =
        Rigid::from_vectors(&Vec3::new(0.1, 3.0, 0.2), Vec3::new(500.0, 80.0, 20.0));
    let head = "frame,x,y,z,qx,qy,qz,qw";
    let mut boards = format!("# transform: camera_T_board\n# convention: ros\n{head}\n");
    let [mut good, mut noisy] = ["# convention: denso\nframe,x,y,z,rx,ry,rz\n"; 2].map(String::from);
    for i in 0..14 {
        let camera_from_board: Rigid<Camera, Board> =
            Rigid::new(exp(&vector(0.6)), Vec3::new(0.0, 0.0, 330.0) + vector(60.0));
        let pose: Rigid<Base, Flange> = base_from_board * camera_from_board.inverse() * truth.inverse();
        let row = |numbers: Vec<f64>| numbers.iter().map(|n| format!(",{n:.7}")).collect::<String>();
        let denso = |mm: f64, deg: f64, t: Vec3, r: Vec3| {
            let off: Rigid<Base, Flange> =
                Rigid::new(exp(&(r * deg.to_radians())) * pose.rotation, pose.translation + t * mm);
            format!("{i}{}\n", row(sheetlight::robot::Convention::Denso.write(&off)))
        };
        // Even noise of this width has a sigma of 1.
        let (t, r) = (vector(3f64.sqrt()), vector(3f64.sqrt()));
        good += &denso(0.02, 0.005, t, r);
        noisy += &denso(2.0, 1.0, t, r);
        // The other program did not find the board in one picture.
        if i != 4 {
            boards += &format!("{i}{}\n", row(sheetlight::robot::Convention::Ros.write(&camera_from_board)));
        }
    }
    let write = |name: &str, what: &str| {
        std::fs::write(dir.path().join(name), what).unwrap();
        text(&dir.path().join(name)).to_owned()
    };
    let files = [write("boards.csv", &boards), write("good.csv", &good), write("noisy.csv", &noisy)];
    let station = text(&dir.path().join("station")).to_owned();
    sheetlight(&["station", "new", "--station", &station]);
    let args = |robot: usize| {
        ["calibrate", "hand-eye", "--board-poses", &files[0], "--poses", &files[robot], "--station", &station, "--json"]
            .map(String::from)
    };
    let run = |a: [String; 9]| sheetlight(&a.each_ref().map(String::as_str));
    let found: Value = serde_json::from_str(&run(args(1))).unwrap();
    let (mm, deg) = apart(&found["value"], &serde_json::to_value(truth.to_rows().to_vec()).unwrap());
    assert!(mm < 0.2 && deg < 0.05, "{mm} mm, {deg} degrees");
    assert_eq!(found["quality"]["figures"]["pairs_used"], 13.0);
    assert!(found["quality"]["figures"].get("rms_px").is_none(), "nothing is known in px");
    assert!((250.0..420.0).contains(&found["quality"]["figures"]["working_distance_mm"].as_f64().unwrap()));
    let (code, said) = sheetlight_fails(&args(2).each_ref().map(String::as_str));
    assert!(code == 1 && said.contains("badly determined") && said.contains("camera on the flange"), "{said}");
    assert!(said.contains("translation_sigma_mm"), "{said}");
    let unstated = write("boards.csv", boards.strip_prefix("# transform: camera_T_board\n").unwrap());
    let (_, said) = sheetlight_fails(&args(1).each_ref().map(String::as_str));
    assert!(said.contains("camera_T_board") && said.contains(&unstated), "{said}");
}
