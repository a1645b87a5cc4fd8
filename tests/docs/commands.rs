//! Every command that a guide shows runs, and prints what the guide shows.
//!
//! A block ```` ```console ```` has commands behind `$ `, each followed by its output. A line `...` stands for any
//! lines, `...` at another place for any text. Times and speeds are not compared. A block ```` ```console not-run ````
//! needs a camera, a robot, a second terminal or a build; it is counted here, and `cli::commands` parses it.

use super::markdown::{Fence, Markdown};
use std::path::Path;
use std::process::Command;

/// Documents whose commands run one after the other in one folder, as a reader would type them.
const FOLDERS: [&[&str]; 7] = [
    &["docs/getting-started.md", "docs/calibration.md", "docs/scanning.md", "docs/finding-and-inserting.md"],
    &["docs/hardware.md"],
    &["README.md"],
    &["docs/connections.md"],
    &["docs/archives.md"],
    &["docs/benchmark.md"],
    &["docs/boards.md"],
];

/// Blocks that cannot run in a test, by document. The numbers may only fall.
const NOT_RUN: [(&str, usize); 15] = [
    ("README.md", 3),
    ("docs/api.md", 1),
    ("docs/archives.md", 2),
    ("docs/calibration.md", 1),
    ("docs/cell.md", 3),
    ("docs/connections.md", 1),
    ("docs/finding-and-inserting.md", 3),
    ("docs/getting-started.md", 2),
    ("docs/joint.md", 1),
    ("docs/live.md", 3),
    ("docs/match.md", 2),
    ("docs/operator.md", 2),
    ("docs/python.md", 1),
    ("docs/robots/README.md", 1),
    ("docs/scanning.md", 1),
];

/// README speaks of a visitor's own recordings; simulated ones stand in for them.
fn prepare(document: &str, folder: &Path) {
    if document == "README.md" {
        let (made, said) = shell(
            "sheetlight simulate --out . --set all --seed 3 && mkdir recordings && mv scan recordings/board7 && \
             mv intrinsics handeye laserplane recordings && cd recordings/handeye && \
             for file in poses_noisy.*; do cp $file poses.${file##*.}; done",
            folder,
        );
        assert!(made, "{said}");
    }
}

fn console_documents() -> impl Iterator<Item = (String, String)> {
    super::documents().into_iter().filter(|(name, _)| name == "README.md" || name.starts_with("docs/"))
}

fn shell(command: &str, folder: &Path) -> (bool, String) {
    let programs = Path::new(env!("CARGO_BIN_EXE_sheetlight")).parent().expect("a program lies in a folder");
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap_or_default());
    let done = Command::new("bash")
        .args(["-c", &format!("{{ {command}\n}} 2>&1")])
        .current_dir(folder)
        .env("PATH", path)
        // Without it a Vulkan driver writes a note between the lines.
        .env("XDG_RUNTIME_DIR", folder)
        .output()
        .expect("bash runs");
    (done.status.success(), String::from_utf8_lossy(&done.stdout).into_owned())
}

/// A command and the lines that are shown below it.
struct Step {
    command: String,
    shown: Vec<String>,
    line: usize,
}

fn steps(fence: &Fence) -> Vec<Step> {
    let mut all: Vec<Step> = Vec::new();
    let mut open = false;
    for (n, line) in fence.lines.iter().enumerate() {
        let typed = line.strip_prefix("$ ").or(open.then_some(line.as_str()));
        match (typed, all.last_mut()) {
            (Some(words), Some(step)) if open => step.command = format!("{}\n{words}", step.command),
            (Some(words), _) => {
                all.push(Step { command: words.to_owned(), shown: Vec::new(), line: fence.line + 1 + n });
            }
            (None, Some(step)) => step.shown.push(line.clone()),
            (None, None) => panic!("line {}: output before a command", fence.line + 1 + n),
        }
        open = typed.is_some() && line.ends_with('\\');
    }
    all
}

/// A line with the numbers that are times or rates taken out.
fn masked(line: &str) -> String {
    let words: Vec<&str> = line.split_whitespace().collect();
    let unit =
        |w: Option<&&str>| w.is_some_and(|w| matches!(w.trim_end_matches([',', ';', ':', '.']), "s" | "ms" | "min"));
    let number = |w: &str| w.parse::<f64>().is_ok();
    let mask =
        |(i, w): (usize, &&str)| if number(w) && unit(words.get(i + 1)) { "#".to_owned() } else { (*w).to_owned() };
    words.iter().enumerate().map(mask).collect::<Vec<_>>().join(" ")
}

/// Whether two numbers are the same but for the last digits, in which processors differ.
fn close(shown: &str, printed: &str) -> bool {
    let bare = |word: &str| word.trim_matches(['(', ')', ',', ';', ':']).to_owned();
    let decimals = |word: &str| bare(word).split_once('.').map_or(0, |(_, d)| d.len());
    match (bare(shown).parse::<f64>(), bare(printed).parse::<f64>()) {
        (Ok(a), Ok(b)) if decimals(shown) == decimals(printed) => {
            (a - b).abs() <= f64::max(1e-5 * a.abs(), 3.5 * 0.1_f64.powi(decimals(shown) as i32))
        }
        _ => false,
    }
}

/// Whether a printed line is the one that is shown.
fn agrees(shown: &str, printed: &str) -> bool {
    let (shown, mut printed) = (masked(shown), masked(printed));
    let (want, mut have): (Vec<&str>, Vec<&str>) = (shown.split(' ').collect(), printed.split(' ').collect());
    let together = want.iter().zip(have.iter_mut()).take_while(|(w, _)| **w != "...");
    together.filter(|(w, h)| close(w, h)).for_each(|(w, h)| *h = w);
    printed = have.join(" ");
    let mut parts = shown.split("...");
    let Some(mut rest) = parts.next().and_then(|first| printed.strip_prefix(first)) else { return false };
    let mut last = None;
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
        last = Some(part);
    }
    rest.is_empty() || last == Some("")
}

/// The first line that is shown and not printed, or printed and not shown.
fn difference(shown: &[String], printed: &[&str]) -> Option<String> {
    let Some(first) = shown.first() else {
        return printed.first().map(|p| format!("not shown: {p}"));
    };
    if first.trim() == "..." {
        let found = (0..=printed.len()).any(|i| difference(&shown[1..], &printed[i..]).is_none());
        return (!found).then(|| format!("not printed after `...`: {}", shown.get(1).map_or("", |s| s)));
    }
    match printed.first() {
        Some(p) if agrees(first, p) => difference(&shown[1..], &printed[1..]),
        Some(p) => Some(format!("shown:   {first}\nprinted: {p}")),
        None => Some(format!("not printed: {first}")),
    }
}

/// Runs the blocks of documents that belong together; returns what differs.
fn run(documents: &[&str]) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder can be made");
    std::os::unix::fs::symlink(super::root().join("data"), folder.path().join("data")).expect("a link can be made");
    let mut wrong = Vec::new();
    for name in documents {
        prepare(name, folder.path());
        let text = std::fs::read_to_string(super::root().join(name)).expect("the document is readable");
        for step in Markdown::read(&text).fences.iter().filter(|f| f.info == "console").flat_map(steps) {
            let (good, printed) = shell(&step.command, folder.path());
            let refused = step.shown.iter().any(|l| l.starts_with("error: "));
            let lines: Vec<&str> = printed.lines().filter(|l| !l.trim().is_empty()).collect();
            let shown: Vec<String> = step.shown.iter().filter(|l| !l.trim().is_empty()).cloned().collect();
            if good == refused {
                wrong.push(format!("{name}:{}: {}: ended wrongly:\n{printed}", step.line, step.command));
            } else if let Some(what) = (!shown.is_empty()).then(|| difference(&shown, &lines)).flatten() {
                wrong.push(format!("{name}:{}: {}:\n{what}\n--- it printed\n{printed}", step.line, step.command));
            }
        }
    }
    wrong
}

fn agree(documents: &[&str]) {
    let wrong = run(documents);
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n\n"));
}

#[test]
fn the_guides_show_what_their_commands_print() {
    agree(FOLDERS[0]);
}

#[test]
fn the_hardware_guide_shows_what_its_commands_print() {
    agree(FOLDERS[1]);
}

#[test]
fn the_front_page_shows_what_its_commands_print() {
    agree(FOLDERS[2]);
}

#[test]
fn the_page_of_connections_shows_what_its_commands_print() {
    agree(FOLDERS[3]);
}

#[test]
fn the_page_of_archives_shows_what_its_commands_print() {
    agree(FOLDERS[4]);
}

#[test]
fn the_page_of_the_benchmark_shows_what_its_commands_print() {
    agree(FOLDERS[5]);
}

#[test]
fn the_page_of_boards_shows_what_its_commands_print() {
    agree(FOLDERS[6]);
}

#[test]
fn every_command_stands_in_a_block_that_runs_or_says_that_it_does_not() {
    let runs: Vec<&str> = FOLDERS.iter().flat_map(|f| f.iter().copied()).collect();
    let (mut counts, mut wrong) = (Vec::new(), Vec::new());
    for (name, text) in console_documents() {
        let read = Markdown::read(&text);
        let typed = |line: &str| line.starts_with("$ ") || line.starts_with("sheetlight ") || line.starts_with("make ");
        for (line, text) in read.indented.iter().filter(|(_, text)| typed(text)) {
            wrong.push(format!("{name}:{line}: a command outside a block ```console: {text}"));
        }
        for fence in &read.fences {
            let bare = ["sh", "bash", "shell", ""].contains(&fence.info.as_str());
            if bare && fence.lines.iter().any(|l| typed(l)) {
                wrong.push(format!("{name}:{}: a command in a block that is not ```console", fence.line));
            }
            if fence.info == "console" && !runs.contains(&name.as_str()) {
                wrong.push(format!("{name}:{}: no test runs this block: add the document to FOLDERS", fence.line));
            }
        }
        counts.push((name, read.fences.iter().filter(|f| f.info == "console not-run").count()));
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    super::ratchet("blocks that do not run", &counts, &NOT_RUN);
}

#[test]
fn a_shown_output_is_compared_line_by_line() {
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let printed = ["120 points in 1.5 s on a processor", "a", "b", "good 0.15 mm"];
    let same = |shown: &str| difference(&lines(shown), &printed).is_none();
    assert!(same("120 points in 9.0 s ...\n...\ngood 0.15 mm"));
    assert!(same("120 points in 9.0 s on ... processor\na\nb\ngood 0.15 mm"));
    assert!(!same("130 points in 1.5 s ...\n...\ngood 0.15 mm"), "another number");
    assert!(!same("120 points in 1.5 s ...\na\nb"), "a line too few");
    assert!(!same("120 points in 1.5 s\n..."), "text at a line's end");
    assert!(!same("...\ngood 0.20 mm"), "another last line");
    assert!(same("...\ngood 0.16 mm"), "a last digit");
}
