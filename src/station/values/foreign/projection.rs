//! In: a key that states a lens model. Out: the error for a model that this program does not have.
//! Frame and unit: none.

use crate::fault::Fault;
use serde_json::Value;

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
