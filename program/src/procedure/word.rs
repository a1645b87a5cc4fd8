//! In: an input that is one of several words, or several numbers. Out: its form on the command line; a word's in orders
//! and in their JSON schema, too.
//! Frame and unit: none.

use schemars::{Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::Serializer;
use std::str::FromStr;
use strum::VariantArray;

/// Parses the word, for clap's `value_parser`.
pub(crate) fn parse<T: FromStr<Err = String>>(word: &str) -> Result<T, String> {
    word.parse()
}

/// Parses numbers separated by commas, for clap's `value_parser`.
pub(crate) fn numbers<const N: usize>(s: &str) -> Result<[f64; N], String> {
    let read: Option<Vec<f64>> = s.split(',').map(|v| v.trim().parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let read = read.and_then(|v| v.try_into().ok());
    read.ok_or_else(|| format!("wanted {N} numbers parted by commas, e.g. {}", vec!["0"; N].join(",")))
}

/// Writes the word.
pub fn serialize<T: Copy + Into<&'static str>, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str((*value).into())
}

/// Reads the word, null for the default; the error lists all words.
pub fn deserialize<'a, T: FromStr<Err = String> + Default, D: Deserializer<'a>>(from: D) -> Result<T, D::Error> {
    Option::<String>::deserialize(from)?.map_or(Ok(T::default()), |word| word.parse().map_err(D::Error::custom))
}

/// The words as an enumeration, or null.
pub fn schema<T: VariantArray + Copy + Into<&'static str>>(_: &mut SchemaGenerator) -> Schema {
    let words = T::VARIANTS.iter().map(|word| Some((*word).into())).chain([None]);
    json_schema!({ "type": ["string", "null"], "enum": words.collect::<Vec<Option<&str>>>() })
}
