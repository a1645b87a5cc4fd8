//! In: a record that the program writes and must find unchanged. Out: its JSON with a SHA-256 of everything else in
//! `seal`, and the record read back from it. A seal reveals edits and damage; it is no signature.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::Value;

/// Pretty JSON of a record, which must be an object, with its seal.
pub fn sealed(record: &impl Serialize) -> String {
    let mut value = serde_json::to_value(record).expect("plain data");
    let seal = seal_of(&value);
    value.as_object_mut().expect("an object").insert("seal".into(), seal.into());
    serde_json::to_string_pretty(&value).expect("plain data")
}

/// SHA-256 of the value in its unique compact form: keys sorted, numbers in their shortest exact form.
fn seal_of(value: &Value) -> String {
    super::hash_text(value.to_string().as_bytes())
}

/// Default advice, for files whose caller gives none.
const AGAIN: &str = "make it again, or restore the previous one";

/// The record of a file with a valid seal. `what` names the expected file in messages.
pub fn unsealed<T: DeserializeOwned>(text: &str, what: &str) -> Result<T> {
    let (value, seal) = apart(text, what)?;
    let Some(seal) = seal else {
        return Err(Fault::input(format!("{what}: has no seal"))
            .cause("written by a former version, by another program, or by hand")
            .next(AGAIN));
    };
    let is = seal_of(&value);
    if seal != is {
        return Err(Fault::input(format!(
            "{what}: was changed after it was made: the seal is {seal:.12}, the content gives {is:.12}"
        ))
        .cause("edited by hand, merged from two files, or damaged")
        .next(AGAIN));
    }
    shaped(value, what)
}

/// The object in a file and the seal that it carries, unchecked.
pub(super) fn apart(text: &str, what: &str) -> Result<(Value, Option<String>)> {
    let mut value = super::once::parse(text).map_err(|e| strange(what, &e))?;
    let Some(object) = value.as_object_mut() else {
        return Err(Fault::input(format!("{what}: is not a JSON object")).cause("another kind of file").next(AGAIN));
    };
    let seal = object.remove("seal").map(|s| s.as_str().unwrap_or_default().to_owned());
    Ok((value, seal))
}

pub(super) fn shaped<T: DeserializeOwned>(value: Value, what: &str) -> Result<T> {
    serde_json::from_value(value).map_err(|e| strange(what, &e))
}

fn strange(what: &str, e: &serde_json::Error) -> Fault {
    Fault::input(format!("{what}: cannot be understood: {e}"))
        .cause("edited by hand, truncated, or of another version")
        .next(AGAIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Some {
        x: Vec<f64>,
        name: String,
        n: u64,
    }

    #[test]
    fn a_sealed_record_comes_back_and_every_changed_byte_is_seen() {
        let record = Some { x: vec![0.1 + 0.2, -0.0, 1e300, 1.0 / 3.0], name: "ä".into(), n: u64::MAX };
        let text = sealed(&record);
        assert_eq!(unsealed::<Some>(&text, "it").unwrap(), record);
        // White space does not count as content; every digit and letter does.
        assert!(unsealed::<Some>(&text.replace("\n", ""), "it").is_ok());
        let mut seen = 0;
        for (i, c) in text.char_indices().filter(|(_, c)| c.is_ascii_alphanumeric()) {
            let other = if c.is_ascii_digit() { if c == '7' { '8' } else { '7' } } else { '_' };
            let edited = format!("{}{other}{}", &text[..i], &text[i + 1..]);
            // Changing the last digit of a number may leave its value unchanged.
            if serde_json::from_str::<Value>(&edited).is_ok_and(|v| v == serde_json::from_str::<Value>(&text).unwrap())
            {
                continue;
            }
            assert!(unsealed::<Some>(&edited, "it").is_err(), "{edited}");
            seen += 1;
        }
        assert!(seen > 100);
        let bare = serde_json::to_string(&record).unwrap();
        assert!(unsealed::<Some>(&bare, "it").unwrap_err().what.contains("no seal"));
    }
}
