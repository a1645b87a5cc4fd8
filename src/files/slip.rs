//! In: a text that a parser refused, and the position of the error. Out: the most likely typing error.
//! Frame and unit: none.

use crate::fault::{Fault, Result};

/// The likely typing error at a position (bytes from the start) of a TOML or JSON text; `other` if none is
/// recognised.
pub fn slip_at<'a>(text: &str, place: usize, other: &'a str) -> &'a str {
    let before = text.get(..place).unwrap_or(text);
    slip_in(text, before.matches('\n').count() + 1, other)
}

/// [`slip_at`] for a line number, counted from 1.
pub fn slip_in<'a>(text: &str, line: usize, other: &'a str) -> &'a str {
    text.lines().nth(line.saturating_sub(1)).and_then(slip).unwrap_or(other)
}

fn slip(line: &str) -> Option<&'static str> {
    let line = line.split('#').next().unwrap_or_default().trim();
    let (key, value) = match (line.split_once('='), line.split_once(':')) {
        (Some(parts), _) => parts,
        // JSON keys are quoted.
        (None, Some((key, _))) if !key.contains(['"', '{']) => return Some("a colon where TOML has ="),
        (None, Some(parts)) => parts,
        (None, None) => return None,
    };
    if key.contains(['[', '(']) {
        return None;
    }
    if line.ends_with(';') {
        return Some("a semicolon at the end of a line, where nothing is to stand");
    }
    let value = value.trim().trim_end_matches([',', '}']).trim().trim_matches(['"', '\'']);
    if let Some((whole, rest)) = value.split_once(',') {
        let digits = |t: &str| !t.is_empty() && t.chars().all(|c| c.is_ascii_digit());
        if digits(whole.trim_start_matches(['-', '+'])) && digits(rest) {
            return Some("a decimal comma: numbers are written with a point");
        }
    }
    let number = value.trim_end_matches(|c: char| c.is_alphabetic() || c.is_whitespace() || "°µ²".contains(c));
    let unit = value[number.len()..].trim();
    let is_unit = ["mm", "m", "um", "µm", "cm", "deg", "°", "rad", "px", "s", "nm", "inch"].contains(&unit);
    (is_unit && number.parse::<f64>().is_ok()).then_some("a unit beside a number: the key's name shows the unit")
}

/// Returns an error for a name that cannot be part of a file name, or that would break the line it is written into.
pub fn named(what: &str, name: &str) -> Result<()> {
    if !name.trim().is_empty()
        && name != "."
        && name != ".."
        && !name.contains(|c: char| c.is_control() || "/\\".contains(c))
    {
        return Ok(());
    }
    Err(Fault::input(format!("{what} is {name:?}; letters, digits, spaces and signs other than / and \\ make a name"))
        .cause("a path or a control character in a name: files and lines are called by it")
        .next("give it a plain name"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_are_named_and_nothing_else_is() {
        for (line, want) in [
            ("near_mm = 60,5", "decimal comma"),
            ("near_mm = '-60,5' # near", "decimal comma"),
            ("  \"offset_mm\": 72,5,", "decimal comma"),
            ("name = 'a';", "semicolon"),
            ("near_mm = 60.0 mm", "unit"),
            ("turn_deg = 30°", "unit"),
            ("name: cell", "colon"),
            ("at = [0,5]", "other"),
            ("near_mm = sixty", "other"),
            ("\"fx\": 305.8, \"fy\": 305.8", "other"),
            ("name = '1,2,3'", "other"),
            ("", "other"),
        ] {
            let text = format!("# one\n{line}\nlast = 1\n");
            assert!(slip_in(&text, 2, "other").contains(want), "{line}: {}", slip_in(&text, 2, "other"));
            assert_eq!(slip_at(&text, 7, "other"), slip_in(&text, 2, "other"));
        }
        assert_eq!(slip_at("ä", 1, "other"), "other");
    }

    #[test]
    fn names_lead_nowhere() {
        for bad in ["", " ", "..", "../a", "a/b", "a\\b", "a\nb", "\u{1b}[31m"] {
            assert!(named("name", bad).is_err(), "{bad:?}");
        }
        ["led", "LED 7x5 (rot)", "Stück 1,5"].iter().for_each(|good| named("name", good).unwrap());
    }
}
