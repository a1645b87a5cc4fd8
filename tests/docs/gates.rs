//! In: the conditions that the sources name, the screen's table of them, the bits of a PLC's registers. Out: a failure
//! where a name has no text or no bit, a text is empty in one of the four languages, or a text or bit belongs to no
//! condition. Frame and unit: none.

use std::collections::BTreeSet;

const CALLS: [&str; 3] = ["least(\"", "most(\"", "must(\""];
/// Names that are not written in a call.
const OTHERS: [&str; 3] = ["number of looks", "points that tell the turn", "turn told"];

fn in_sources(folder: &str) -> BTreeSet<String> {
    let mut names: BTreeSet<String> = OTHERS.map(str::to_owned).into();
    for (name, text) in super::files(&["rs"]) {
        // Files of conditions only: other functions are called `most` as well.
        if !name.starts_with(folder) || !text.contains("Gate::") || name == "src/fault/gate.rs" {
            continue;
        }
        let code = text.split("#[cfg(test)]").next().expect("there is a first part");
        for call in CALLS {
            let calls = code.match_indices(call).map(|(at, _)| &code[at + call.len()..]);
            names.extend(calls.map(|rest| rest[..rest.find('"').expect("the name ends")].to_owned()));
        }
    }
    names
}

/// Rows of the table: a name and its texts.
fn in_table() -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(super::root().join("program/src/web/pages/base/texts.js")).unwrap();
    let table = text.split("export const GATES = {").nth(1).expect("the table");
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut inside = false;
    for line in table.lines() {
        // A name begins a row, in quotes or without; its texts follow up to the bracket.
        if !inside {
            let Some((name, rest)) = line.split_once(": [") else { continue };
            rows.push(vec![name.trim().trim_matches('"').to_owned()]);
            inside = !rest.contains(']');
            rows.last_mut().expect("a row").extend(quoted(rest));
        } else {
            inside = !line.contains(']');
            rows.last_mut().expect("a row").extend(quoted(line));
        }
    }
    rows
}

fn quoted(text: &str) -> Vec<String> {
    text.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
fn every_condition_has_a_text_in_four_languages() {
    let (sources, table) = (in_sources("src/"), in_table());
    assert!(sources.len() > 35, "{sources:?}");
    let names: BTreeSet<String> = table.iter().map(|row| row[0].clone()).collect();
    let without: Vec<_> = sources.difference(&names).collect();
    assert!(without.is_empty(), "program/src/web/pages/base/texts.js has no text for {without:?}");
    let unused: Vec<_> = names.difference(&sources).collect();
    assert!(unused.is_empty(), "no condition is called {unused:?}");
    for row in table {
        assert!(row.len() == 5 && row.iter().all(|text| !text.trim().is_empty()), "{row:?}");
    }
}

#[test]
fn every_condition_of_a_part_has_its_bit() {
    let bits = sheetlight::station::socket::GATES;
    let named: BTreeSet<String> = bits.map(str::to_owned).into();
    assert_eq!(named, in_sources("src/find/"), "src/station/socket/table.rs has the bits");
    let text = std::fs::read_to_string(super::root().join("docs/connections.md")).unwrap();
    for (bit, name) in bits.iter().enumerate() {
        // The unit of a name is left out.
        let row = format!("| {bit} | {} |", name.split(", ").next().expect("a name"));
        assert!(text.contains(&row), "docs/connections.md does not list '{row}'");
    }
}
