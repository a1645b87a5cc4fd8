//! In: the sources. Out: a failure for every fault that is made without a next step.
//! Frame and unit: none.

use std::path::{Path, PathBuf};

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        if entry.is_dir() {
            sources(&entry, out);
        } else if entry.extension().is_some_and(|e| e == "rs") {
            out.push(entry);
        }
    }
}

/// The sources of the library and of the program.
fn all_sources() -> Vec<PathBuf> {
    let program = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&program.join("../src"), &mut files);
    sources(&program.join("src"), &mut files);
    files
}

/// Where the bracket that stands first in `text` is closed; what stands in quotes does not count.
fn closed(text: &str) -> usize {
    let (mut depth, mut quoted, mut escaped) = (0, false, false);
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' if quoted => escaped = true,
            '"' => quoted = !quoted,
            _ if quoted => {}
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => {
                depth -= 1;
                if depth == 0 {
                    return at + 1;
                }
            }
            _ => {}
        }
    }
    text.len()
}

/// The first line of each fault in a source whose chain of calls has no `next`.
fn without_next(text: &str) -> Vec<String> {
    let code = text.find("#[cfg(test)]\nmod").map_or(text, |at| &text[..at]);
    let mut out = Vec::new();
    for made in ["Fault::input(", "Fault::usage(", "Fault::refused(", "Fault::output(", "Fault::device(", "Fault::new("]
    {
        for (at, _) in code.match_indices(made) {
            let mut rest = &code[at + made.len() - 1..];
            let mut found = false;
            loop {
                rest = &rest[closed(rest)..];
                let Some(call) = rest.trim_start().strip_prefix('.') else { break };
                let Some(open) = call.find('(') else { break };
                found |= &call[..open] == "next";
                rest = &call[open..];
            }
            if !found {
                let line = code[..at].matches('\n').count() + 1;
                out.push(format!("{line}: {}", code[at..].lines().next().unwrap_or_default()));
            }
        }
    }
    out
}

/// Whether a source is a module of tests as a whole.
fn only_tested(file: &Path) -> bool {
    let name = file.file_stem().unwrap().to_string_lossy();
    let above = std::fs::read_to_string(file.with_file_name("mod.rs")).unwrap_or_default();
    name.ends_with("tests") || above.contains(&format!("#[cfg(test)]\nmod {name};"))
}

/// Lines of a source, its tests and comments aside, that call one of `names`.
fn calling<'a>(text: &'a str, names: &'a [&'a str]) -> impl Iterator<Item = String> + 'a {
    let code = text.find("#[cfg(test)]\nmod").map_or(text, |at| &text[..at]);
    let lines = (1..)
        .zip(code.lines())
        .filter(|(_, l)| !l.trim_start().starts_with("//") && names.iter().any(|n| l.contains(n)))
        .filter(|(_, l)| !l.contains("/proc/") && !l.contains("schedstat"));
    lines.map(|(n, l)| format!("{n}: {}", l.trim()))
}

/// What others wrote is read within limits and never from a pipe, what is written can be stopped at any moment, where
/// no thread can be had that is said, and what is printed goes to outputs that may be closed or full.
#[test]
fn files_threads_and_outputs_are_had_in_one_way() {
    let around = [
        "fs::read(",
        "fs::read_to_string(",
        "fs::write(",
        "create_dir_all(",
        "thread::spawn(",
        ".spawn(|",
        "println!(",
    ];
    let files = all_sources();
    let outside = files.iter().filter(|f| !f.components().any(|c| c.as_os_str() == "files"));
    let wrong: Vec<String> = outside
        .flat_map(|file| {
            let text = std::fs::read_to_string(file).unwrap();
            let text = if only_tested(file) { String::new() } else { text };
            calling(&text, &around).map(|line| format!("{}:{line}", file.display())).collect::<Vec<_>>()
        })
        .collect();
    assert!(wrong.is_empty(), "go through crate::files, std::thread::Builder or the console:\n{}", wrong.join("\n"));
    assert_eq!(
        calling("a\nlet t = std::fs::read(&path);", &around).next().unwrap(),
        "2: let t = std::fs::read(&path);"
    );
}

#[test]
fn every_fault_has_a_next_step() {
    assert_eq!(without_next("Fault::input(format!(\"a) {x}\")).cause(\"b\")").len(), 1);
    assert_eq!(without_next("Fault::input(format!(\"a) {x}\"))\n    .cause(\"b\")\n    .next(\"c\")").len(), 0);
    let files = all_sources();
    let (mut wrong, mut seen) = (Vec::new(), 0);
    for file in files.iter().filter(|f| !f.ends_with("fault/mod.rs") && !only_tested(f)) {
        let text = std::fs::read_to_string(file).unwrap();
        seen += text.matches("Fault::").count();
        wrong.extend(without_next(&text).into_iter().map(|line| format!("{}:{line}", file.display())));
    }
    assert!(seen > 300, "{seen} faults were found");
    assert!(wrong.is_empty(), "{} faults do not say what to do next:\n{}", wrong.len(), wrong.join("\n"));
}
