//! In: the text of a station.toml, settings by their names with dots. Out: the same text with these settings changed: a person's comments,
//! order and blanks stay.
//! Frame and unit: as docs/file-formats.md says of each key.

use super::settings::Settings;
use crate::fault::{Fault, Result};
use serde_json::Value;
use std::collections::BTreeMap;

/// Changes settings; `null` takes one out.
///
/// # Errors
/// Names that are no setting, values that a station cannot have; the text is refused as a whole then.
pub fn edited(text: &str, changes: &BTreeMap<String, Value>) -> Result<String> {
    let wanted = changed(&Settings::parse(text)?, "", changes)?;
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (key, value) in changes {
        let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
        put(&mut lines, table, name, value);
    }
    let made = lines.join("\n") + "\n";
    // What cannot be changed line by line (inline tables, values over several lines) is written anew.
    if Settings::parse(&made).is_ok_and(|s| s == wanted) {
        return Ok(made);
    }
    Ok(toml::to_string(&wanted).expect("plain data"))
}

/// The settings themselves, changed and checked; names are those within a table, with dots (`below`: "" or "extraction").
///
/// # Errors
/// Names that are no setting, values that a station cannot have.
pub fn changed(settings: &Settings, below: &str, changes: &BTreeMap<String, Value>) -> Result<Settings> {
    let mut all = serde_json::to_value(settings).expect("plain data");
    for (key, value) in changes {
        let key = if below.is_empty() { key.clone() } else { format!("{below}.{key}") };
        let (table, name) = key.rsplit_once('.').unwrap_or(("", &key));
        let mut at = &mut all;
        for word in table.split('.').filter(|w| !w.is_empty()) {
            at = at.as_object_mut().expect("a table").entry(word).or_insert_with(|| Value::Object(Default::default()));
            if !at.is_object() {
                return Err(Fault::usage(format!("{key}: {word} is no table of settings")).next("correct the name"));
            }
        }
        let at = at.as_object_mut().expect("a table");
        if value.is_null() {
            at.remove(name)
        } else {
            at.insert(name.to_owned(), value.clone())
        };
    }
    // A table without its last setting is none.
    let all: serde_json::Map<String, Value> = match all {
        Value::Object(map) => map.into_iter().filter(|(_, v)| v.as_object().is_none_or(|o| !o.is_empty())).collect(),
        _ => Default::default(),
    };
    let changed: Settings = serde_json::from_value(Value::Object(all)).map_err(|e| {
        Fault::input(format!("the settings cannot be changed so: {e}"))
            .cause("a name that is none, a value of another kind, or a part of a table is missing")
            .next("compare it with docs/file-formats.md")
    })?;
    changed.check()?;
    Ok(changed)
}

/// Changes, adds or takes out one line.
fn put(lines: &mut Vec<String>, table: &str, name: &str, value: &Value) {
    let head = format!("[{table}]");
    let begin = if table.is_empty() { Some(0) } else { lines.iter().position(|l| bare(l) == head).map(|i| i + 1) };
    let begin = match begin {
        Some(i) => i,
        None if value.is_null() => return,
        None => {
            lines.extend([String::new(), head]);
            lines.len()
        }
    };
    let end = lines[begin..].iter().position(|l| l.trim_start().starts_with('[')).map_or(lines.len(), |n| begin + n);
    let is = |l: &String| l.trim_start().strip_prefix(name).is_some_and(|rest| rest.trim_start().starts_with('='));
    let old = lines[begin..end].iter().position(is).map(|n| begin + n);
    match (old, toml::Value::try_from(value)) {
        (Some(i), Ok(v)) if !value.is_null() => {
            let comment = comment(&lines[i]).map(|c| format!(" {c}")).unwrap_or_default();
            lines[i] = format!("{name} = {v}{comment}");
        }
        (Some(i), _) => drop(lines.remove(i)),
        (None, Ok(v)) if !value.is_null() => {
            // Behind the last line of its table that says something.
            let last = lines[begin..end].iter().rposition(|l| !bare(l).is_empty()).map_or(begin, |n| begin + n + 1);
            lines.insert(last, format!("{name} = {v}"));
        }
        _ => {}
    }
}

/// A line without its comment and blanks.
fn bare(line: &str) -> &str {
    line[..line.len() - comment(line).map_or(0, str::len)].trim()
}

/// The comment of a line: what stands behind a # outside of quotes.
fn comment(line: &str) -> Option<&str> {
    let mut quote = None;
    for (i, c) in line.char_indices() {
        match (quote, c) {
            (None, '#') => return Some(&line[i..]),
            (None, '"' | '\'') => quote = Some(c),
            (Some(q), c) if c == q => quote = None,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Convention;
    use serde_json::json;

    const TEXT: &str = "# cell 3, by the window\nname = \"cell # 3\" # as on its door\nrobot = \"denso\"\n\n[working_volume] # measured in May\nnear_mm = 60\nfar_mm = 320\n";

    fn changed(text: &str, key: &str, value: Value) -> Result<String> {
        edited(text, &BTreeMap::from([(key.to_owned(), value)]))
    }

    #[test]
    fn a_setting_changes_and_nothing_else() {
        assert_eq!(changed(TEXT, "robot", json!("ur")).unwrap(), TEXT.replace("\"denso\"", "\"ur\""));
        assert_eq!(changed(TEXT, "working_volume.far_mm", json!(400.5)).unwrap(), TEXT.replace("320", "400.5"));
        let named = changed(TEXT, "name", json!("cell 4")).unwrap();
        assert_eq!(named, TEXT.replace("\"cell # 3\"", "\"cell 4\""), "the comment stays");
        let more = changed(TEXT, "tolerance_mm", json!(0.05)).unwrap();
        assert!(more.contains("robot = \"denso\"\ntolerance_mm = 0.05\n\n[working_volume]"), "{more}");
        assert_eq!(changed(&more, "tolerance_mm", Value::Null).unwrap(), TEXT);
        let deeper = changed(TEXT, "extraction.threshold.minimum", json!(14)).unwrap();
        assert!(
            deeper.starts_with(TEXT) && Settings::parse(&deeper).unwrap().extraction.threshold.minimum == 14,
            "{deeper}"
        );
    }

    #[test]
    fn inline_tables_are_written_anew_and_mean_the_same() {
        let text = "working_volume = { near_mm = 60, far_mm = 320 }\nrobot = \"ur\"\n";
        let made = Settings::parse(&changed(text, "working_volume.near_mm", json!(80)).unwrap()).unwrap();
        assert_eq!((made.working_volume.unwrap().near_mm, made.robot), (80.0, Some(Convention::Ur)));
        let both = BTreeMap::from(["near_mm", "far_mm"].map(|k| (format!("working_volume.{k}"), Value::Null)));
        assert_eq!(Settings::parse(&edited(text, &both).unwrap()).unwrap().working_volume, None);
    }

    #[test]
    fn what_a_station_cannot_have_is_refused() {
        for (key, value) in [
            ("robbot", json!("ur")),
            ("robot", json!("no such make")),
            ("robot.name", json!("ur")),
            ("working_volume.near_mm", json!(500)),
            ("tolerance_mm", json!(0)),
            ("motion.speed_mm_s", json!(40)),
        ] {
            assert!(changed(TEXT, key, value).is_err(), "{key}");
        }
    }
}
