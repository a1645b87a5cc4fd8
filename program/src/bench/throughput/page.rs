//! In: results of several runs. Out: one HTML page with their tables and bars, which loads nothing from elsewhere.
//! Frame and unit: ms a picture, px, mm, MB.

use super::result::{Accuracy, Results, RowOf};
use super::scene::{SceneKind, Task};
use super::wire::Scenario;
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:72rem;padding:0 1rem;\
color:#1c2733}\
table{border-collapse:collapse;margin:.5rem 0 1.5rem;font-variant-numeric:tabular-nums}\
th,td{padding:.15rem .6rem;text-align:right;border-bottom:1px solid #dde3e8}\
th:first-child,td:first-child{text-align:left}\
.out{color:#8a949d}.bar{display:inline-block;height:.7em;background:#1f6fb2}.out .bar{background:#c3cad0}\
h2{margin-top:2.5rem}h3{margin:1.2rem 0 0}small{color:#52606b}";

/// Widest bar, px.
const BAR: f64 = 140.0;

fn number(value: Option<f64>, digits: usize) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "–".into(), |v| format!("{v:.digits$}"))
}

/// A number with three digits that say something.
fn three(value: Option<f64>) -> String {
    let digits = value.filter(|v| v.abs() > 1e-9).map_or(0, |v| (2 - v.abs().log10().floor() as i32).clamp(0, 4));
    number(value, digits as usize)
}

/// The rows of one task and scenario, the fastest that counts first, then those that do not count.
fn ranked<'a>(run: &'a Results, task: &Task, scenario: Scenario) -> Vec<&'a RowOf> {
    let mut rows: Vec<&RowOf> = run.rows.iter().filter(|r| r.task == *task && r.scenario == scenario).collect();
    let key = |r: &RowOf| (!r.against().is_empty(), r.ms().unwrap_or(f64::INFINITY));
    rows.sort_by(|a, b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal));
    rows
}

fn row(run: &Results, row: &RowOf, slowest: f64) -> Markup {
    let against = row.against();
    let of = |f: fn(&Accuracy) -> Option<f64>| row.accuracy.as_ref().and_then(f);
    let per_cent = |f: fn(&Accuracy) -> Option<f64>| of(f).map(|v| 100.0 * v);
    let bar = row.ms().map_or(0.0, |ms| BAR * ms / slowest);
    let division =
        run.entries.iter().find(|e| e.name == row.entry).map_or("", |e| if e.closed { "" } else { " (open)" });
    let latency = row.latency_ms().map(|l| l.map(|ms| three(Some(ms))).join(" / "));
    html! {
        tr class=@if against.is_empty() { "counts" } @else { "out" } {
            td { (row.entry) (division) }
            td { (three(row.ms())) }
            td style="text-align:left" { span.bar style=(format!("width:{bar:.0}px")) {} }
            td { (three(row.cpu_ms())) }
            td { (latency.unwrap_or_else(|| "–".into())) }
            td { @if row.scenario == Scenario::Camera { (number(Some(100.0 * row.dropped()), 1)) } @else { "–" } }
            td { (number(per_cent(|a| a.found), 1)) }
            td { (number(of(|a| a.median_px), 3)) " / " (number(of(|a| a.rms_px), 3)) }
            td { (number(of(|a| a.rms_mm), 4)) }
            td {
                @if row.task.scene == SceneKind::Dark { (number(of(|a| Some(a.false_a_picture)), 1)) " a picture" }
                @else { (number(per_cent(|a| a.false_share), 2)) }
            }
            td { (number(per_cent(|a| a.beyond_three_sigma), 2)) }
            td { (number(row.memory_mb, 0)) }
            td style="text-align:left" { (against.join("; ")) }
        }
    }
}

fn section(run: &Results, task: &Task, scenario: Scenario) -> Markup {
    let rows = ranked(run, task, scenario);
    let slowest = rows.iter().filter_map(|r| r.ms()).fold(1e-12, f64::max);
    let rate = rows.iter().find_map(|r| r.rate_hz).map(|hz| format!(", {hz:.1} pictures a second"));
    html! {
        h3 { (task.name()) ", " (scenario.name()) (rate.unwrap_or_default()) }
        table {
            tr {
                th { "entry" } th { "ms" } th {} th { "CPU ms" } th { "p50 / p90 / p99 ms" } th { "dropped %" }
                th { "found %" } th { "median / rms px" } th { "rms mm" } th { "false %" } th { "> 3σ %" } th { "MB" }
                th { "does not count because" }
            }
            @for r in rows { (row(run, r, slowest)) }
        }
    }
}

/// One cell of the summary: time and accuracy of an entry at a task, the fastest that counts in bold.
fn cell(row: Option<&RowOf>, fastest: Option<&str>) -> Markup {
    let Some(row) = row else { return html! { td { "–" } } };
    if !row.against().is_empty() {
        return html! { td.out title=(row.against().join("; ")) { "does not count" } };
    }
    let rms = row.accuracy.as_ref().and_then(|a| a.rms_px);
    let time = row.ms().or_else(|| row.latency_ms().map(|l| l[0]));
    let text = format!("{} ms, {} px", three(time), number(rms, 3));
    html! { td { @if fastest == Some(row.entry.as_str()) { b { (text) } } @else { (text) } } }
}

/// Every entry at every task.
fn summary(run: &Results, sections: &[(Task, Scenario)]) -> Markup {
    html! {
        table {
            tr { th { "pictures" } @for e in &run.entries { th { (e.name) } } }
            @for (task, scenario) in sections {
                @let rows = ranked(run, task, *scenario);
                @let fastest = rows.iter().find(|r| r.against().is_empty()).map(|r| r.entry.as_str());
                tr {
                    td { (task.name()) ", " (scenario.name()) }
                    @for e in &run.entries { (cell(rows.iter().find(|r| r.entry == e.name).copied(), fastest)) }
                }
            }
        }
    }
}

fn of_run(name: &str, run: &Results) -> Markup {
    let m = &run.machine;
    let mut sections: Vec<(Task, Scenario)> = Vec::new();
    for r in &run.rows {
        if !sections.contains(&(r.task, r.scenario)) {
            sections.push((r.task, r.scenario));
        }
    }
    html! {
        h2 { (name) }
        p {
            (m.processor) ", " (m.threads) " threads, "
            @if let Some(mb) = m.memory_mb { (mb) " MB, " }
            (m.system) "; " (run.started) "; driver " (run.driver)
            @if let Some(load) = m.load { "; load before the run " (load) }
            "; " (run.rounds) " rounds of at least " (run.seconds) " s"
        }
        table {
            tr { th { "entry" } th style="text-align:left" { "program" } th style="text-align:left" { "command" } }
            @for e in &run.entries {
                tr {
                    td { (e.name) @if !e.closed { " (open)" } }
                    td style="text-align:left" {
                        @if let Some(h) = &e.says { (h.name) " " (h.version) " " small { (h.settings) } }
                    }
                    td style="text-align:left" { code { (e.command) } }
                }
            }
        }
        (summary(run, &sections))
        @for (task, scenario) in &sections { (section(run, task, *scenario)) }
    }
}

/// The page of these runs, each with its name.
pub fn page(runs: &[(String, Results)]) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width";
                title { "Laser stripe benchmark" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { "Laser stripe benchmark" }
                p {
                    "Programs read the same pictures of a laser stripe in turns and return points. "
                    "Times are medians of the rounds. "
                    "Distances are measured from the exact line of the same pictures. "
                    "Grey rows do not count, for the reason that they name. "
                    "The rules stand in docs/benchmark.md."
                }
                @for (name, run) in runs { (of_run(name, run)) }
            }
        }
    }
    .into_string()
}

#[cfg(test)]
mod tests {
    use super::super::result::tests::good;
    use super::super::result::{EntryOf, Machine};
    use super::*;

    #[test]
    fn rows_that_count_stand_first_and_names_are_escaped() {
        let entry = |name: &str, command: &str| EntryOf {
            name: name.into(),
            command: command.into(),
            closed: !command.contains('{'),
            says: None,
        };
        let mut wrong = RowOf { entry: "fast & wrong".into(), ..good() };
        wrong.rounds.iter_mut().for_each(|r| r.wall_s *= 0.01);
        wrong.accuracy.as_mut().unwrap().rms_px = Some(0.9);
        let slow = RowOf { entry: "slow".into(), ..good() };
        let run = Results {
            sheetlight_bench: 1,
            driver: "0".into(),
            started: String::new(),
            machine: Machine::default(),
            rounds: 9,
            seconds: 1.0,
            entries: vec![entry("fast & wrong", "x < y"), entry("slow", "s {scene}")],
            rows: vec![wrong, slow],
        };
        let text = page(&[("here".into(), run)]);
        let place = |what: &str| text.rfind(what).unwrap_or_else(|| panic!("{what} in {text}"));
        assert!(place("<td>slow (open)</td>") < place("<td>fast &amp; wrong</td>"), "{text}");
        assert!(text.contains("rms 0.900 px, limit 0.5") && text.contains("x &lt; y"), "{text}");
        assert!(!text.contains("http"), "nothing is loaded");
    }

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.0123, 0.5, 1.234, 98.76, 1234.5].map(|v| three(Some(v)));
        assert_eq!(texts, ["0.0123", "0.500", "1.23", "98.8", "1234"]);
        assert_eq!((three(None), three(Some(0.0))), ("–".to_owned(), "0".to_owned()));
    }
}
