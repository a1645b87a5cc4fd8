//! In: an option's value as typed. Out: the parsed value, or what was expected.
//! Frame and unit: the option's.

pub(crate) use crate::procedure::word::parse;
use serde_json::Value;
use sheetlight::fault::{Fault, Result};
use std::collections::BTreeMap;

/// Parses numbers separated by commas, for clap's `value_parser`.
pub(crate) fn numbers<const N: usize>(s: &str) -> std::result::Result<[f64; N], String> {
    let read: Option<Vec<f64>> = s.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let read = read.and_then(|v| v.try_into().ok());
    read.ok_or_else(|| format!("wanted {N} numbers parted by commas, e.g. {}", vec!["0"; N].join(",")))
}

/// Parses words of the form NAME=VALUE; an empty VALUE means null.
pub(crate) fn changes(words: &[String]) -> Result<BTreeMap<String, Value>> {
    let change = |s: &String| {
        let (name, value) = s.split_once('=').ok_or_else(|| {
            Fault::usage(format!("'{s}' has no =")).next("write NAME=VALUE, for example threshold.minimum=12")
        })?;
        let text = || Value::String(value.to_owned());
        let value = if value.is_empty() { Value::Null } else { serde_json::from_str(value).unwrap_or_else(|_| text()) };
        Ok((name.trim().to_owned(), value))
    };
    words.iter().map(change).collect()
}
