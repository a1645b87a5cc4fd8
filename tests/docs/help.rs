//! The help of every command fits a screen and uses ordinary sentences.

use super::markdown::{sentences, words};
use std::process::Command;

/// Lines that a terminal window of usual height shows.
const SCREEN: usize = 48;

fn help(command: &str) -> String {
    let mut program = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
    let done = program.args(command.split_whitespace()).arg("--help").output().expect("the program runs");
    assert!(done.status.success(), "{command} --help: {}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).expect("help is text")
}

/// What `sheetlight help COMMAND` prints: all options, and what the command does in more words.
fn long(command: &str) -> String {
    let done = Command::new(env!("CARGO_BIN_EXE_sheetlight")).arg("help").args(command.split_whitespace()).output();
    String::from_utf8(done.expect("the program runs").stdout).expect("help is text")
}

/// The commands that a help lists: lines with a name two blanks in, under a heading.
fn listed(help: &str) -> Vec<String> {
    let mut all = Vec::new();
    let mut within = false;
    for line in help.lines() {
        if !line.starts_with(' ') {
            within = line.ends_with("ommands:");
        } else if within && line.starts_with("  ") && !line.starts_with("   ") {
            all.extend(line.split_whitespace().next().filter(|w| *w != "help").map(str::to_owned));
        }
    }
    all
}

/// Every command with its help, those below others included.
fn commands() -> Vec<(String, String)> {
    let mut open = listed(&help(""));
    assert!(open.len() >= 29, "{open:?}");
    let mut all = vec![(String::new(), help(""))];
    while let Some(command) = open.pop() {
        let text = help(&command);
        open.extend(listed(&text).into_iter().map(|below| format!("{command} {below}")));
        all.push((command, text));
    }
    all
}

#[test]
fn every_help_fits_a_screen_and_reads_well() {
    let mut wrong = Vec::new();
    for (command, text) in commands() {
        let lines = text.lines().count();
        if lines > SCREEN {
            wrong.push(format!("{command} --help: {lines} lines, a screen has {SCREEN}"));
        }
        let whole = format!("{text}\n{}", long(&command));
        wrong.extend(super::idioms::found(&whole).iter().map(|hit| format!("{command} --help: {hit}")));
        let prose = whole.split("\n\n").filter(|part| !part.contains("\n  ") && !part.starts_with("Usage:"));
        for sentence in prose.flat_map(sentences).filter(|s| words(s) > 35) {
            wrong.push(format!("{command} --help: {} words: {sentence}", words(&sentence)));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
