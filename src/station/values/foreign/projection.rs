//! In: all keys of another program's camera file. Out: an error for a key or a text that names a projection or a lens
//! model that this program does not have. Frame and unit: none.

use super::keys::numbers;
use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// What names another projection wherever it stands, in lower case and without separators. The last is MATLAB's
/// fisheye.
const PARTS: [&str; 12] = [
    "fisheye",
    "omnidir",
    "equidistant",
    "equisolid",
    "equirectangular",
    "stereographic",
    "orthographic",
    "kannala",
    "scaramuzza",
    "doublesphere",
    "telecentric",
    "mappingcoefficients",
];
/// The same as whole words.
const WORDS: [&str; 9] = ["omni", "mei", "ocam", "ocamcalib", "ucm", "eucm", "kb4", "kb8", "ftheta"];
/// The same as the value of a key that states a model; elsewhere these words mean something else.
const MODELS: [&str; 5] = ["ds", "fov", "division", "unified", "atan"];
/// Parts of keys that state a model.
const STATING: [&str; 4] = ["model", "type", "projection", "lens"];
/// Parts of keys whose texts are names of things: a camera may be called fisheye_left, and OmniVision makes sensors.
const LABELS: [&str; 10] = ["name", "topic", "frame", "file", "path", "serial", "vendor", "device", "time", "date"];

/// Refuses a file that names another projection, in any of its keys.
pub fn check(file: &Map<String, Value>) -> Result<()> {
    for (key, value) in file.iter().filter(|(_, value)| !off(value)) {
        if is_xi(key, value) || names(key, false) || texts(value).iter().any(|text| states(key, text)) {
            return Err(another(key, value));
        }
        match value {
            Value::Object(inner) => check(inner)?,
            Value::Array(items) => items.iter().filter_map(Value::as_object).try_for_each(check)?,
            _ => {}
        }
    }
    Ok(())
}

/// Whether a value says that what its key names is absent. YAML's false is a text here.
fn off(value: &Value) -> bool {
    match value {
        Value::Null => true,
        Value::Bool(on) => !on,
        Value::Number(n) => n.as_f64() == Some(0.0),
        Value::String(text) => ["", "false", "no", "off", "none"].contains(&text.to_lowercase().as_str()),
        Value::Array(items) => items.is_empty(),
        Value::Object(map) => map.is_empty(),
    }
}

/// The parameter of the unified model, as OpenCV's omnidirectional calibration writes it. With 0 it is a pinhole.
fn is_xi(key: &str, value: &Value) -> bool {
    key.eq_ignore_ascii_case("xi") && numbers(value).is_none_or(|xi| xi.iter().any(|x| *x != 0.0))
}

fn texts(value: &Value) -> Vec<&str> {
    match value {
        Value::String(text) => vec![text],
        Value::Array(items) => items.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    }
}

fn states(key: &str, text: &str) -> bool {
    let key = key.to_lowercase();
    let of_model = STATING.iter().any(|part| key.contains(part));
    names(text, of_model) && (of_model || !LABELS.iter().any(|part| key.contains(part)))
}

/// Whether a text names another projection.
fn names(text: &str, of_model: bool) -> bool {
    let text = text.to_lowercase();
    let tight = text.replace(|c: char| !c.is_alphanumeric(), "");
    let mut words = text.split(|c: char| !c.is_alphanumeric());
    PARTS.iter().any(|part| tight.contains(part))
        || words.any(|word| WORDS.contains(&word) || of_model && MODELS.contains(&word))
}

/// The error for a key whose value is another model.
pub fn another(key: &str, value: &Value) -> Fault {
    let shown: String = match value {
        Value::String(text) => format!("'{}'", text.chars().take(60).collect::<String>()),
        other => other.to_string().chars().take(60).collect(),
    };
    Fault::input(format!(
        "{key} is {shown}, only Brown-Conrady's lens model and OpenCV's extensions of it are known here"
    ))
    .cause("calibrated as a fisheye or with another program's model, whose terms mean something else")
    .next(
        "calibrate with the model of radial and tangential terms (plumb_bob, radtan), or here: sheetlight \
             calibrate camera; if the key means something else, remove it from the file",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn said(file: Value) -> String {
        let Value::Object(map) = file else { panic!("no object") };
        check(&map).map_or_else(|fault| fault.what, |()| String::new())
    }

    #[test]
    fn another_projection_is_refused_by_key_and_value() {
        for (file, key, value) in [
            (json!({ "xi": { "rows": 1, "data": [1.2] } }), "xi", "1.2"),
            (json!({ "xi": 1.2 }), "xi", "1.2"),
            (json!({ "model": "fisheye" }), "model", "'fisheye'"),
            (json!({ "Model": "Fish-Eye" }), "Model", "'Fish-Eye'"),
            (json!({ "lens_model": "fisheye" }), "lens_model", "'fisheye'"),
            (json!({ "camera_type": "omni" }), "camera_type", "'omni'"),
            (json!({ "type": "double sphere" }), "type", "'double sphere'"),
            (json!({ "is_fisheye": true }), "is_fisheye", "true"),
            (json!({ "fisheye": 1 }), "fisheye", "1"),
            (json!({ "fisheye_model": "True" }), "fisheye_model", "'True'"),
            (json!({ "distortion": "fisheye" }), "distortion", "'fisheye'"),
            (json!({ "calibration_model": "KANNALA_BRANDT" }), "calibration_model", "'KANNALA_BRANDT'"),
            (json!({ "model_type": "KB4" }), "model_type", "'KB4'"),
            (json!({ "projection": "equidistant" }), "projection", "'equidistant'"),
            (json!({ "lens_name": "fisheye 180" }), "lens_name", "'fisheye 180'"),
            (json!({ "camera": { "lens": ["telecentric"] } }), "lens", "telecentric"),
            (json!({ "cameras": [{ "model": "mei" }] }), "model", "'mei'"),
            (json!({ "ocam": { "poly": [1, 2] } }), "ocam", "poly"),
            (json!({ "notes": "calibrated with Scaramuzza's toolbox" }), "notes", "Scaramuzza"),
            (json!({ "camera_model": "ds" }), "camera_model", "'ds'"),
            (json!({ "MappingCoefficients": [875, 0, 0, 0] }), "MappingCoefficients", "875"),
        ] {
            let what = said(file.clone());
            assert!(what.starts_with(&format!("{key} is ")) && what.contains(value), "{file}: {what}");
        }
    }

    #[test]
    fn what_is_off_or_only_called_so_is_no_projection() {
        for file in [
            json!({ "fisheye_model": 0.0, "is_fisheye": false, "fisheye": "False", "omni": null, "fisheye_d": [] }),
            json!({ "xi": 0, "Xi": { "rows": 1, "cols": 1, "dt": "d", "data": [0.0] } }),
            json!({ "camera_name": "fisheye_left", "rostopic": "/fisheye/image", "header": { "frame_id": "omni" } }),
            json!({ "sensor": "OmniVision OV9281", "fov": 63.0, "unit": "ds", "lens": "aspherical 8 mm" }),
            json!({ "distortion_model": "plumb_bob", "type_id": "opencv-matrix", "model": "pinhole" }),
        ] {
            assert_eq!(said(file.clone()), "", "{file}");
        }
    }
}
