//! In: results of a run. Out: what is against the rules of docs/benchmark.md in them. Frame and unit: none.

use super::drawing;
use super::result::{Results, RowOf};
use super::scene::{SceneKind, Task};
use strum::VariantArray;

/// Rounds that a result needs, and the least duration of each, s.
const LEAST_ROUNDS: usize = 9;
const LEAST_S: f64 = 1.0;
/// Most waiting processes before the run.
const MOST_LOAD: f64 = 0.5;

/// Draws the pictures of the run again and checks the file against the rules; empty if nothing is against them.
/// `progress` receives the name of each task.
pub fn verify(results: &Results, mut progress: impl FnMut(&str)) -> Vec<String> {
    let mut found = Vec::new();
    let m = &results.machine;
    if m.processor.is_empty() || m.system.is_empty() || m.threads == 0 || m.memory_mb.is_none() {
        found.push("the machine is not described: processor, threads, memory_mb and system are needed".into());
    }
    match m.load {
        Some(load) if load > MOST_LOAD => {
            found.push(format!("{load} processes waited in the minute before the run, {MOST_LOAD} is the limit"));
        }
        Some(_) => {}
        None => found.push("the load of the machine before the run is not stated".into()),
    }
    if results.started.parse::<jiff::Timestamp>().is_err() {
        found.push(format!("'{}' is not the time of the run", results.started));
    }
    let mut tasks: Vec<&Task> = Vec::new();
    results.rows.iter().for_each(|r| {
        if !tasks.contains(&&r.task) {
            tasks.push(&r.task);
        }
    });
    for task in &tasks {
        progress(&task.name());
        let [least, most] = [64, 8192];
        let sides = [task.width, task.height];
        if sides.iter().any(|s| !(least..=most).contains(s)) || !(8..=16).contains(&task.bits) {
            found.push(format!("{}: {least} to {most} px and 8 to 16 bits are possible", task.name()));
            continue;
        }
        let hash = drawing::hash(&drawing::pictures(task));
        let other = results.rows.iter().filter(|r| r.task == **task && r.pictures_sha256 != hash);
        found.extend(other.map(|r| format!("{}: the pictures of {} were others", task.name(), r.entry)));
    }
    let short = results.rows.iter().filter(|r| r.failed.is_none() && r.rounds.len() < LEAST_ROUNDS);
    let short: Vec<usize> = short.map(|r| r.rounds.len()).collect();
    if let Some(least) = short.iter().min() {
        found.push(format!("{} rows have {least} rounds or more, {LEAST_ROUNDS} are needed", short.len()));
    }
    let brief = |r: &&RowOf| r.rounds.iter().any(|round| round.wall_s < 0.9 * LEAST_S);
    let brief = results.rows.iter().filter(brief).count();
    if brief > 0 {
        found.push(format!("{brief} rows have rounds of less than {LEAST_S} s"));
    }
    results.rows.iter().for_each(|row| found.extend(of_row(results, row)));
    for entry in &results.entries {
        let scenes: Vec<SceneKind> =
            results.rows.iter().filter(|r| r.entry == entry.name).map(|r| r.task.scene).collect();
        let missing: Vec<&str> = SceneKind::VARIANTS.iter().filter(|s| !scenes.contains(s)).map(|s| s.name()).collect();
        if !missing.is_empty() {
            found.push(format!("{}: no row for {}", entry.name, missing.join(", ")));
        }
    }
    found
}

fn of_row(results: &Results, row: &RowOf) -> Vec<String> {
    let name = format!("{}, {}, {}", row.task.name(), row.scenario.name(), row.entry);
    let mut found = Vec::new();
    if !results.entries.iter().any(|e| e.name == row.entry) {
        found.push(format!("{name}: the entry's command is not stated"));
    }
    if row.rounds.iter().any(|r| r.pictures == 0 || r.wall_s.is_nan() || r.wall_s <= 0.0) {
        found.push(format!("{name}: a round without pictures or without time"));
    }
    if row.failed.is_none() && row.accuracy.is_none() {
        found.push(format!("{name}: no accuracy"));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::result::tests::good;
    use super::super::result::{EntryOf, Machine, Round};
    use super::*;

    /// A run of all scenes that keeps the rules.
    fn right() -> Results {
        let task = |scene| Task { scene, width: 64, height: 64, bits: 8 };
        let row = |scene: &SceneKind| {
            let round = Round { wall_s: 1.01, ..good().rounds[0].clone() };
            let rounds = std::iter::repeat_n(round, LEAST_ROUNDS).collect();
            let pictures_sha256 = drawing::hash(&drawing::pictures(&task(*scene)));
            RowOf { task: task(*scene), pictures_sha256, rounds, ..good() }
        };
        let machine = Machine {
            processor: "any".into(),
            threads: 2,
            memory_mb: Some(1000),
            system: "linux".into(),
            load: Some(0.1),
        };
        Results {
            sheetlight_bench: 1,
            driver: "0".into(),
            started: "2026-11-29T10:00:00Z".into(),
            machine,
            rounds: 9,
            seconds: 1.0,
            entries: vec![EntryOf { name: "a".into(), command: "a".into(), closed: true, says: None }],
            rows: SceneKind::VARIANTS.iter().map(row).collect(),
        }
    }

    #[test]
    fn a_run_by_the_rules_passes_and_each_breach_is_named() {
        let problems = |change: &dyn Fn(&mut Results)| {
            let mut r = right();
            change(&mut r);
            verify(&r, |_| ()).join("; ")
        };
        assert_eq!(problems(&|_| ()), "");
        let digit = |r: &mut Results| r.rows[3].pictures_sha256.replace_range(..1, "x");
        assert!(problems(&digit).contains("thick 64x64 8 bit: the pictures of a were others"));
        assert!(problems(&|r| r.rows[0].rounds.truncate(8)).contains("1 rows have 8 rounds or more, 9 are needed"));
        assert!(problems(&|r| r.rows[0].rounds[3].wall_s = 0.5).contains("1 rows have rounds of less than 1 s"));
        assert!(problems(&|r| r.rows.truncate(8)).contains("no row for dark"));
        assert!(problems(&|r| r.machine.load = Some(1.2)).contains("1.2 processes waited"));
        assert!(problems(&|r| r.machine.load = None).contains("not stated"));
        assert!(problems(&|r| r.machine.system = String::new()).contains("not described"));
        assert!(problems(&|r| r.started = "yesterday".into()).contains("yesterday"));
        assert!(problems(&|r| r.rows[1].accuracy = None).contains("no accuracy"));
        assert!(problems(&|r| r.rows[1].entry = "z".into()).contains("command is not stated"));
        assert!(problems(&|r| r.rows[1].rounds[2].wall_s = 0.0).contains("without time"));
        assert!(problems(&|r| r.rows[0].task.bits = 40).contains("8 to 16 bits"));
        // An entry that failed is a result, not a breach.
        let failed = |r: &mut Results| {
            let row = &mut r.rows[0];
            (row.failed, row.accuracy, row.rounds) = (Some("died".into()), None, vec![]);
        };
        assert_eq!(problems(&failed), "");
    }
}
