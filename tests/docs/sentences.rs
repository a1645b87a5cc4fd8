//! No sentence of a document is longer than 35 words.

use super::markdown::{Markdown, sentences, words};

const MOST: usize = 35;

#[test]
fn no_sentence_of_a_message_is_longer_than_35_words() {
    let mut long = Vec::new();
    for (name, text) in super::files(&["rs", "js"]).iter().filter(|(name, _)| super::is_source(name)) {
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
    let mut long = Vec::new();
    for (name, text) in super::documents() {
        for prose in Markdown::read(&text).prose {
            for sentence in sentences(&prose.text).iter().filter(|s| words(s) > MOST) {
                long.push(format!("{name}:{}: {} words: {sentence}", prose.line, words(sentence)));
            }
        }
    }
    assert!(long.is_empty(), "\n{}", long.join("\n"));
}
