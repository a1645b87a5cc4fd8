//! A camera from the keys of another program's calibration: OpenCV, ROS camera_info, Kalibr, MATLAB. A lens model
//! that this program cannot represent is refused by name.

use super::{halcon, tree};
use crate::camera::{Distortion, Intrinsics};
use crate::fault::{Fault, Result};
use serde_json::Value;

/// Key names that programs use for the same content.
const MATRIX: [&str; 8] =
    ["camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "intrinsic_matrix", "K", "M1", "k"];
const LENS: [&str; 10] = [
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "distCoeffs",
    "distCoeff",
    "dist",
    "D",
    "D1",
    "d",
];
const WIDTH: [&str; 3] = ["image_width", "image_Width", "width"];
const HEIGHT: [&str; 3] = ["image_height", "image_Height", "height"];
const SIZE: [&str; 3] = ["image_size", "imageSize", "resolution"];

/// The camera in a file, and a remark for the user on how it was read; `None` if the file holds no camera of
/// another program.
pub fn camera(text: &str) -> Result<Option<(Intrinsics, String)>> {
    if halcon::is_one(text) {
        return halcon::camera(text).map(Some);
    }
    let file = match tree::read(text) {
        Ok(file) => file,
        // This program's own values are JSON; their reader reports what is wrong with them.
        Err(_) if text.trim_start_matches('\u{feff}').trim_start().starts_with('{') => return Ok(None),
        Err(fault) => return Err(fault),
    };
    let Value::Object(map) = &file else { return Ok(None) };
    if map.contains_key("FocalLength") || map.contains_key("IntrinsicMatrix") {
        return matlab(&file).map(Some);
    }
    let chain: Vec<(&String, &Value)> = map.iter().filter(|(_, v)| v.get("camera_model").is_some()).collect();
    match chain[..] {
        [] => {}
        [(_, only)] => return kalibr(only).map(Some),
        _ => {
            let names: Vec<&str> = chain.iter().map(|(k, _)| k.as_str()).collect();
            return Err(Fault::input(format!("holds {} cameras: {}", chain.len(), names.join(", ")))
                .cause("Kalibr's chain of several cameras; a station has one")
                .next("leave one of them in the file"));
        }
    }
    if file.get("camera_model").is_some() {
        return kalibr(&file).map(Some);
    }
    single(map)?;
    if any(&file, &MATRIX).is_none() || file.get("intrinsics").is_some() {
        return Ok(None);
    }
    opencv(&file).map(Some)
}

/// Refuses a file with the matrices of two cameras: M1 and M2, `camera_matrix_left` and `camera_matrix_right`.
fn single(map: &serde_json::Map<String, Value>) -> Result<()> {
    let cameras: Vec<&str> = map.iter().filter(|(_, v)| pinhole(v)).map(|(k, _)| k.as_str()).collect();
    let second = |name: &&&str| {
        let name = name.to_lowercase();
        name.ends_with('2') || name.contains("right")
    };
    if cameras.len() < 2 || !cameras.iter().any(|name| second(&name)) {
        return Ok(());
    }
    Err(Fault::input(format!("holds {} camera matrices: {}", cameras.len(), cameras.join(", ")))
        .cause("a calibration of a pair of cameras; a station has one")
        .next("leave one of them in the file, with its lens"))
}

/// Whether a value is a camera matrix.
fn pinhole(v: &Value) -> bool {
    matches!(numbers(v).as_deref(), Some(&[fx, _, cx, 0.0, fy, cy, 0.0, 0.0, 1.0])
        if fx > 1.0 && fy > 1.0 && cx > 1.0 && cy > 1.0)
}

fn any<'a>(v: &'a Value, names: &[&str]) -> Option<&'a Value> {
    names.iter().find_map(|n| v.get(*n)).filter(|v| !v.is_null())
}

fn missing(what: &str, names: &[&str]) -> Fault {
    Fault::input(format!("has no {what}, looked for as {}", names.join(", ")))
        .cause("another program's file, or keys of another spelling")
        .next("add it, or rename the key")
}

/// All numbers of a list, a list of lists, or a matrix with `data`, row by row.
fn numbers(v: &Value) -> Option<Vec<f64>> {
    match v {
        Value::Number(n) => n.as_f64().map(|n| vec![n]),
        Value::Array(items) => items.iter().map(numbers).collect::<Option<Vec<_>>>().map(|all| all.concat()),
        Value::Object(m) => m.get("data").and_then(numbers),
        _ => None,
    }
}

/// The numbers of a value; refuses a count that is not in `counts`.
fn exactly(v: &Value, what: &str, counts: &[usize]) -> Result<Vec<f64>> {
    numbers(v).filter(|n| counts.contains(&n.len())).ok_or_else(|| {
        let found = numbers(v).map_or("something else".into(), |n| format!("{} numbers", n.len()));
        let wanted: Vec<String> = counts.iter().map(usize::to_string).collect();
        Fault::input(format!("{what}: {found}, {} are wanted", wanted.join(" or ")))
            .cause("another lens model, or a damaged file")
            .next("write the calibration again")
    })
}

fn size(file: &Value) -> Result<[u32; 2]> {
    let one = |names: &[&str]| any(file, names).and_then(Value::as_f64);
    let pair = match (one(&WIDTH), one(&HEIGHT)) {
        (Some(w), Some(h)) => Some([w, h]),
        _ => any(file, &SIZE).and_then(numbers).and_then(|n| n.try_into().ok()),
    };
    let whole = |x: f64| (x.fract() == 0.0 && (1.0..=1e5).contains(&x)).then_some(x as u32);
    let [w, h] =
        pair.ok_or_else(|| missing("size of the pictures", &["image_width and image_height", "image_size"]))?;
    whole(w).zip(whole(h)).map(|(w, h)| [w, h]).ok_or_else(|| {
        Fault::input(format!("pictures of {w} x {h} px, whole numbers from 1 to 100000 are wanted"))
            .next("correct the file")
    })
}

fn from_matrix(k: &[f64], distortion: Distortion, [width, height]: [u32; 2]) -> Result<Intrinsics> {
    let pinhole = k[3] == 0.0 && k[6] == 0.0 && k[7] == 0.0 && k[8] == 1.0;
    if !pinhole {
        let transposed = k[1] == 0.0 && k[2] == 0.0 && k[5] == 0.0 && k[8] == 1.0;
        let why = if transposed { "the matrix is written column by column" } else { "no camera matrix" };
        return Err(Fault::input(format!("the camera matrix is {k:?}, fx s cx 0 fy cy 0 0 1 is wanted"))
            .cause(why)
            .next("write it row by row"));
    }
    Ok(Intrinsics { fx: k[0], fy: k[4], cx: k[2], cy: k[5], skew: k[1], distortion, width, height })
}

/// Files of OpenCV's calibration programs, and ROS' camera_info, which has the same keys and names the lens model.
fn opencv(file: &Value) -> Result<(Intrinsics, String)> {
    let matrix = any(file, &MATRIX).ok_or_else(|| missing("camera matrix", &MATRIX))?;
    let matrix = exactly(matrix, "the camera matrix", &[9])?;
    let model = file.get("distortion_model").and_then(Value::as_str).unwrap_or("");
    let fisheye = file.get("fisheye_model").and_then(Value::as_f64).is_some_and(|x| x != 0.0);
    if !matches!(model, "" | "plumb_bob" | "rational_polynomial" | "thin_prism" | "none") || fisheye {
        return Err(another_lens(if fisheye { "fisheye" } else { model }));
    }
    let terms = match any(file, &LENS) {
        Some(v) => {
            numbers(v).filter(|n| n.is_empty()).map_or_else(|| exactly(v, "the lens", &[4, 5, 8, 12, 14]), Ok)?
        }
        None => Vec::new(),
    };
    let terms = if terms.is_empty() { vec![0.0; 5] } else { terms };
    let distortion = Distortion::from_opencv(&terms).expect("counted above");
    let by = if model.is_empty() { "OpenCV" } else { "ROS (camera_info)" };
    let said = format!(
        "read as {by} writes it: {} lens terms k1 k2 p1 p2 k3 ..., (0, 0) is the centre of a pixel",
        terms.len()
    ) + &driver(file).map_or(String::new(), |d| {
        format!("; its {d} belongs to the driver, not to the matrix: state it as 'readout' in meta.json")
    });
    Ok((from_matrix(&matrix, distortion, size(file)?)?, said))
}

/// What a camera_info message reports of its driver's present pictures. Its matrix and size are always those of the
/// whole sensor (sensor_msgs/CameraInfo, "operational parameters"); 0 means "not used".
fn driver(file: &Value) -> Option<String> {
    let number = |v: &Value, key: &str| v.get(key).and_then(Value::as_f64).unwrap_or(0.0);
    let binned = ["binning_x", "binning_y"].map(|key| number(file, key).max(1.0));
    let roi = file.get("roi").unwrap_or(&Value::Null);
    let region = ["x_offset", "y_offset", "width", "height"].map(|key| number(roi, key));
    let mut said = Vec::new();
    if binned != [1.0; 2] {
        said.push(format!("binning {} x {}", binned[0], binned[1]));
    }
    if region != [0.0; 4] {
        said.push(format!("region {region:?}"));
    }
    (!said.is_empty()).then(|| said.join(", "))
}

fn another_lens(model: &str) -> Fault {
    Fault::input(format!(
        "the lens model is '{model}', only Brown-Conrady's and OpenCV's extensions of it are known \
         here"
    ))
    .cause("calibrated as a fisheye or with another program's model, whose terms mean something else")
    .next(
        "calibrate with the model of radial and tangential terms (plumb_bob, radtan), or here: sheetlight \
             calibrate camera",
    )
}

fn kalibr(cam: &Value) -> Result<(Intrinsics, String)> {
    let word = |key: &str| cam.get(key).and_then(Value::as_str).unwrap_or("none").to_owned();
    let (model, lens) = (word("camera_model"), word("distortion_model"));
    if model != "pinhole" {
        return Err(another_lens(&model));
    }
    let of = |key: &str| cam.get(key).ok_or_else(|| missing(key, &[key]));
    let k = exactly(of("intrinsics")?, "intrinsics", &[4])?;
    let terms = match lens.as_str() {
        "radtan" => exactly(of("distortion_coeffs")?, "distortion_coeffs", &[4])?,
        "none" => vec![0.0; 4],
        other => return Err(another_lens(other)),
    };
    let [width, height] = size(cam)?;
    let distortion = Distortion::from_opencv(&terms).expect("four terms");
    let camera = Intrinsics { fx: k[0], fy: k[1], cx: k[2], cy: k[3], skew: 0.0, distortion, width, height };
    Ok((camera, "read as Kalibr writes it: fu fv pu pv, radtan k1 k2 p1 p2, (0, 0) is the centre of a pixel".into()))
}

/// MATLAB's cameraParameters and cameraIntrinsics as `jsonencode(toStruct(p))` writes them: its first pixel is (1, 1),
/// its older matrix is transposed.
fn matlab(file: &Value) -> Result<(Intrinsics, String)> {
    let of = |key: &str, counts: &[usize]| file.get(key).map(|v| exactly(v, key, counts)).transpose();
    let (f, c, skew) = match (of("FocalLength", &[2])?, of("PrincipalPoint", &[2])?, of("IntrinsicMatrix", &[9])?) {
        (Some(f), Some(c), _) => (f, c, of("Skew", &[1])?.map_or(0.0, |s| s[0])),
        (_, _, Some(k)) => (vec![k[0], k[4]], vec![k[6], k[7]], k[3]),
        _ => return Err(missing("camera", &["FocalLength and PrincipalPoint", "IntrinsicMatrix"])),
    };
    let radial = of("RadialDistortion", &[2, 3])?.unwrap_or_else(|| vec![0.0; 2]);
    let tangential = of("TangentialDistortion", &[2])?.unwrap_or_else(|| vec![0.0; 2]);
    let [rows, columns]: [f64; 2] = of("ImageSize", &[2])?
        .ok_or_else(|| missing("size of the pictures", &["ImageSize"]))?
        .try_into()
        .expect("two numbers");
    let [width, height] = size(&serde_json::json!({ "image_size": [columns, rows] }))?;
    let terms = [radial[0], radial[1], tangential[0], tangential[1], radial.get(2).copied().unwrap_or(0.0)];
    let camera = Intrinsics {
        fx: f[0],
        fy: f[1],
        cx: c[0] - 1.0,
        cy: c[1] - 1.0,
        skew,
        distortion: terms.into(),
        width,
        height,
    };
    Ok((
        camera,
        "read as MATLAB writes it: its first pixel's centre is (1, 1), so 1 px was taken off the principal point"
            .into(),
    ))
}
