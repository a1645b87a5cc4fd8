//! In: the keys of a values file. Out: an error for a statement about its numbers that is not followed: another unit,
//! another order of the matrix, a transform between other frames or the other way round.
//! Frame and unit: the file's, which must be mm, row-major, and the transforms that are named.

use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Rigid};
use crate::raster::unit_mm;
use serde_json::{Map, Value};

const UNITS: [&str; 5] = ["unit", "units", "length_unit", "length_units", "units_length"];
const ORDERS: [&str; 5] = ["layout", "order", "storage_order", "matrix_order", "major"];
/// Entries with lengths in mm. An axis states its own unit.
const LENGTHS: [&str; 4] = ["flange_T_camera", "base_T_camera", "laser_plane_camera", "pointer_camera"];
/// Names of frames between which a camera's pose can be stated. Boards and parts are not among them: their poses are
/// not a rig's values.
const FRAMES: [&str; 11] =
    ["flange", "base", "tool", "tool0", "tcp", "gripper", "hand", "wrist", "ee", "end_effector", "effector"];
const CAMERA: [&str; 4] = ["camera", "cam", "cam0", "sensor"];
/// Words of a unit of something other than a length.
const ANGLES: [&str; 7] = ["deg", "degree", "degrees", "rad", "radian", "radians", "px"];

/// Refuses statements that the reader of values would not follow.
pub fn check(file: &Map<String, Value>) -> Result<()> {
    let lengths: Vec<&Value> = LENGTHS.iter().filter_map(|k| file.get(*k)).collect();
    if !lengths.is_empty() {
        let inner = lengths.iter().filter_map(|v| v.as_object());
        std::iter::once(file).chain(inner).try_for_each(units)?;
        order(file)?;
    }
    file.iter().try_for_each(|(key, value)| transform(key, value, file))
}

/// All words of a value.
fn words(value: &Value) -> Vec<String> {
    match value {
        Value::String(text) => {
            let words = text.split(|c: char| !c.is_alphanumeric()).filter(|w| !w.is_empty());
            words.map(str::to_lowercase).collect()
        }
        Value::Array(items) => items.iter().flat_map(words).collect(),
        Value::Object(map) => map.values().flat_map(words).collect(),
        _ => Vec::new(),
    }
}

fn stated<'a>(map: &'a Map<String, Value>, keys: &[&str]) -> impl Iterator<Item = (&'a String, &'a Value)> {
    map.iter().filter(|(k, _)| keys.contains(&k.to_lowercase().as_str())).collect::<Vec<_>>().into_iter()
}

fn units(map: &Map<String, Value>) -> Result<()> {
    for (key, value) in stated(map, &UNITS) {
        let words = words(value);
        // "in" is mostly the preposition.
        let lengths: Vec<f64> = words.iter().filter(|w| *w != "in").filter_map(|w| unit_mm(w)).collect();
        let of_angles = words.iter().all(|w| ANGLES.contains(&w.as_str()));
        if lengths.iter().any(|mm| *mm != 1.0) || !of_angles && lengths.is_empty() {
            return Err(Fault::input(format!("{key} is {value}, lengths are read in mm only"))
                .cause("another program's file: its lengths would be taken as millimetres")
                .next("convert the lengths to mm and state \"units\": \"mm\""));
        }
    }
    Ok(())
}

fn order(map: &Map<String, Value>) -> Result<()> {
    for (key, value) in stated(map, &ORDERS) {
        if words(value).iter().any(|w| w.starts_with("col") || w == "fortran") {
            return Err(Fault::input(format!("{key} is {value}, matrices are read row by row only"))
                .cause("another program's file: its matrix would be transposed")
                .next("write the matrix row by row, its last row is 0 0 0 1"));
        }
    }
    Ok(())
}

/// Refuses a camera's pose under a key that is not read, unless it repeats one that is.
fn transform(key: &str, value: &Value, file: &Map<String, Value>) -> Result<()> {
    let named = if key == "transform" { value.as_str().unwrap_or_default() } else { key };
    let Some((to, from)) = named.split_once("_T_") else { return Ok(()) };
    let is = |name: &str, names: &[&str]| names.contains(&name.to_lowercase().as_str());
    let of_camera = is(to, &FRAMES) && is(from, &CAMERA) || is(to, &CAMERA) && is(from, &FRAMES);
    if !of_camera || matches!(named, "flange_T_camera" | "base_T_camera") {
        return Ok(());
    }
    let other = if to == "camera" { file.get(&format!("{from}_T_{to}")) } else { None };
    if other.is_some_and(|other| inverse(value, other)) {
        return Ok(());
    }
    Err(Fault::input(format!("holds {named}, only flange_T_camera and base_T_camera are read"))
        .cause("another program's file, or the transform the other way round")
        .next(
            "write the pose of the camera in the flange as flange_T_camera (of a camera that stands still: \
               base_T_camera), inverted or multiplied by the tool if needed",
        ))
}

/// Whether two matrices are each other's inverse, to the digits that files have.
fn inverse(a: &Value, b: &Value) -> bool {
    let rows = |v: &Value| serde_json::from_value::<[f64; 16]>(v.clone()).ok();
    let there = rows(a).and_then(|m| Rigid::<Camera, Base>::from_rows(&m).ok());
    let back = rows(b).and_then(|m| Rigid::<Base, Camera>::from_rows(&m).ok());
    there.zip(back).is_some_and(|((there, _), (back, _))| {
        let (angle, mm) = there.inverse().difference(&back);
        angle < 1e-4 && mm < 0.01
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn said(more: Value) -> String {
        let mut file = json!({ "flange_T_camera": [1, 0, 0, 3.5, 0, 1, 0, 2, 0, 0, 1, 9, 0, 0, 0, 1] });
        let (file, Value::Object(more)) = (file.as_object_mut().unwrap(), more) else { panic!() };
        file.extend(more);
        check(file).map_or_else(|fault| fault.what, |()| String::new())
    }

    #[test]
    fn a_statement_is_followed_or_refused() {
        for more in [
            json!({ "units": "mm, degrees unless stated", "layout": "row-major 4x4", "set": "flat" }),
            json!({ "units": "degrees", "camera_T_board": [[1]], "base_T_part": [1], "transform": "flange_T_camera" }),
            json!({ "camera_T_flange": [1, 0, 0, -3.5, 0, 1, 0, -2, 0, 0, 1, -9, 0, 0, 0, 1] }),
            json!({ "linear_axis": { "unit": "count" }, "pointer_camera": { "unit": "mm" } }),
        ] {
            assert_eq!(said(more.clone()), "", "{more}");
        }
        for (more, wanted) in [
            (json!({ "units": "inch" }), "units is \"inch\""),
            (json!({ "Units": { "length": "m", "angle": "deg" } }), "lengths are read in mm only"),
            (json!({ "unit": "mm, base in m" }), "lengths are read in mm only"),
            (json!({ "laser_plane_camera": { "unit": "m" } }), "unit is \"m\""),
            (json!({ "layout": "column-major 4x4" }), "row by row only"),
            (json!({ "camera_T_flange": [1, 0, 0, 3.5, 0, 1, 0, 2, 0, 0, 1, 9, 0, 0, 0, 1] }), "camera_T_flange"),
            (json!({ "tool_T_camera": [1] }), "tool_T_camera"),
            (json!({ "transform": "camera_T_flange" }), "camera_T_flange"),
        ] {
            let what = said(more);
            assert!(what.contains(wanted), "{wanted}: {what}");
        }
        // Pixels have no length.
        let camera = json!({ "units": "m", "intrinsics": {} });
        assert!(check(camera.as_object().unwrap()).is_ok());
    }
}
