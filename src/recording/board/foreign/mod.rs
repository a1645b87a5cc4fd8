//! In: texts in which other programs describe calibration targets. Out: the board, or the reason why that target is
//! not read.
//! Frame and unit: metres in the texts; board frame, mm in the result.

mod halcon;
mod kalibr;
mod ros_industrial;
mod values;

pub use halcon::read as halcon;

use super::spec::BoardSpec;
use crate::fault::{Fault, Result};
use serde_json::Value;

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
