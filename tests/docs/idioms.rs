//! Turns of phrase that a stranger has to decode are not used; the list says what to write instead.

use super::markdown::Markdown;

/// The phrase and what to write for it. A phrase is whole words, in any case of letters.
const BANNED: [(&str, &str); 38] = [
    ("so many", "a number, or `this many`"),
    ("for how much", "what the amount is for"),
    ("of one's own", "its own"),
    ("of its own accord", "automatically"),
    ("by itself as", "automatically"),
    ("to be had", "available"),
    ("is none", "there is no ..., or invalid"),
    ("are none", "there are no ..."),
    ("is no name", "invalid name"),
    ("is no station", "not a station"),
    ("is no kind", "unknown"),
    ("is told", "is reported, is set"),
    ("are told", "are reported, are set"),
    ("told apart", "distinguished"),
    ("is said", "is reported"),
    ("are said", "are reported"),
    ("said so", "stated"),
    ("left out", "excluded"),
    ("leave out", "exclude"),
    ("leaves out", "excludes"),
    ("fate", "rejection reason"),
    ("fates", "rejection reasons"),
    ("bears", "tolerates"),
    ("to and fro", "back and forth"),
    ("by now", "since then, already"),
    ("of a former", "of an earlier"),
    ("the former", "the earlier, the previous"),
    ("other ones", "different"),
    ("of no concern", "ignored"),
    ("nearer than so", "closer than N"),
    ("passed over", "skipped"),
    ("departure from a rotation", "orthonormality error"),
    ("put right", "corrected"),
    ("comes to the same", "gives the same result"),
    ("come to the same", "give the same result"),
    ("the whole of", "all of"),
    ("wants a", "needs a"),
    ("what is not known of", "the uncertainty of"),
];

/// The lower-case words of a text, with one blank on either side of each.
fn spaced(text: &str) -> String {
    let letters = |c: char| if c.is_alphanumeric() || matches!(c, '\'' | '_' | '-' | '=') { c } else { ' ' };
    let words: String = text.to_lowercase().chars().map(letters).collect();
    format!(" {} ", words.split_whitespace().collect::<Vec<_>>().join(" "))
}

/// The banned phrases in a text, with what to write instead.
pub fn found(text: &str) -> Vec<String> {
    let text = spaced(text);
    let hits = BANNED.iter().filter(|(phrase, _)| text.contains(&format!(" {phrase} ")));
    hits.map(|(phrase, instead)| format!("'{phrase}': write {instead}")).collect()
}

/// The texts in double quotes of a source, its own tests and comments left aside.
pub fn quoted(source: &str) -> Vec<(usize, String)> {
    let own = source.split("#[cfg(test)]\nmod ").next().unwrap_or("");
    let mut all = Vec::new();
    let (mut open, mut line, mut before) = (None::<(usize, String)>, 1, ' ');
    let mut chars = own.chars().peekable();
    while let Some(c) = chars.next() {
        line += usize::from(c == '\n');
        match &mut open {
            Some((_, text)) if c == '\\' => {
                match chars.next() {
                    // A string that goes on in the next line begins there at its first letter.
                    Some('\n') => {
                        line += 1;
                        while chars.next_if(|c| *c == ' ').is_some() {}
                    }
                    Some('n') => text.push('\n'),
                    _ => text.push(' '),
                }
            }
            Some(_) if c == '"' => all.extend(open.take()),
            // What stands in braces is a name, not a word.
            Some((_, text)) if c == '{' => {
                while chars.next_if(|c| *c != '}' && *c != '"').is_some() {}
                text.push('_');
            }
            Some((_, text)) => text.push(c),
            None if c == '/' && before == '/' => while chars.next_if(|c| *c != '\n').is_some() {},
            // The character '"' opens no text.
            None if c == '"' && before == '\'' && chars.peek() == Some(&'\'') => {}
            None if c == '"' => open = Some((line, String::new())),
            None => {}
        }
        before = c;
    }
    all
}

#[test]
fn documents_use_no_banned_idiom() {
    let mut wrong = Vec::new();
    for (name, text) in super::documents() {
        for prose in Markdown::read(&text).prose {
            wrong.extend(found(&prose.text).iter().map(|hit| format!("{name}:{}: {hit}", prose.line)));
        }
    }
    assert!(wrong.is_empty(), "{} hits\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn messages_and_pages_use_no_banned_idiom() {
    let mut wrong = Vec::new();
    for (name, text) in super::files(&["rs", "js"]).iter().filter(|(name, _)| super::is_source(name)) {
        for (line, text) in quoted(text).iter().filter(|(_, text)| text.contains(' ')) {
            wrong.extend(found(text).iter().map(|hit| format!("{name}:{line}: {hit}: {text}")));
        }
    }
    assert!(wrong.is_empty(), "{} hits\n{}", wrong.len(), wrong.join("\n"));
}

/// Messages stand in the first cells of these tables as code; `...` stands for what differs.
#[test]
fn the_messages_that_documents_explain_exist() {
    let source: Vec<String> = super::files(&["rs"])
        .iter()
        .filter(|(name, _)| super::is_source(name))
        .flat_map(|(_, text)| quoted(text))
        .map(|(_, text)| text)
        .collect();
    let (mut count, mut unknown) = (0, Vec::new());
    for (name, text) in super::documents().iter().filter(|(n, _)| n.ends_with("troubleshooting.md")) {
        for (n, line) in text.lines().enumerate().filter(|(_, l)| l.starts_with("| `")) {
            let cell = line.split('|').nth(1).unwrap_or("");
            for message in cell.split('`').skip(1).step_by(2) {
                count += 1;
                if !source.iter().any(|text| text.contains(message)) {
                    unknown.push(format!("{name}:{}: no message has the words '{message}'", n + 1));
                }
            }
        }
    }
    assert!(unknown.is_empty(), "\n{}", unknown.join("\n"));
    assert!(count > 40, "{count} messages");
}

#[test]
fn a_banned_idiom_is_seen_in_any_case_and_over_lines() {
    assert_eq!(found("Left\n  OUT, for once").len(), 1);
    assert_eq!(found("a fateful day by nowhere"), Vec::<String>::new());
    let source = "let a = \"one \\\n  two\"; // \"three four\"\nlet c = '\"'; let b = \"five six\";\n";
    assert_eq!(quoted(source), [(1, "one two".to_owned()), (3, "five six".to_owned())]);
}
