//! In: the text of a shader. Out: every change of one operator, constant or built-in function that is tried.

use super::tokens::{Kind, Token, tokens};
use std::ops::Range;

/// A change of the text: these bytes become that.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Change {
    pub at: Range<usize>,
    pub now: String,
}

impl Change {
    pub(super) fn apply(&self, text: &str) -> String {
        format!("{}{}{}", &text[..self.at.start], self.now, &text[self.at.end..])
    }
}

/// Between two values.
const BINARY: [(&str, &[&str]); 29] = [
    ("+", &["-"]),
    ("-", &["+"]),
    ("*", &["/"]),
    ("/", &["*"]),
    ("%", &["/"]),
    ("<", &["<=", ">="]),
    ("<=", &["<", ">"]),
    (">", &[">=", "<="]),
    (">=", &[">", "<"]),
    ("==", &["!="]),
    ("!=", &["=="]),
    ("&&", &["||"]),
    ("||", &["&&"]),
    ("&", &["|"]),
    ("|", &["&"]),
    ("^", &["|"]),
    ("<<", &[">>"]),
    (">>", &["<<"]),
    ("+=", &["-="]),
    ("-=", &["+="]),
    ("*=", &["/="]),
    ("/=", &["*="]),
    ("%=", &["/="]),
    ("&=", &["|="]),
    ("|=", &["&="]),
    ("^=", &["|="]),
    ("<<=", &[">>="]),
    (">>=", &["<<="]),
    ("++", &["--"]),
];

/// Words of the text: literals and built-in functions with an opposite.
const WORDS: [(&str, &str); 6] =
    [("true", "false"), ("false", "true"), ("min", "max"), ("max", "min"), ("floor", "ceil"), ("ceil", "floor")];

/// Every change, in the order of the text.
pub(super) fn changes(text: &str) -> Vec<Change> {
    let all = tokens(text);
    let word = |i: usize| all.get(i).map_or("", |t| &text[t.at.clone()]);
    let mut found = Vec::new();
    for (i, token) in all.iter().enumerate().filter(|(_, t)| !t.fixed) {
        let here = word(i);
        let mut add = |now: String| found.push(Change { at: token.at.clone(), now });
        match token.kind {
            Kind::Number => numbers(here).into_iter().for_each(add),
            Kind::Word => {
                // `min` and its like are built-in functions only where they are called.
                let called = word(i + 1) == "(" || matches!(here, "true" | "false");
                WORDS.iter().filter(|w| w.0 == here && called).for_each(|w| add(w.1.into()));
            }
            Kind::Sign if ["!", "~", "-"].contains(&here) && !ends_a_value(text, i.checked_sub(1).map(|b| &all[b])) => {
                add(String::new());
            }
            // `&x` and `*p` are no arithmetic.
            Kind::Sign if ["&", "*"].contains(&here) && !ends_a_value(text, i.checked_sub(1).map(|b| &all[b])) => {}
            Kind::Sign if here == "--" => add("++".into()),
            Kind::Sign => {
                let others = BINARY.iter().find(|b| b.0 == here).map_or(&[][..], |b| b.1);
                others.iter().for_each(|now| add((*now).into()));
            }
        }
    }
    found
}

/// Whether an operator behind this token stands between two values.
fn ends_a_value(text: &str, before: Option<&Token>) -> bool {
    let Some(token) = before else { return false };
    match (token.kind, &text[token.at.clone()]) {
        (Kind::Number, _) => true,
        (Kind::Word, word) => !["return", "if", "while", "switch", "case", "else"].contains(&word),
        (Kind::Sign, sign) => [")", "]"].contains(&sign),
    }
}

/// A whole number becomes one more and one less, zero only one more. A number with a fraction becomes twice and half
/// of itself, zero becomes one.
fn numbers(text: &str) -> Vec<String> {
    let hex = text.starts_with("0x") || text.starts_with("0X");
    let suffix = if hex { text.trim_end_matches(['u', 'i']) } else { text.trim_end_matches(['u', 'i', 'f', 'h']) };
    let (digits, suffix) = (suffix, &text[suffix.len()..]);
    let whole = if hex { u64::from_str_radix(&digits[2..], 16).ok() } else { digits.parse().ok() };
    if let Some(n) = whole.filter(|_| !["f", "h"].contains(&suffix)) {
        let near = [n.checked_add(1), n.checked_sub(1)];
        return near.into_iter().flatten().map(|n| format!("{n}{suffix}")).collect();
    }
    let Ok(value) = digits.parse::<f64>() else {
        // A hexadecimal fraction: rare, and every change of its digits would be another rule.
        return Vec::new();
    };
    let near = if value == 0.0 { vec![1.0] } else { vec![2.0 * value, 0.5 * value] };
    near.into_iter().filter(|v| v.is_finite() && *v != value).map(|v| format!("{v:?}{suffix}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(text: &str) -> Vec<String> {
        changes(text).iter().map(|c| c.apply(text)).collect()
    }

    #[test]
    fn every_operator_is_changed_and_signs_that_are_no_arithmetic_are_not() {
        assert_eq!(changed("a = b + c;"), ["a = b - c;"]);
        assert_eq!(changed("x = a < b;"), ["x = a <= b;", "x = a >= b;"]);
        assert_eq!(changed("return -x;"), ["return x;"]);
        assert_eq!(changed("a = (b) - !c;"), ["a = (b) + !c;", "a = (b) - c;"]);
        assert_eq!(changed("f(&x, *p);"), [""; 0]);
        assert_eq!(changed("i--;"), ["i++;"]);
        assert_eq!(changed("fn f(a: array<u32, 4>) -> u32"), [""; 0]);
        assert_eq!(changed("@group(0) @binding(1) var<storage> min: u32;"), [""; 0]);
        assert_eq!(changed("a = min(b, c) & d;"), ["a = max(b, c) & d;", "a = min(b, c) | d;"]);
        assert_eq!(changed("x <<= y;"), ["x >>= y;"]);
    }

    #[test]
    fn every_number_is_changed_in_its_own_form() {
        assert_eq!(numbers("0"), ["1"]);
        assert_eq!(numbers("7u"), ["8u", "6u"]);
        assert_eq!(numbers("0xffu"), ["256u", "254u"]);
        assert_eq!(numbers("1.5"), ["3.0", "0.75"]);
        assert_eq!(numbers("2f"), ["4.0f", "1.0f"]);
        assert_eq!(numbers("0.0f"), ["1.0f"]);
        assert_eq!(numbers("1e-3"), ["0.002", "0.0005"]);
        assert_eq!(numbers("0x1p4"), [""; 0]);
    }

    #[test]
    fn every_operator_has_an_opposite_in_the_table_or_is_one() {
        for (sign, others) in BINARY {
            assert!(!others.contains(&sign), "{sign}");
            assert!(others.iter().all(|o| *o == "--" || BINARY.iter().any(|b| b.0 == *o)), "{sign}");
        }
    }
}
