//! No sentence of a document is longer than 35 words.

use super::markdown::{Markdown, sentences, words};

const MOST: usize = 35;

/// Documents that still have longer sentences, with their number. The numbers may only fall.
const STILL_LONG: [(&str, usize); 0] = [];

#[test]
fn no_sentence_of_a_message_is_longer_than_35_words() {
    let mut long = Vec::new();
    for (name, text) in super::files(&["rs", "js"]).iter().filter(|(name, _)| name.starts_with("src/")) {
        for (line, text) in super::idioms::quoted(text) {
            for sentence in text.lines().flat_map(sentences).filter(|s| words(s) > MOST) {
                long.push(format!("{name}:{line}: {} words: {sentence}", words(&sentence)));
            }
        }
    }
    assert!(long.is_empty(), "\n{}", long.join("\n"));
}

#[test]
fn no_sentence_of_a_document_is_longer_than_35_words() {
    let mut counts = Vec::new();
    for (name, text) in super::documents() {
        let mut long = 0;
        for prose in Markdown::read(&text).prose {
            for sentence in sentences(&prose.text).iter().filter(|s| words(s) > MOST) {
                println!("{name}:{}: {} words: {sentence}", prose.line, words(sentence));
                long += 1;
            }
        }
        counts.push((name, long));
    }
    super::ratchet("sentences over 35 words", &counts, &STILL_LONG);
}
