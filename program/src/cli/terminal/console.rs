//! In: results, warnings, progress. Out: data on stdout (text or JSON), messages and bars on stderr.
//! Frame and unit: none.

use super::printable::{printable, printable_json};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use sheetlight::fault::{Fault, Result};
use std::cell::RefCell;
use std::io::{ErrorKind, IsTerminal, Write};

/// The output of a command. Each process has one, and nothing else prints.
pub struct Console {
    pub json: bool,
    quiet: bool,
    /// The first error of writing to stdout.
    failed: RefCell<Option<std::io::Error>>,
}

impl Console {
    pub fn new(json: bool, quiet: bool) -> Console {
        Console { json, quiet, failed: RefCell::default() }
    }

    /// The command's result: `value` as JSON with --json, else `text`.
    pub fn result(&self, value: &impl serde::Serialize, text: &str) {
        if self.json {
            self.data(&printable_json(&serde_json::to_string_pretty(value).expect("plain data")));
        } else {
            self.data(&printable(text.trim_end()));
        }
    }

    /// A part of the result that is known before the rest; with --json it is printed with the rest.
    pub fn part(&self, text: &str) {
        if !self.json {
            self.data(&printable(text.trim_end()));
        }
    }

    /// One of many results as one line of JSON, printed at once. False if nobody reads them any more.
    pub fn line(&self, value: &impl serde::Serialize) -> bool {
        self.data(&printable_json(&serde_json::to_string(value).expect("plain data")));
        self.failed.borrow().is_none()
    }

    fn data(&self, text: &str) {
        let mut out = std::io::stdout().lock();
        if let Err(e) = writeln!(out, "{text}").and_then(|()| out.flush()) {
            self.failed.borrow_mut().get_or_insert(e);
        }
    }

    /// `Err` if stdout did not accept all of the data. A reader that stops early (`| head`) is not an error: the
    /// files that the command wrote are complete.
    pub fn finish(&self) -> Result<()> {
        match &*self.failed.borrow() {
            Some(e) if e.kind() != ErrorKind::BrokenPipe => Err(Fault::output(format!("standard output: {e}"))
                .cause("the disk that it is sent to is full, or it was closed")
                .next("free some space, or send it elsewhere; the command's files are complete")),
            _ => Ok(()),
        }
    }

    /// Prints a message. If even stderr is closed, nothing can be reported.
    fn tell(&self, text: &str) {
        let _ = write!(std::io::stderr().lock(), "{}", printable(text));
    }

    /// Information for a person; never data.
    pub fn say(&self, text: impl AsRef<str>) {
        if !self.quiet {
            self.tell(&format!("{}\n", text.as_ref()));
        }
    }

    /// A warning; printed even when quiet.
    pub fn warn(&self, text: impl AsRef<str>) {
        self.tell(&format!("warning: {}\n", text.as_ref()));
    }

    /// A question to a person, who answers on the same line; asked even when quiet.
    pub fn ask(&self, question: &str) {
        self.tell(question);
    }

    /// An error with its cause and next step; with --json also as one object on stdout.
    pub fn fault(&self, fault: &Fault) {
        if self.json {
            let body =
                serde_json::json!({"kind": fault.kind, "what": fault.what, "cause": fault.cause, "next": fault.next});
            self.line(&serde_json::json!({ "error": body }));
        }
        self.tell(&format!("error: {fault}\n"));
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
