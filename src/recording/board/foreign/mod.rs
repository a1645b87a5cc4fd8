//! In: texts in which other programs describe calibration targets. Out: the board, or the reason why that target is
//! not read.
//! Frame and unit: metres in the texts; board frame, mm in the result.

mod halcon;
mod kalibr;
mod ros_industrial;

pub use halcon::read as halcon;

use super::spec::BoardSpec;
use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// Reads a YAML file of Kalibr or of ROS-Industrial.
pub fn yaml(text: &str) -> Result<BoardSpec> {
    let whole = crate::files::yaml(text).map_err(|e| e.cause("not a target's description, or a damaged file"))?;
    let whole = whole.as_object().ok_or_else(unknown)?;
    if whole.contains_key("target_type") {
        return kalibr::read(whole);
    }
    // The finder's part of a calibration's configuration, or that part alone.
    let finder = whole.get("target_finder").and_then(Value::as_object).unwrap_or(whole);
    match finder.get("type").and_then(Value::as_str) {
        Some(kind) => ros_industrial::read(finder, kind),
        None => Err(unknown()),
    }
}

fn unknown() -> Fault {
    Fault::input("describes no calibration target: neither 'target_type' nor 'type' is stated")
        .cause("a camera's calibration, or another file of that program")
        .next("give Kalibr's target file, or ROS-Industrial's target_finder")
}

/// A positive number.
fn number(map: &Map<String, Value>, key: &str) -> Result<f64> {
    let value = map.get(key).ok_or_else(|| lacks(key))?;
    value.as_f64().filter(|n| *n > 0.0).ok_or_else(|| {
        Fault::input(format!("'{key}' is {value}, a number above 0 is needed"))
            .cause("a typing error")
            .next("correct the target's file")
    })
}

/// A length in metres, as mm. Nanometres are rounded: 0.0264 m times 1000 is not 26.4 otherwise.
fn mm(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}

/// A number of rows or columns.
fn count(map: &Map<String, Value>, key: &str) -> Result<u32> {
    let value = number(map, key)?;
    if value.fract() != 0.0 || value > 1000.0 {
        return Err(Fault::input(format!("'{key}' is {value}, a whole number from 1 to 1000 is needed"))
            .cause("a typing error")
            .next("correct the target's file"));
    }
    Ok(value as u32)
}

fn lacks(key: &str) -> Fault {
    Fault::input(format!("'{key}' is missing"))
        .cause("a file of another kind of target, or one that is cut off")
        .next("compare the file with the one that belongs to the printed target")
}
