//! In: results, warnings, progress. Out: data on stdout (text or JSON), talk and bars on stderr.
//! Frame and unit: none.

use crate::fault::Fault;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;

/// Where a command talks to. One a process.
pub struct Console {
    pub json: bool,
    quiet: bool,
}

impl Console {
    pub fn new(json: bool, quiet: bool) -> Console {
        Console { json, quiet }
    }

    /// The command's result: `value` as JSON with --json, else `text`.
    pub fn result(&self, value: &impl serde::Serialize, text: &str) {
        if self.json {
            println!("{}", serde_json::to_string_pretty(value).expect("plain data"));
        } else {
            println!("{}", text.trim_end());
        }
    }

    /// Something a person should know; never data.
    pub fn say(&self, text: impl AsRef<str>) {
        if !self.quiet {
            eprintln!("{}", text.as_ref());
        }
    }

    /// Something that may be wrong; said even when quiet.
    pub fn warn(&self, text: impl AsRef<str>) {
        eprintln!("warning: {}", text.as_ref());
    }

    /// An error with its cause and next step; with --json also as one object on stdout.
    pub fn fault(&self, fault: &Fault) {
        if self.json {
            let body =
                serde_json::json!({"kind": fault.kind, "what": fault.what, "cause": fault.cause, "next": fault.next});
            println!("{}", serde_json::json!({ "error": body }));
        }
        eprintln!("error: {fault}");
    }

    /// A bar with rate and time left; hidden when quiet or not on a terminal.
    pub fn bar(&self, what: &str, total: u64) -> ProgressBar {
        let bar = ProgressBar::new(total);
        if self.quiet || !std::io::stderr().is_terminal() {
            bar.set_draw_target(ProgressDrawTarget::hidden());
        }
        let style = ProgressStyle::with_template("{msg:24} {bar:32} {pos}/{len} {per_sec}, {eta} left");
        bar.set_style(style.expect("a fixed template"));
        bar.set_message(what.to_owned());
        bar
    }
}
