//! Tests that docs/api.md and docs/operator.md state the numbers that the screen uses.

use crate::web::api::camera;
use crate::web::camera::FRESH;
use crate::web::guard::{IDLE, MOST_BODY};
use crate::web::motion::{HELD, LONGEST, SILENCE};
use sheetlight::capture::PIECES;
use sheetlight::station::LIT;
use std::time::Duration;

/// A time in the wording of these documents.
fn spoken(time: Duration) -> &'static str {
    match time.as_millis() {
        800 => "most of a second",
        1000 => "a second",
        1500 => "a second and a half",
        60_000 => "a minute",
        ms => panic!("no words for {ms} ms"),
    }
}

/// Fails if a document lacks one of these texts.
fn says(name: &str, document: &str, all: &[String]) {
    let text = document.split_whitespace().collect::<Vec<_>>().join(" ");
    all.iter().for_each(|says| assert!(text.contains(says), "{name} does not say: {says}"));
}

#[test]
fn the_api_is_described_with_the_numbers_that_it_keeps() {
    says(
        "docs/api.md",
        include_str!("../../../../../docs/api.md"),
        &[
            format!("It expires after {} s without a request", IDLE.as_secs()),
            format!("redeems it once, {} to {} s later", HELD.as_secs_f64(), LONGEST.as_secs_f64()),
            format!("at least once {}.", spoken(SILENCE)),
            format!("| 413 | longer than {} MiB |", MOST_BODY >> 20),
            format!("in {PIECES} pieces along it"),
            format!("at most {} ms before the request", FRESH / 1_000_000),
            format!("204 if none arrived within {}", spoken(camera::LONGEST)),
        ],
    );
    assert_eq!((MOST_BODY % (1 << 20), FRESH % 1_000_000), (0, 0));
}

#[test]
fn operators_are_told_the_numbers_that_the_screen_keeps() {
    says(
        "docs/operator.md",
        include_str!("../../../../../docs/operator.md"),
        &[
            format!("After {} without a touch it is released", spoken(IDLE)),
            format!("Hold the button for {}", spoken(HELD)),
            format!("a lost network, or {} of silence", spoken(SILENCE)),
            format!("each laser and the lamp on for {}", spoken(LIT)),
        ],
    );
}
