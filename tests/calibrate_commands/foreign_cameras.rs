//! Cameras in the files of other programs: values and conventions are those that the programs state. The OpenCV files
//! were written by OpenCV 5; the others are laid out as their programs write them.

use crate::common::{program, sheetlight, sheetlight_fails};
use sheetlight::camera::{Distortion, Intrinsics};
use sheetlight::geometry::Vec3;
use sheetlight::rig::Rig;
use sheetlight::station::Values;
use std::path::{Path, PathBuf};

fn file(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("tests/data/cameras").join(name)
}

fn read(name: &str) -> (Intrinsics, String) {
    let values = Values::load(&file(name)).unwrap();
    (values.intrinsics.unwrap_or_else(|| panic!("{name}: no camera")), values.read_as.unwrap_or_default())
}

/// The camera that all files but HALCON's hold.
fn truth(terms: &[f64]) -> Intrinsics {
    let distortion = Distortion::from_opencv(terms).unwrap();
    let (fx, fy) = (612.345_678_901_234_5, 611.1);
    Intrinsics { fx, fy, cx: 321.25, cy: 239.5, skew: 0.0, distortion, width: 640, height: 480 }
}

#[test]
fn values_and_conventions_are_those_of_the_programs() {
    let five = [-0.21, 0.07, 3e-4, -7.25e-5, 0.01];
    for name in ["opencv.yaml", "opencv.xml", "opencv.json"] {
        let (camera, said) = read(name);
        assert_eq!(camera, truth(&five), "{name}");
        assert!(said.contains("OpenCV"), "{said}");
    }
    let (ros, said) = read("ros.yaml");
    // ROS prints eight digits.
    assert_eq!(ros, Intrinsics { fx: 612.34568, ..truth(&[-0.21, 0.07, 3e-4, -7.3e-5, 0.01]) });
    assert!(said.contains("ROS"), "{said}");
    // A message as `ros2 topic echo` prints it, of a driver that bins.
    let (message, said) = read("ros2_echo.yaml");
    assert_eq!(message, truth(&five));
    assert!(said.contains("ROS") && said.contains("its binning 2 x 2 belongs to the driver"), "{said}");
    let (kalibr, said) = read("kalibr.yaml");
    assert_eq!(kalibr, truth(&five[..4]));
    assert!(said.contains("Kalibr"), "{said}");
    // MATLAB's first pixel is (1, 1), and its matrix is transposed.
    let (matlab, said) = read("matlab.json");
    assert_eq!(matlab, truth(&five));
    assert!(said.contains("1 px was taken off"), "{said}");
}

#[test]
fn halcons_polynomial_is_turned_round_and_its_division_refused() {
    let (camera, said) = read("halcon_polynomial.dat");
    assert!(
        (camera.fx - 0.0051 / 8.3e-6).abs() < 1e-9 && camera.cx == 321.25 && said.contains("the same to 0.0"),
        "{said}"
    );
    // From a distorted pixel HALCON's formula leads to a ray; that ray must be seen at the pixel.
    let (focus, cell) = (0.0051, 8.3e-6);
    let [k1, k2, p1, p2] = [3200.5, -1.1e7, 0.012, -0.034];
    for [u, v] in [[10.0, 12.0], [320.0, 240.0], [600.0, 30.0], [45.0, 470.0]] {
        let (a, b) = ((u - 321.25) * cell, (v - 239.5) * cell);
        let r2: f64 = a * a + b * b;
        let radial = k1 * r2 + k2 * r2 * r2;
        let x = a + a * radial + p1 * (r2 + 2.0 * a * a) + 2.0 * p2 * a * b;
        let y = b + b * radial + 2.0 * p1 * a * b + p2 * (r2 + 2.0 * b * b);
        let at = camera.pixel_from_point(&Vec3::new(x, y, focus)).unwrap();
        assert!((at.x - u).hypot(at.y - v) < 0.05, "{at} for {u} {v}");
    }
    let refused = Values::load(&file("halcon_division.dat")).unwrap_err();
    assert!(refused.what.contains("kappa is -2253.5") && !refused.next.is_empty(), "{refused}");
}

/// A camera without a lens measures wrongly, so a key that is not recognised must not become zeros.
#[test]
fn a_lens_is_read_under_any_spelling_or_the_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let load = |text: &str| {
        let path = dir.path().join("c.txt");
        std::fs::write(&path, text).unwrap();
        Values::load(&path)
    };
    let five = truth(&[-0.21, 0.07, 3e-4, -7.25e-5, 0.01]);
    let json = std::fs::read_to_string(file("opencv.json")).unwrap();
    for key in ["dist_coeff", "dist_coefs", "distortion", "distortionCoefficients", "DistCoeffs", "distortion_params"] {
        let values = load(&json.replace("distortion_coefficients", key)).unwrap();
        assert_eq!(values.intrinsics, Some(five), "{key}");
        let said = values.read_as.unwrap();
        assert!(said.contains(&format!("5 lens terms k1 k2 p1 p2 k3 ... of '{key}'")), "{said}");
    }
    let ros = std::fs::read_to_string(file("ros2_echo.yaml")).unwrap();
    let list = "d:\n- -0.21\n- 0.07\n- 0.0003\n- -7.25e-05\n- 0.01\n";
    assert!(ros.contains(list));
    let empty = load(&ros.replace(list, "d: []\n")).unwrap();
    assert!(empty.intrinsics == Some(truth(&[0.0; 5])) && empty.read_as.unwrap().contains("no lens terms"));
    let kalibr = std::fs::read_to_string(file("kalibr.yaml")).unwrap();
    let matlab = std::fs::read_to_string(file("matlab.json")).unwrap();
    let defaults = load(&matlab.replace("\"RadialDistortion", "\"Radial")).unwrap();
    assert!(defaults.read_as.unwrap().contains("RadialDistortion is not there: zeros"));
    let halcon = std::fs::read_to_string(file("halcon_polynomial.dat")).unwrap();
    for (text, wanted) in [
        (json.replace("distortion_coefficients", "cam_dist"), "does not state its lens"),
        (ros.replace(list, ""), "does not state its lens"),
        (json.replace("\"flags\": 0", "\"D\": [0, 0, 0, 0, 0]"), "two lenses that differ"),
        (kalibr.replace("  distortion_model: radtan\n", ""), "has no distortion_model"),
        (kalibr.replace("radtan", "none"), "distortion_model is 'none'"),
        (halcon.replace("Poly1:poly1", "Other:other"), "has no Poly1"),
    ] {
        let fault = load(&text).err().unwrap_or_else(|| panic!("'{wanted}' was taken: {text}"));
        assert!(fault.what.contains(wanted) && !fault.next.is_empty(), "'{wanted}' is not in: {fault}");
    }
}

#[test]
fn what_the_lens_cannot_say_is_refused_by_its_name() {
    let dir = tempfile::tempdir().unwrap();
    let kalibr = std::fs::read_to_string(file("kalibr.yaml")).unwrap();
    let ros = std::fs::read_to_string(file("ros.yaml")).unwrap();
    let opencv = std::fs::read_to_string(file("opencv.json")).unwrap();
    let echo = std::fs::read_to_string(file("ros2_echo.yaml")).unwrap();
    let halcon = std::fs::read_to_string(file("halcon_polynomial.dat")).unwrap();
    let second = kalibr.replace("cam0", "cam1");
    let stereo = "image_size: [640, 480]\nM1: [600, 0, 318, 0, 600, 242, 0, 0, 1]\nD1: [0, 0, 0, 0, 0]\n\
                  M2: [660, 0, 288, 0, 660, 252, 0, 0, 1]\nD2: [0, 0, 0, 0, 0]\n";
    for (text, wanted) in [
        (kalibr.replace("radtan", "equidistant"), "'equidistant'"),
        (kalibr.replace("pinhole", "omni"), "'omni'"),
        (ros.replace("plumb_bob", "equidistant"), "'equidistant'"),
        (ros.replace("data: [-0.210000, 0.070000,", "data: ["), "the lens: 3 numbers"),
        (ros.replace("image_width: 640\n", ""), "size of the pictures"),
        (kalibr.clone() + &second, "2 cameras: cam0, cam1"),
        (stereo.to_owned(), "2 camera matrices: M1, M2"),
        (echo.clone() + &echo, "begins a second document"),
        (halcon.replace("Focus:foc", "Magnification:mag"), "a telecentric camera (Magnification 0.0051)"),
        (opencv.replace("\"flags\": 0", "\"xi\": 1.2"), "xi is 1.2"),
        (opencv.replace("\"flags\": 0", "\"lens_model\": \"fisheye\""), "lens_model is 'fisheye'"),
        (opencv.replace("\"flags\": 0", "\"is_fisheye\": true"), "is_fisheye is true"),
        ("{\"camera_matrix\": 1, \"image_size\": [640, 480], \"camera_matrix\": 2}".into(), "camera_matrix"),
        ("{\"units\": \"inch\", \"laser_plane_camera\": {}}".into(), "lengths are read in mm only"),
    ] {
        let path = dir.path().join("c.yaml");
        std::fs::write(&path, &text).unwrap();
        let fault = Values::load(&path).err().unwrap_or_else(|| panic!("'{wanted}' was taken: {text}"));
        assert!(fault.what.contains(wanted) && !fault.next.is_empty(), "'{wanted}' is not in: {fault}");
    }
}

#[test]
fn a_matrix_of_pictures_of_another_size_is_asked_about() {
    let dir = tempfile::tempdir().unwrap();
    let (path, station) = (dir.path().join("c.yaml"), dir.path().join("st").to_str().unwrap().to_owned());
    let text = std::fs::read_to_string(file("ros.yaml")).unwrap();
    for (size, accepted) in [([640, 480], true), ([320, 240], false), ([1280, 960], false), ([600, 440], true)] {
        let [width, height] = size.map(|s| s.to_string());
        let other = text.replace("image_width: 640", &format!("image_width: {width}"));
        std::fs::write(&path, other.replace("image_height: 480", &format!("image_height: {height}"))).unwrap();
        let import = ["station", "import", path.to_str().unwrap(), "--station", &station];
        if accepted {
            sheetlight(&import);
            continue;
        }
        let (_, said) = sheetlight_fails(&import);
        assert!(said.contains("principal point") && said.contains("--as-stated"), "{size:?}: {said}");
        sheetlight(&[&import[..], &["--as-stated"]].concat());
    }
}

#[test]
fn an_import_says_how_it_read_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let station = dir.path().join("st").to_str().unwrap().to_owned();
    let from = file("ros2_echo.yaml");
    let import = ["station", "import", from.to_str().unwrap(), "--station", &station];
    let said = sheetlight(&[&["--json"], &import[..]].concat());
    let result: serde_json::Value = serde_json::from_str(&said).unwrap();
    assert_eq!(result["stored"], serde_json::json!(["camera"]));
    let remarks = result["remarks"].as_array().unwrap();
    let has = |words: &str| remarks.iter().any(|r| r.as_str().unwrap().contains(words));
    assert!(has("camera: read as ROS (camera_info) writes it") && has("binning 2 x 2"), "{said}");
    assert!(has("assumed at the import"), "{said}");
    // On the console the remarks are messages, not data.
    let done = std::process::Command::new(program()).args(import).output().unwrap();
    let talk = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && talk.contains("binning 2 x 2"), "{talk}");
    assert!(!String::from_utf8_lossy(&done.stdout).contains("binning"));
}

#[test]
fn a_camera_goes_into_a_station_and_out_again() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let station = at("st");
    let said = sheetlight(&["station", "import", file("opencv.yaml").to_str().unwrap(), "--station", &station]);
    assert!(said.contains("camera"), "{said}");
    let rig = Rig::load(Path::new(&station)).unwrap();
    assert_eq!(rig.camera.as_ref().unwrap().value, truth(&[-0.21, 0.07, 3e-4, -7.25e-5, 0.01]));
    let reasons = rig.camera.unwrap().quality.reasons;
    assert!(reasons.iter().any(|r| r.contains("as OpenCV writes it")), "{reasons:?}");
    for (format, name) in [("opencv", "o.xml"), ("opencv", "o.json"), ("ros", "r.yaml")] {
        sheetlight(&["station", "export", "--station", &station, "--as", format, "--out", &at(name)]);
        let again = Values::load(Path::new(&at(name))).unwrap().intrinsics.unwrap();
        assert_eq!(again, truth(&[-0.21, 0.07, 3e-4, -7.25e-5, 0.01]), "{name}");
    }
    // Kalibr has no k3.
    let (_, said) =
        sheetlight_fails(&["station", "export", "--station", &station, "--as", "kalibr", "--out", &at("k.yaml")]);
    assert!(said.contains("5 terms"), "{said}");
}
