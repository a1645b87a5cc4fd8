//! Checks of the words that people read: line lengths, sentences, idioms, links, and the commands that documents show.

#[path = "docs/commands.rs"]
mod commands;
#[path = "docs/gates.rs"]
mod gates;
#[path = "docs/help.rs"]
mod help;
#[path = "docs/idioms.rs"]
mod idioms;
#[path = "docs/lines.rs"]
mod lines;
#[path = "docs/links.rs"]
mod links;
#[path = "docs/markdown.rs"]
mod markdown;
#[path = "docs/sentences.rs"]
mod sentences;

use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

/// Whether a file is a source of the library or of the program.
fn is_source(name: &str) -> bool {
    name.starts_with("src/") || name.starts_with("program/src/")
}

/// The repository's files with one of these endings, by their path from its root.
fn files(endings: &[&str]) -> Vec<(String, String)> {
    let mut open: Vec<PathBuf> = vec![root().to_owned()];
    let mut found = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder can be listed") {
            let entry = entry.expect("a folder can be listed");
            let path = entry.path();
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.file_type().expect("a file has a type").is_dir() {
                // Folders that a build, a demo or a person makes are not the repository's.
                let made = folder == root() && ["target", "demo", "demo-cell"].contains(&name.as_str());
                let made = made || name == "node_modules";
                if !name.starts_with('.') && !made {
                    open.push(path);
                }
            } else if path.extension().is_some_and(|e| endings.iter().any(|ending| e == *ending)) {
                let text = std::fs::read_to_string(&path).expect("a text is readable");
                let name = path.strip_prefix(root()).expect("below the root").to_string_lossy().into_owned();
                found.push((name, text));
            }
        }
    }
    found.sort();
    found
}

/// The documents: every Markdown file but records of the past, which are not rewritten: the log of changes and the
/// notes beside the figures of benchmark runs.
fn documents() -> Vec<(String, String)> {
    let record = |name: &str| name == "CHANGELOG.md" || name.starts_with("benches/runs/");
    files(&["md"]).into_iter().filter(|(name, _)| !record(name)).collect()
}

/// Fails where a count is above what is allowed, or where a file stands in the list for no reason.
fn ratchet(what: &str, counts: &[(String, usize)], allowed: &[(&str, usize)]) {
    let most = |name: &str| allowed.iter().find(|(n, _)| *n == name).map_or(0, |(_, most)| *most);
    let mut wrong: Vec<String> = Vec::new();
    for (name, count) in counts {
        let most = most(name);
        if *count > most {
            wrong.push(format!("{name}: {count} {what}, {most} are allowed"));
        }
    }
    for (name, most) in allowed {
        if counts.iter().find(|(n, _)| n == name).is_none_or(|(_, count)| *count == 0) {
            wrong.push(format!("{name}: no {what} any more: take its line with {most} out of the list"));
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}
