//! In: entries of another program's file. Out: numbers, lengths and counts, or what is wrong with them.
//! Frame and unit: metres in the files, mm in the result.

use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// A positive number.
pub fn number(map: &Map<String, Value>, key: &str) -> Result<f64> {
    let value = map.get(key).ok_or_else(|| lacks(key))?;
    value.as_f64().filter(|n| *n > 0.0).ok_or_else(|| {
        Fault::input(format!("'{key}' is {value}, a number above 0 is needed"))
            .cause("a typing error")
            .next("correct the target's file")
    })
}

/// A length in metres, as mm. Nanometres are rounded: 0.0264 m times 1000 is not 26.4 otherwise.
pub fn mm(metres: f64) -> f64 {
    (metres * 1e9).round() / 1e6
}

/// A number of rows or columns.
pub fn count(map: &Map<String, Value>, key: &str) -> Result<u32> {
    let value = number(map, key)?;
    if value.fract() != 0.0 || value > 1000.0 {
        return Err(Fault::input(format!("'{key}' is {value}, a whole number from 1 to 1000 is needed"))
            .cause("a typing error")
            .next("correct the target's file"));
    }
    Ok(value as u32)
}

pub fn lacks(key: &str) -> Fault {
    Fault::input(format!("'{key}' is missing"))
        .cause("a file of another kind of target, or one that is cut off")
        .next("compare the file with the one that belongs to the printed target")
}
