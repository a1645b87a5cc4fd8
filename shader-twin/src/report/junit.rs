//! In: a report. Out: JUnit XML as build servers read it: suites of tests with failures, errors and skipped ones.

use super::{Outcome, Report};
use crate::error::{Error, Kind};
use crate::mutants::{Mutant, Mutants};
use std::fmt::Write;

enum Verdict {
    Passed,
    /// What differs.
    Failed(String),
    /// What kept the test from running.
    Error(String),
    Skipped(String),
}

struct Test {
    name: String,
    verdict: Verdict,
    /// What is worth reading of a test that passed.
    note: String,
}

fn test(name: impl Into<String>, verdict: Verdict, note: impl Into<String>) -> Test {
    Test { name: name.into(), verdict, note: note.into() }
}

fn failed_if(bad: bool, why: String) -> Verdict {
    if bad { Verdict::Failed(why) } else { Verdict::Passed }
}

fn tests(outcome: &Outcome) -> Vec<Test> {
    // What stopped a run belongs to the step that it stopped.
    let declared = |e: &&Error| outcome.comparison.is_none() && matches!(e.kind(), Kind::Contract | Kind::Usage);
    let (contract, device): (Vec<&Error>, Vec<&Error>) = outcome.errors.iter().partition(declared);
    let error = |list: &[&Error]| {
        let lines: Vec<String> = list.iter().map(|e| e.to_string()).collect();
        if list.is_empty() { Verdict::Passed } else { Verdict::Error(lines.join("\n")) }
    };
    let mut all = vec![test("contract", error(&contract), "")];
    if outcome.comparison.is_none() && !device.is_empty() {
        all.push(test("cases", error(&device), ""));
    }
    for case in outcome.comparison.iter().flat_map(|c| &c.cases) {
        all.push(test(format!("case: {}", case.name), failed_if(!case.passed(), case.line()), case.line()));
    }
    all.push(match &outcome.mutants {
        Some(mutants) => test("mutants", failed_if(!mutants.passed(), told(mutants)), mutants.line()),
        None if outcome.comparison.is_some() && !device.is_empty() => test("mutants", error(&device), ""),
        None => test("mutants", Verdict::Skipped("the shader did not pass its cases".into()), ""),
    });
    all
}

fn told(mutants: &Mutants) -> String {
    let survivors = mutants.survivors.iter().map(Mutant::line);
    let stale = mutants.stale.iter().map(|s| format!("explanation without need or reason: {s}"));
    [mutants.line()].into_iter().chain(survivors).chain(stale).collect::<Vec<_>>().join("\n")
}

pub(super) fn written(report: &Report) -> String {
    let mut out = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let _ = writeln!(out, "<testsuites name=\"{}\">", escaped(&report.title));
    if let Some(reason) = &report.skipped {
        suite(&mut out, report, "adapter", 0.0, &[test("adapter", Verdict::Skipped(reason.clone()), "")]);
    }
    for outcome in &report.outcomes {
        suite(&mut out, report, &outcome.stage, outcome.seconds, &tests(outcome));
    }
    out + "</testsuites>\n"
}

fn suite(out: &mut String, report: &Report, name: &str, seconds: f64, tests: &[Test]) {
    let count = |of: fn(&Verdict) -> bool| tests.iter().filter(|t| of(&t.verdict)).count();
    let _ = writeln!(
        out,
        "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" errors=\"{}\" skipped=\"{}\" time=\"{seconds:.3}\">",
        escaped(name),
        tests.len(),
        count(|v| matches!(v, Verdict::Failed(_))),
        count(|v| matches!(v, Verdict::Error(_))),
        count(|v| matches!(v, Verdict::Skipped(_)))
    );
    if let Some(adapter) = &report.adapter {
        let _ = writeln!(out, "    <properties>");
        for (key, value) in [
            ("adapter", adapter.name.as_str()),
            ("kind", adapter.kind),
            ("backend", &adapter.backend),
            ("driver", &adapter.driver),
        ] {
            let _ = writeln!(out, "      <property name=\"{key}\" value=\"{}\"/>", escaped(value));
        }
        let _ = writeln!(out, "    </properties>");
    }
    for t in tests {
        let _ = write!(out, "    <testcase classname=\"{}\" name=\"{}\">", escaped(name), escaped(&t.name));
        let body = |tag: &str, why: &str| {
            let first = escaped(why.lines().next().unwrap_or(""));
            format!("<{tag} message=\"{first}\">{}</{tag}>", escaped(why))
        };
        out.push_str(&match &t.verdict {
            Verdict::Passed => format!("<system-out>{}</system-out>", escaped(&t.note)),
            Verdict::Failed(why) => body("failure", why),
            Verdict::Error(why) => body("error", why),
            Verdict::Skipped(why) => format!("<skipped message=\"{}\"/>", escaped(why)),
        });
        out.push_str("</testcase>\n");
    }
    out.push_str("  </testsuite>\n");
}

/// A text inside XML. Characters that XML 1.0 does not allow become question marks.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' => out.push(c),
            c if c < ' ' || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('?'),
            c => out.push(c),
        }
    }
    out
}
