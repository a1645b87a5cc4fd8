//! In: a report. Out: Markdown for a person: verdicts, cases, survivors, explained mutants.

use super::{Outcome, Report};
use crate::mutants::{Mutant, Mutants};
use std::fmt::Write;

pub(super) fn written(report: &Report) -> String {
    let mut out = format!("# {}\n\n", report.title);
    match (&report.skipped, &report.adapter) {
        (Some(reason), _) => {
            let _ = writeln!(out, "**SKIPPED: no shader was tested.** {reason}");
        }
        (None, Some(a)) => {
            let verdict = if report.passed() { "passed" } else { "FAILED" };
            let _ = writeln!(out, "Verdict: **{verdict}**\n");
            out += &table(&["adapter", "kind", "backend", "driver"], &[[&a.name, a.kind, &a.backend, &a.driver]]);
        }
        (None, None) => {}
    }
    for outcome in &report.outcomes {
        stage(&mut out, outcome);
    }
    out
}

fn stage(out: &mut String, outcome: &Outcome) {
    let verdict = if outcome.passed() { "passed" } else { "FAILED" };
    let _ = writeln!(out, "\n## {}\n\n{verdict} in {:.1} s\n", outcome.stage, outcome.seconds);
    for e in &outcome.errors {
        let _ = writeln!(out, "- {}", cell(&e.to_string()));
    }
    if let Some(comparison) = &outcome.comparison {
        let rows: Vec<[String; 3]> = (comparison.cases.iter())
            .map(|c| [c.name.clone(), if c.passed() { "passed" } else { "FAILED" }.into(), c.line()])
            .collect();
        out.push_str(&table(&["case", "verdict", "words"], &rows));
    }
    if let Some(mutants) = &outcome.mutants {
        self::mutants(out, mutants);
    }
}

fn mutants(out: &mut String, mutants: &Mutants) {
    let _ = writeln!(out, "\n{}.", mutants.line());
    let row = |m: &Mutant, last: &str| {
        [m.line.to_string(), m.column.to_string(), m.original.clone(), m.mutated.clone(), last.to_owned()]
    };
    let survivors: Vec<_> = mutants.survivors.iter().map(|m| row(m, &m.now)).collect();
    let explained: Vec<_> = mutants.explained.iter().map(|(m, reason)| row(m, reason)).collect();
    for (heading, last, rows) in [("Survivors", "line after", survivors), ("Explained mutants", "reason", explained)] {
        if !rows.is_empty() {
            let _ = writeln!(out, "\n### {heading}\n");
            out.push_str(&table(&["line", "column", "original", "mutated", last], &rows));
        }
    }
    for stale in &mutants.stale {
        let _ = writeln!(out, "\n- explanation without need or reason: {}", cell(stale));
    }
}

fn table<const N: usize, T: AsRef<str>>(head: &[&str; N], rows: &[[T; N]]) -> String {
    let line = |cells: Vec<String>| format!("| {} |\n", cells.join(" | "));
    let mut out = line(head.iter().map(|h| (*h).to_owned()).collect());
    out += &line(vec!["---".into(); N]);
    for row in rows {
        out += &line(row.iter().map(|c| cell(c.as_ref())).collect());
    }
    out
}

/// A text inside a table: it neither ends the cell nor means Markdown or HTML.
fn cell(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '\n' => out.push(' '),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '&' => out.push_str("&amp;"),
            '|' | '*' | '_' | '`' | '\\' | '[' | ']' | '~' => out.extend(['\\', c]),
            c => out.push(c),
        }
    }
    out
}
