//! In: the text of a WGSL shader. Out: its tokens, and which of them are no arithmetic: attributes and template lists.
//!
//! naga keeps places of expressions, not of operators, and folds constants before it tells their places. So the text
//! is read here; naga judges each changed text.

use super::templates::template_brackets;
use std::ops::Range;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Word,
    Number,
    Sign,
}

/// A token of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Token {
    pub kind: Kind,
    pub at: Range<usize>,
    /// Part of an attribute, of a template list, or of a `const_assert`: a change there changes the declaration.
    pub fixed: bool,
}

/// Longest first.
const SIGNS: [&str; 23] = [
    "<<=", ">>=", "->", "++", "--", "+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<", ">>", "<=", ">=", "==", "!=",
    "&&", "||", "::", "=>",
];

/// The tokens of a text, comments left aside.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let clean = without_comments(text);
    let brackets = template_brackets(&clean);
    let mut all: Vec<Token> = Vec::new();
    let mut at = 0;
    let mut depth = 0usize;
    while let Some(c) = clean[at..].chars().next() {
        let rest = &clean[at..];
        if c.is_whitespace() {
            at += c.len_utf8();
            continue;
        }
        let template = brackets.contains(&at);
        let (kind, length) = if template {
            (Kind::Sign, 1)
        } else if c.is_ascii_digit() || (c == '.' && rest[1..].starts_with(|d: char| d.is_ascii_digit())) {
            (Kind::Number, number(rest))
        } else if c.is_alphanumeric() || c == '_' {
            (Kind::Word, rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len()))
        } else {
            (Kind::Sign, SIGNS.iter().find(|s| rest.starts_with(**s)).map_or(c.len_utf8(), |s| s.len()))
        };
        depth += usize::from(template && c == '<');
        all.push(Token { kind, at: at..at + length, fixed: depth > 0 });
        depth -= usize::from(template && c == '>');
        at += length;
    }
    fix_declarations(text, &mut all);
    all
}

/// The text with every comment replaced by as many blanks.
fn without_comments(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while !rest.is_empty() {
        let length = if rest.starts_with("//") {
            rest.find(['\n', '\r']).unwrap_or(rest.len())
        } else if rest.starts_with("/*") {
            block_comment(rest)
        } else {
            let next = rest.find('/').map_or(rest.len(), |at| at.max(1));
            out.push_str(&rest[..next]);
            rest = &rest[next..];
            continue;
        };
        // Bytes, so that places stay as they are.
        out.extend(rest[..length].bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }));
        rest = &rest[length..];
    }
    out
}

/// Length of a comment that may hold others.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0usize, 0);
    while at < text.len() {
        let rest = &text.as_bytes()[at..];
        if rest.starts_with(b"/*") {
            depth += 1;
            at += 2;
        } else if rest.starts_with(b"*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    text.len()
}

/// Length of the number at the text's begin: decimal or hexadecimal, with point, exponent and suffix.
fn number(text: &str) -> usize {
    let hex = text.starts_with("0x") || text.starts_with("0X");
    let mut before = ' ';
    let within = |c: char| {
        let exponent = if hex { matches!(before, 'p' | 'P') } else { matches!(before, 'e' | 'E') };
        let good = c.is_ascii_alphanumeric() || c == '.' || (exponent && matches!(c, '+' | '-'));
        before = c;
        good
    };
    text.chars()
        .take_while({
            let mut within = within;
            move |c| within(*c)
        })
        .count()
}

/// Marks attributes and `const_assert`.
fn fix_declarations(text: &str, all: &mut [Token]) {
    let mut i = 0;
    while i < all.len() {
        let word = &text[all[i].at.clone()];
        let end = match word {
            "@" => attribute_end(text, all, i),
            "const_assert" => (i..all.len()).find(|&j| &text[all[j].at.clone()] == ";").unwrap_or(all.len()),
            _ => {
                i += 1;
                continue;
            }
        };
        all[i..end].iter_mut().for_each(|t| t.fixed = true);
        i = end.max(i + 1);
    }
}

/// Behind an attribute's name and its parentheses.
fn attribute_end(text: &str, all: &[Token], from: usize) -> usize {
    let is = |i: usize, sign: &str| all.get(i).is_some_and(|t: &Token| &text[t.at.clone()] == sign);
    if !is(from + 2, "(") {
        return (from + 2).min(all.len());
    }
    let mut depth = 0;
    for i in from + 2..all.len() {
        depth += i32::from(is(i, "(")) - i32::from(is(i, ")"));
        if depth == 0 {
            return i + 1;
        }
    }
    all.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Vec<(&str, bool)> {
        tokens(text).into_iter().map(|t| (&text[t.at], t.fixed)).collect()
    }

    fn free(text: &str) -> Vec<&str> {
        read(text).into_iter().filter(|(_, fixed)| !fixed).map(|(t, _)| t).collect()
    }

    #[test]
    fn numbers_are_whole_tokens() {
        let text = "1u 0x1Fu 1.5e-3f .5 2.f 0x1p-4 7-3 v.x 1e3+2";
        let numbers: Vec<_> =
            tokens(text).into_iter().filter(|t| t.kind == Kind::Number).map(|t| &text[t.at]).collect();
        assert_eq!(numbers, ["1u", "0x1Fu", "1.5e-3f", ".5", "2.f", "0x1p-4", "7", "3", "1e3", "2"]);
    }

    #[test]
    fn comments_are_left_aside_and_places_stay() {
        assert_eq!(free("a // b < c ö\n/* d /* e */ f */ < g"), ["a", "<", "g"]);
        let all = tokens("/* ö */ x");
        assert_eq!(all[0].at, 9..10);
    }

    #[test]
    fn attributes_templates_and_assertions_are_fixed() {
        assert_eq!(free("@workgroup_size(64, (1 + 1)) fn f()"), ["fn", "f", "(", ")"]);
        assert_eq!(free("@compute fn f()"), ["fn", "f", "(", ")"]);
        assert_eq!(free("array<vec2<u32>, 4>(a)"), ["array", "(", "a", ")"]);
        assert_eq!(free("a < b && c > d"), ["a", "<", "b", "&&", "c", ">", "d"]);
        assert_eq!(free("const_assert A < 3; x >>= 1u"), [";", "x", ">>=", "1u"]);
    }
}
