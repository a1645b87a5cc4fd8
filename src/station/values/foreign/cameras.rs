//! A camera from the keys of another program's calibration: OpenCV, ROS camera_info, Kalibr, MATLAB. A lens model
//! that this program cannot represent is refused by name.

use super::keys::{any, exactly, missing, numbers};
use super::{halcon, lens, projection, tree};
use crate::camera::{Distortion, Intrinsics};
use crate::fault::{Fault, Result};
use serde_json::Value;

/// Key names that programs use for the same content.
const MATRIX: [&str; 8] =
    ["camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "intrinsic_matrix", "K", "M1", "k"];
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
    let matlabs = ["FocalLength", "IntrinsicMatrix", "MappingCoefficients"];
    let (read, one): (fn(&Value) -> Result<(Intrinsics, String)>, &Value) =
        if matlabs.iter().any(|key| map.contains_key(*key)) {
            (matlab, &file)
        } else if let Some(cam) = of_kalibr(&file, map)? {
            (kalibr, cam)
        } else {
            single(map)?;
            if any(&file, &MATRIX).is_none() || map.contains_key("intrinsics") {
                return Ok(None);
            }
            (opencv, &file)
        };
    projection::check(map)?;
    read(one).map(Some)
}

/// The camera of Kalibr's chain, or that of a file with Kalibr's keys.
fn of_kalibr<'a>(file: &'a Value, map: &'a serde_json::Map<String, Value>) -> Result<Option<&'a Value>> {
    let chain: Vec<(&String, &Value)> = map.iter().filter(|(_, v)| v.get("camera_model").is_some()).collect();
    match chain[..] {
        [] => Ok(map.contains_key("camera_model").then_some(file)),
        [(_, only)] => Ok(Some(only)),
        _ => {
            let names: Vec<&str> = chain.iter().map(|(k, _)| k.as_str()).collect();
            Err(Fault::input(format!("holds {} cameras: {}", chain.len(), names.join(", ")))
                .cause("Kalibr's chain of several cameras; a station has one")
                .next("leave one of them in the file"))
        }
    }
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
    let map = file.as_object().expect("it has a key");
    let model = file.get("distortion_model").and_then(Value::as_str).unwrap_or("");
    if !matches!(model, "" | "plumb_bob" | "rational_polynomial" | "thin_prism" | "none") {
        return Err(projection::another("distortion_model", &model.into()));
    }
    let (terms, lens) = lens::terms(map)?;
    let distortion = Distortion::from_opencv(&terms).expect("counted there");
    let by = if model.is_empty() && !map.contains_key("distortion_model") { "OpenCV" } else { "ROS (camera_info)" };
    let said = format!("read as {by} writes it: {lens}, (0, 0) is the centre of a pixel")
        + &driver(file).map_or(String::new(), |d| {
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

fn kalibr(cam: &Value) -> Result<(Intrinsics, String)> {
    let of = |key: &str| cam.get(key).ok_or_else(|| missing(key, &[key]));
    let (model, lens) = (of("camera_model")?, of("distortion_model")?);
    if model != "pinhole" {
        return Err(projection::another("camera_model", model));
    }
    let k = exactly(of("intrinsics")?, "intrinsics", &[4])?;
    let (terms, said) = match lens.as_str() {
        Some("radtan") => (exactly(of("distortion_coeffs")?, "distortion_coeffs", &[4])?, "radtan k1 k2 p1 p2"),
        Some("none") => (unused(cam)?, "no lens terms, distortion_model is 'none'"),
        _ => return Err(projection::another("distortion_model", lens)),
    };
    let [width, height] = size(cam)?;
    let distortion = Distortion::from_opencv(&terms).expect("four terms");
    let camera = Intrinsics { fx: k[0], fy: k[1], cx: k[2], cy: k[3], skew: 0.0, distortion, width, height };
    Ok((camera, format!("read as Kalibr writes it: fu fv pu pv, {said}, (0, 0) is the centre of a pixel")))
}

/// The terms of a lens without a model, all zero.
fn unused(cam: &Value) -> Result<Vec<f64>> {
    match cam.get("distortion_coeffs").and_then(numbers) {
        Some(terms) if terms.iter().any(|t| *t != 0.0) => {
            Err(Fault::input(format!("distortion_model is 'none', distortion_coeffs is {terms:?}"))
                .cause("an edited file")
                .next("name the model of these terms, or remove them"))
        }
        _ => Ok(vec![0.0; 4]),
    }
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
    let (radial, tangential) = (of("RadialDistortion", &[2, 3])?, of("TangentialDistortion", &[2])?);
    // MATLAB's documented defaults.
    let lens = match (&radial, &tangential) {
        (None, None) => "; RadialDistortion and TangentialDistortion are not there: zeros, MATLAB's defaults",
        (None, _) => "; RadialDistortion is not there: zeros, MATLAB's default",
        (_, None) => "; TangentialDistortion is not there: zeros, MATLAB's default",
        _ => "",
    };
    let [radial, tangential] = [radial, tangential].map(|terms| terms.unwrap_or_else(|| vec![0.0; 2]));
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
    let origin = "its first pixel's centre is (1, 1), so 1 px was taken off the principal point";
    Ok((camera, format!("read as MATLAB writes it: {origin}{lens}")))
}
