//! In: an option's value as typed. Out: the parsed value, or what was expected.
//! Frame and unit: the option's.

pub(crate) use crate::procedure::word::{numbers, parse};
use serde_json::Value;
use sheetlight::fault::{Fault, Result};
use std::collections::BTreeMap;

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
