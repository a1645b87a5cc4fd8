//! Tests that docs/robots.md states the numbers that the rules use.

use super::limits::{Limits, MOST_SPEED_MM_S};
use super::{clocks, gates, standing, tolerances, watch};

const DOCUMENT: &str = include_str!("../../../docs/robots.md");

/// The numbers in the second cell of the table's row that begins with `what`.
fn stated(what: &str) -> Vec<f64> {
    let row =
        DOCUMENT.lines().find(|l| l.starts_with(&format!("| {what} |"))).unwrap_or_else(|| panic!("no row {what}"));
    let cell = row.split('|').nth(2).expect("a second cell");
    cell.split(|c: char| !(c.is_ascii_digit() || c == '.'))
        .filter_map(|w| w.trim_end_matches('.').parse().ok())
        .collect()
}

#[test]
fn the_limits_of_the_example_are_the_usual_ones() {
    let (_, begin) = DOCUMENT.split_once("```toml\n").expect("an example");
    let (text, _) = begin.split_once("```").expect("the example ends");
    #[derive(serde::Deserialize)]
    struct Example {
        motion: Limits,
    }
    let example = toml::from_str::<Example>(text).expect("the example is read").motion;
    assert_eq!(Limits { keep_out: example.keep_out.clone(), ..Limits::within(example.workspace) }, example);
    assert!(text.contains(&format!("never above {MOST_SPEED_MM_S}")));
    let cited =
        format!("{MOST_SPEED_MM_S} mm/s is the speed that ISO 10218-1:2011, 5.6.2 allows the tool centre point");
    assert!(DOCUMENT.contains(&cited), "{cited}");
    for key in toml::Table::try_from(&example).expect("plain data").keys() {
        assert!(text.contains(key), "{key} is not in the example");
    }
}

#[test]
fn the_numbers_of_the_watch_are_those_of_the_document() {
    let ms = |d: std::time::Duration| d.as_secs_f64() * 1e3;
    let pair = |(a, b): (f64, f64)| vec![a, b];
    for (what, is) in [
        ("stop button and silence are checked every", vec![ms(watch::LOOK)]),
        ("speeds are averaged over at least", vec![watch::SPAN_S * 1e3]),
        ("a point is too fast above", pair(watch::SPEED_SLACK)),
        ("a turn is too fast above", pair(watch::TURN_SLACK)),
        ("the flange has left the workspace from", vec![watch::OUTSIDE_MM]),
        ("the controller's time runs at", pair(clocks::RATE)),
        ("rates are averaged over at least", vec![ms(clocks::RATE_SPAN)]),
        ("a leg begins within", vec![ms(standing::START)]),
        ("a pose has changed from", pair(tolerances::STILL)),
        ("a motion has arrived within", pair(tolerances::ARRIVED)),
        ("an arm was moved by others from", pair(tolerances::MOVED)),
        ("no leg is slower than", vec![gates::SLOWEST_MM_S]),
        ("speed of the fastest point; slowest speed", vec![MOST_SPEED_MM_S, gates::SLOWEST_MM_S]),
    ] {
        let stated = stated(what);
        let same = stated.len() == is.len() && stated.iter().zip(&is).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(same, "{what}: docs/robots.md states {stated:?}, it is {is:?}");
    }
}
