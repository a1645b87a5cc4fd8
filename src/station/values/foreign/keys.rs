//! In: a file's values by their keys. Out: the value under one of several names, numbers in any of the shapes that
//! programs write, errors for what is missing. Frame and unit: none.

use crate::fault::{Fault, Result};
use serde_json::Value;

/// The first of these keys that has a value.
pub fn any<'a>(v: &'a Value, names: &[&str]) -> Option<&'a Value> {
    names.iter().filter_map(|n| v.get(*n)).find(|v| !v.is_null())
}

/// The error for a value that is under none of these keys.
pub fn missing(what: &str, names: &[&str]) -> Fault {
    Fault::input(format!("has no {what}, looked for as {}", names.join(", ")))
        .cause("another program's file, or keys of another spelling")
        .next("add it, or rename the key")
}

/// All numbers of a list, a list of lists, or a matrix with `data`, row by row.
pub fn numbers(v: &Value) -> Option<Vec<f64>> {
    match v {
        Value::Number(n) => n.as_f64().map(|n| vec![n]),
        Value::Array(items) => items.iter().map(numbers).collect::<Option<Vec<_>>>().map(|all| all.concat()),
        Value::Object(m) => m.get("data").and_then(numbers),
        _ => None,
    }
}

/// The numbers of a value; refuses a count that is not in `counts`.
pub fn exactly(v: &Value, what: &str, counts: &[usize]) -> Result<Vec<f64>> {
    numbers(v).filter(|n| counts.contains(&n.len())).ok_or_else(|| {
        let found = numbers(v).map_or("something else".into(), |n| format!("{} numbers", n.len()));
        let wanted: Vec<String> = counts.iter().map(usize::to_string).collect();
        Fault::input(format!("{what}: {found}, {} are wanted", wanted.join(" or ")))
            .cause("another lens model, or a damaged file")
            .next("write the calibration again")
    })
}
