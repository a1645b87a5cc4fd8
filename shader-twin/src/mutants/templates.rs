//! In: a text without comments. Out: the places of `<` and `>` that enclose template lists, by the algorithm of the
//! WGSL specification (Template List Discovery).

use std::collections::BTreeSet;

/// Places, in bytes, of the brackets of all template lists.
pub(super) fn template_brackets(text: &str) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    // Places of `<` that may open a list, with the number of parentheses open there.
    let mut pending: Vec<(usize, usize)> = Vec::new();
    let (mut at, mut nesting) = (0, 0usize);
    let bytes = text.as_bytes();
    let is = |at: usize, sign: u8| bytes.get(at) == Some(&sign);
    while let Some(c) = text[at..].chars().next() {
        if c.is_alphabetic() || c == '_' {
            at += text[at..].find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len() - at);
            at += text[at..].find(|c: char| !c.is_whitespace()).unwrap_or(0);
            if is(at, b'<') {
                // `<<` and `<=` open nothing.
                if is(at + 1, b'<') || is(at + 1, b'=') {
                    at += 1;
                } else {
                    pending.push((at, nesting));
                }
                at += 1;
            }
            continue;
        }
        match c {
            '>' => {
                if pending.last().is_some_and(|p| p.1 == nesting) {
                    found.extend([pending.pop().expect("it was just seen").0, at]);
                } else if is(at + 1, b'=') {
                    at += 1;
                }
            }
            '(' | '[' => nesting += 1,
            ')' | ']' => {
                while pending.pop_if(|p| p.1 >= nesting).is_some() {}
                nesting = nesting.saturating_sub(1);
            }
            '!' => at += usize::from(is(at + 1, b'=')),
            '=' if is(at + 1, b'=') => at += 1,
            '=' | ';' | '{' | ':' => {
                nesting = 0;
                pending.clear();
            }
            '&' | '|' if is(at + 1, c as u8) => {
                while pending.pop_if(|p| p.1 >= nesting).is_some() {}
                at += 1;
            }
            _ => {}
        }
        at += c.len_utf8();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The text with the brackets of lists as braces.
    fn shown(text: &str) -> String {
        let found = template_brackets(text);
        let bracket = |(i, c): (usize, char)| match (found.contains(&i), c) {
            (true, '<') => '{',
            (true, _) => '}',
            (false, c) => c,
        };
        text.char_indices().map(bracket).collect()
    }

    #[test]
    fn lists_are_distinguished_from_comparisons_and_shifts() {
        for (text, expected) in [
            ("var<storage, read_write> x: array<vec4<f32>>", "var{storage, read_write} x: array{vec4{f32}}"),
            ("array<u32, (a > b)>", "array{u32, (a > b)}"),
            ("if a < b && c > d", "if a < b && c > d"),
            ("f(a < b, c > d)", "f(a { b, c } d)"),
            ("a << 2 >= b >> 1", "a << 2 >= b >> 1"),
            ("for (var i = 0; i < n; i++) { x = i > 2; }", "for (var i = 0; i < n; i++) { x = i > 2; }"),
            ("let a = b[i < 3] > 2;", "let a = b[i < 3] > 2;"),
            ("a <= b, c >= d", "a <= b, c >= d"),
            ("vec2<f32>(1.0) != vec2<f32>(2.0)", "vec2{f32}(1.0) != vec2{f32}(2.0)"),
            ("array<u32,4>=x", "array{u32,4}=x"),
            ("a < b = c > d", "a < b = c > d"),
        ] {
            assert_eq!(shown(text), expected);
        }
    }
}
