//! The keys of a calibration file in YAML, XML or JSON.

use crate::fault::{Fault, Result};
use serde_json::{Map, Value};

/// The content of a file by its keys.
pub fn read(text: &str) -> Result<Value> {
    let text = text.trim_start_matches('\u{feff}');
    match text.trim_start().chars().next() {
        Some('<') => xml(text),
        Some('{') => crate::rig::json_once(text).map_err(|e| {
            Fault::input(format!("holds no JSON: {e}"))
                .cause(crate::files::slip_in(text, e.line(), "a truncated or edited file"))
                .next("write the calibration again")
        }),
        _ => crate::files::yaml(text),
    }
}

/// OpenCV's XML: elements within `opencv_storage`, numbers separated by blanks.
fn xml(text: &str) -> Result<Value> {
    let mut stack: Vec<(String, Map<String, Value>, String)> = vec![(String::new(), Map::new(), String::new())];
    let mut rest = text;
    let broken = |what: &str| {
        Fault::input(format!("is no whole XML: {what}"))
            .cause("a truncated or edited file")
            .next("write the calibration again, as YAML, XML or JSON")
    };
    const DEEPEST: usize = 30;
    while let Some(start) = rest.find('<') {
        stack.last_mut().expect("never empty").2 += &rest[..start];
        rest = &rest[start + 1..];
        if let Some(comment) = rest.strip_prefix("!--") {
            rest = comment.split_once("-->").ok_or_else(|| broken("a comment does not end"))?.1;
            continue;
        }
        let (tag, after) = rest.split_once('>').ok_or_else(|| broken("a tag does not end"))?;
        rest = after;
        if tag.starts_with(['?', '!']) {
            continue;
        }
        if let Some(name) = tag.strip_prefix('/') {
            let (own, map, content) = stack.pop().expect("never empty");
            if own != name.trim() || stack.is_empty() {
                return Err(broken(&format!("'{name}' ends, '{own}' is open")));
            }
            let value = if map.is_empty() { words(&content) } else { Value::Object(map) };
            // The items of a list are all called '_'.
            let twice = own != "_" && stack.last().is_some_and(|(_, map, _)| map.contains_key(&own));
            if twice {
                return Err(broken(&format!("'{own}' is there for the second time")));
            }
            stack.last_mut().expect("checked above").1.insert(own, value);
        } else if !tag.ends_with('/') {
            let name = tag.split_whitespace().next().unwrap_or("").to_owned();
            if stack.len() > DEEPEST {
                return Err(broken("too many elements in each other"));
            }
            stack.push((name, Map::new(), String::new()));
        }
    }
    match &mut stack[..] {
        [(_, map, _)] => Ok(map.remove("opencv_storage").unwrap_or_else(|| Value::Object(map.clone()))),
        _ => Err(broken("an element does not end")),
    }
}

/// One word is a scalar, several are a list.
fn words(text: &str) -> Value {
    let mut all: Vec<Value> = text.split_whitespace().map(crate::files::yaml_scalar).collect();
    if all.len() == 1 { all.remove(0) } else { Value::Array(all) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn opencvs_xml_is_read() {
        let text = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<!-- a <b> -->\n<w>640</w>\n<K \
             type_id=\"opencv-matrix\">\n  \
            <rows>1</rows>\n  <dt>d</dt>\n  <data>\n    1. 2.\n  -3e-01</data></K>\n</opencv_storage>\n";
        let wanted = json!({ "w": 640.0, "K": { "rows": 1.0, "dt": "d", "data": [1.0, 2.0, -0.3] } });
        assert_eq!(read(text).unwrap(), wanted);
        assert!(read("<a><_>1</_><_>2</_></a>").is_ok() && read("{\"a\": 1, \"a\": 2}").is_err());
        for bad in ["<a><b></a></b>", "<a>", "<a", "</a>", "<a><b>1</b><b>2</b></a>"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
