//! As much of YAML as calibration programs write: nested keys, lists in brackets or by dashes, tags that are passed
//! over.

use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// A line that says something: its indentation and its text.
struct Line {
    indent: usize,
    text: String,
    number: usize,
}

/// Lines without comments and document marks; those of one list in brackets are joined.
fn lines(text: &str) -> Vec<Line> {
    let mut out: Vec<Line> = Vec::new();
    let mut open = 0i64;
    for (k, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let mark = line.starts_with('%') || line.trim() == "---" || line.trim() == "...";
        let body = line.split(" #").next().unwrap_or("").trim_end();
        if mark || body.trim().is_empty() || body.trim_start().starts_with('#') {
            continue;
        }
        let brackets = |c: char| body.matches(c).count() as i64;
        let more = brackets('[') - brackets(']') + brackets('{') - brackets('}');
        match out.last_mut().filter(|_| open > 0) {
            Some(last) => last.text += &format!(" {}", body.trim()),
            None => {
                let indent = body.len() - body.trim_start().len();
                out.push(Line { indent, text: body.trim().to_owned(), number: k + 1 });
            }
        }
        open += more;
    }
    out
}

/// The content of a file.
pub fn parse(text: &str) -> Result<Value> {
    let lines = lines(text);
    let (value, rest) = block(&lines, 0)?;
    match rest.first() {
        None => Ok(value),
        Some(l) => Err(strange(l)),
    }
}

fn strange(l: &Line) -> Fault {
    Fault::input(format!("line {} cannot be read: '{}'", l.number, l.text.chars().take(60).collect::<String>()))
        .cause("YAML with features that calibration files do not have, or a damaged file")
        .next("write the calibration again, as YAML, XML or JSON")
}

/// The lines of one block, at the indentation of its first one, and what follows it. `depth` keeps nested files finite.
fn block(lines: &[Line], depth: usize) -> Result<(Value, &[Line])> {
    const DEEPEST: usize = 30;
    let Some(first) = lines.first() else { return Ok((Value::Null, lines)) };
    if depth > DEEPEST {
        return Err(strange(first));
    }
    if first.text.starts_with("- ") || first.text == "-" {
        return list(lines, depth);
    }
    let indent = first.indent;
    let (mut map, mut rest) = (Map::new(), lines);
    while let Some(line) = rest.first().filter(|l| l.indent == indent && !l.text.starts_with("- ")) {
        let (key, value) = line.text.split_once(':').ok_or_else(|| strange(line))?;
        let value = untagged(value.trim());
        rest = &rest[1..];
        let read = if !value.is_empty() {
            flow(value).ok_or_else(|| strange(line))?
        } else if rest.first().is_some_and(|l| l.indent > indent || l.indent == indent && l.text.starts_with('-')) {
            let (inner, after) = block(rest, depth + 1)?;
            rest = after;
            inner
        } else {
            Value::Null
        };
        map.insert(key.trim().trim_matches(['"', '\'']).to_owned(), read);
    }
    Ok((Value::Object(map), rest))
}

fn list(lines: &[Line], depth: usize) -> Result<(Value, &[Line])> {
    let indent = lines[0].indent;
    let (mut items, mut rest) = (Vec::new(), lines);
    while let Some(line) = rest.first().filter(|l| l.indent == indent && l.text.starts_with('-')) {
        let item = untagged(line.text[1..].trim());
        rest = &rest[1..];
        if !item.is_empty() {
            items.push(flow(item).ok_or_else(|| strange(line))?);
            continue;
        }
        let (inner, after) =
            if rest.first().is_some_and(|l| l.indent > indent) { block(rest, depth + 1)? } else { (Value::Null, rest) };
        items.push(inner);
        rest = after;
    }
    Ok((Value::Array(items), rest))
}

/// Without a tag like `!!opencv-matrix`.
fn untagged(value: &str) -> &str {
    match value.strip_prefix('!') {
        Some(tag) => tag.split_once(' ').map_or("", |(_, rest)| rest.trim()),
        None => value,
    }
}

/// A value on one line: a scalar, or lists and maps in brackets.
fn flow(text: &str) -> Option<Value> {
    if !text.starts_with(['[', '{']) {
        return Some(scalar(text));
    }
    let mut at = text;
    let value = flow_value(&mut at, 0)?;
    at.trim().is_empty().then_some(value)
}

fn flow_value(at: &mut &str, depth: usize) -> Option<Value> {
    *at = at.trim_start();
    let close = match at.chars().next()? {
        '[' => ']',
        '{' => '}',
        _ => {
            let end = at.find([',', ']', '}']).unwrap_or(at.len());
            let (own, rest) = at.split_at(end);
            *at = rest;
            return Some(scalar(own.trim()));
        }
    };
    if depth > 8 {
        return None;
    }
    *at = &at[1..];
    let (mut items, mut map) = (Vec::new(), Map::new());
    loop {
        *at = at.trim_start();
        if let Some(rest) = at.strip_prefix(close) {
            *at = rest;
            return Some(if close == ']' { Value::Array(items) } else { Value::Object(map) });
        }
        if close == '}' {
            let (key, rest) = at.split_once(':')?;
            *at = rest;
            map.insert(key.trim().trim_matches(['"', '\'']).to_owned(), flow_value(at, depth + 1)?);
        } else {
            let before = at.len();
            items.push(flow_value(at, depth + 1)?);
            // A bracket of the other kind, or nothing before a comma: no item, and no end of the list either.
            if at.len() == before {
                return None;
            }
        }
        *at = at.trim_start();
        *at = at.strip_prefix(',').unwrap_or(at);
    }
}

/// A number where it is one (OpenCV writes `1.` and `.Nan`), else text.
pub fn scalar(text: &str) -> Value {
    let number = text.parse::<f64>().ok().filter(|n| n.is_finite()).and_then(serde_json::Number::from_f64);
    number.map_or_else(|| Value::String(text.trim_matches(['"', '\'']).to_owned()), Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn what_calibration_programs_write_is_read() {
        let text = "%YAML:1.0\n---\n# by hand\na: 3\nm: !!opencv-matrix\n   rows: 1\n   dt: d\n   data: [ 1., \
             -2.5e+01,\n       3. ]\nname: \"x y\"\n\
            cam0:\n  T:\n  - [1.0, 0.0]\n  - [0.0, 1.0]\n  empty: []\n  none:\nlist:\n- 1\n-\n  b: 2\n...\n";
        let wanted = json!({
            "a": 3.0, "m": { "rows": 1.0, "dt": "d", "data": [1.0, -25.0, 3.0] }, "name": "x y",
            "cam0": { "T": [[1.0, 0.0], [0.0, 1.0]], "empty": [], "none": null }, "list": [1.0, { "b": 2.0 }]
        });
        assert_eq!(parse(text).unwrap(), wanted);
        assert_eq!(parse("a: {b: 1, c: [2, 3]}").unwrap(), json!({ "a": { "b": 1.0, "c": [2.0, 3.0] } }));
        for bad in ["no key here", "a: [1, 2", "a: [1}", "a: [[}", "a: [,]", "a: {b: [1}}", "a: 1\n  b: 2"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
