//! In: an input that is one of several words. Out: its form on the command line, in orders, and in their JSON schema.
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
