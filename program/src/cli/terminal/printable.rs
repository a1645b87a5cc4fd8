//! In: text that may contain names from foreign files. Out: the same text, without the power to control a terminal.
//! Frame and unit: none.

use std::borrow::Cow;

/// Whether a character controls a terminal or changes the order of letters: control characters except line feed and
/// tab (ECMA-48: C0, DEL, C1), and direction marks (Unicode UAX 9), which can disguise a name.
fn steers(c: char) -> bool {
    (c.is_control() && c != '\n' && c != '\t')
        || matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Replaces such characters with their escapes, `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    replaced(text, |c| c.escape_unicode().to_string())
}

/// The same for JSON, where only strings can contain such characters. They become JSON escapes, so that the value
/// does not change.
pub fn printable_json(text: &str) -> Cow<'_, str> {
    replaced(text, |c| format!("\\u{:04x}", u32::from(c)))
}

fn replaced(text: &str, by: impl Fn(char) -> String) -> Cow<'_, str> {
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let one = |c: char| if steers(c) { by(c) } else { c.to_string() };
    Cow::Owned(text.chars().map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_steers_the_terminal_and_json_keeps_its_value() {
        let name = "a\u{1b}]0;title\u{7}\u{9b}31m\u{7f}\u{202e}gnp.\r\u{85}ä°\tb\nc";
        let shown = printable(name);
        assert!(!shown.contains(steers), "{shown}");
        assert!(shown.starts_with("a\\u{1b}]0;title\\u{7}\\u{9b}31m") && shown.ends_with("ä°\tb\nc"), "{shown}");
        let text = serde_json::to_string_pretty(&[name]).unwrap();
        let json = printable_json(&text);
        assert!(!json.contains(steers));
        assert_eq!(serde_json::from_str::<[String; 1]>(&json).unwrap()[0], name);
        assert!(matches!(printable("plain äöü°µ"), Cow::Borrowed(_)));
    }
}
