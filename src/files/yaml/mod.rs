//! In: the text of a YAML file. Out: its content as keys, lists and scalars.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use saphyr_parser::{Event, Parser, ScalarStyle};
use serde_json::{Map, Value};

/// Greatest depth of nesting; deeper files are refused, because later readers descend recursively.
const DEEPEST: usize = 30;

/// A list or map that has not ended yet; a map also holds the key whose value comes next.
enum Open {
    List(Vec<Value>),
    Map(Map<String, Value>, Option<String>),
}

/// The content of a file. Aliases are refused: with them a file of a few lines can expand to terabytes.
pub fn parse(text: &str) -> Result<Value> {
    // OpenCV begins its files with '%YAML:1.0', which differs from YAML's own directive '%YAML 1.0'.
    let text: String = text.lines().map(|l| if l.starts_with('%') { "\n".into() } else { format!("{l}\n") }).collect();
    let (mut open, mut whole) = (Vec::new(), None);
    for event in Parser::new_from_str(&text) {
        let (event, span) = event.map_err(|e| unread(e.marker().line(), e.info()))?;
        let line = span.start.line();
        let value = match event {
            Event::Scalar(text, ScalarStyle::Plain, ..) => scalar(&text),
            Event::Scalar(text, ..) => Value::String(text.into_owned()),
            Event::SequenceStart(..) | Event::MappingStart(..) if open.is_empty() && whole.is_some() => {
                return Err(second(line));
            }
            Event::SequenceStart(..) | Event::MappingStart(..) if open.len() == DEEPEST => {
                return Err(unread(line, &format!("more than {DEEPEST} lists and maps in each other")));
            }
            Event::SequenceStart(..) => {
                open.push(Open::List(Vec::new()));
                continue;
            }
            Event::MappingStart(..) => {
                open.push(Open::Map(Map::new(), None));
                continue;
            }
            Event::SequenceEnd | Event::MappingEnd => match open.pop() {
                Some(Open::List(items)) => Value::Array(items),
                Some(Open::Map(map, _)) => Value::Object(map),
                None => return Err(unread(line, "an end without a beginning")),
            },
            Event::Alias(_) => return Err(unread(line, "an alias")),
            _ => continue,
        };
        match open.last_mut() {
            Some(Open::List(items)) => items.push(value),
            Some(Open::Map(map, key)) => match (key.take(), value) {
                (None, Value::String(name)) => *key = Some(name),
                (None, other) => *key = Some(other.to_string()),
                (Some(name), _) if map.contains_key(&name) => {
                    return Err(unread(line, &format!("'{name}' for the second time")));
                }
                (Some(name), value) => {
                    map.insert(name, value);
                }
            },
            None if whole.is_none() => whole = Some(value),
            // `ros2 topic echo` ends each message with '---'.
            None if value.is_null() => {}
            None => return Err(second(line)),
        }
    }
    Ok(whole.unwrap_or(Value::Null))
}

fn second(line: usize) -> Fault {
    Fault::input(format!("line {line} begins a second document"))
        .cause("more than one message of ros2 topic echo, or files that were joined")
        .next("leave one of them in the file; with ROS: ros2 topic echo --once")
}

fn unread(line: usize, what: &str) -> Fault {
    Fault::input(format!("line {line} cannot be read: {what}"))
        .cause("YAML with features that calibration files do not have, or a damaged file")
        .next("write the calibration again, as YAML, XML or JSON")
}

/// A number if the text is one (OpenCV writes `1.` and `.Nan`), else text.
pub fn scalar(text: &str) -> Value {
    if matches!(text, "" | "~" | "null") {
        return Value::Null;
    }
    let number = text.parse::<f64>().ok().filter(|n| n.is_finite()).and_then(serde_json::Number::from_f64);
    number.map_or_else(|| Value::String(text.to_owned()), Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_calibration_programs_write_is_read() {
        let text = "%YAML:1.0\n---\n# by hand\na: 3\nm: !!opencv-matrix\n   rows: 1\n   dt: d\n   data: [ 1., \
             -2.5e+01,\n       3. ]\nname: \"x y\"\nnumber: \"7\"\n\
            cam0:\n  T:\n  - [1.0, 0.0]\n  - [0.0, 1.0]\n  empty: []\n  none:\nlist:\n- 1\n-\n  b: 2\n...\n";
        let wanted = json!({
            "a": 3.0, "m": { "rows": 1.0, "dt": "d", "data": [1.0, -25.0, 3.0] }, "name": "x y", "number": "7",
            "cam0": { "T": [[1.0, 0.0], [0.0, 1.0]], "empty": [], "none": null }, "list": [1.0, { "b": 2.0 }]
        });
        assert_eq!(parse(text).unwrap(), wanted);
        assert_eq!(parse("a: {b: 1, c: [2, 3]}").unwrap(), json!({ "a": { "b": 1.0, "c": [2.0, 3.0] } }));
    }

    #[test]
    fn what_would_be_read_wrongly_is_refused() {
        let deep = format!("a: {}{}", "[".repeat(40), "]".repeat(40));
        for (bad, says) in [
            ("a: [1, 2", "line"),
            ("a: [1}", "line 1"),
            ("a: [[}", "line 1"),
            ("a: 1\n  b: 2", "line 2"),
            ("a: &x [1]\nb: [*x, *x]", "an alias"),
            ("a: 1\na: 2", "'a' for the second time"),
            ("a: 1\n---\nb: 2\nc: 3\n", "begins a second document"),
            ("a: 1\n---\n7\n", "a second document"),
            (&deep, "more than 30"),
        ] {
            let said = parse(bad).unwrap_err().what;
            assert!(said.contains(says), "{bad}: {said}");
        }
    }
}
