//! In: results of one run. Out: the ratio of two entries' times, round by round, with its scatter, and both accuracies.
//! Frame and unit: ms a picture; ratios without unit.

use super::result::{Accuracy, Results, Round, RowOf, median};
use super::scene::Task;
use super::wire::Scenario;
use sheetlight::fault::{Fault, Result};

/// Two entries at one task in one scenario.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Compared {
    /// Scene, size, depth.
    pub task: Task,
    /// How the pictures were sent.
    pub scenario: Scenario,
    /// Time of the first entry over that of the second, wall: median of the rounds.
    pub wall: Option<f64>,
    /// The middle two thirds of the rounds' ratios.
    pub wall_scatter: Option<[f64; 2]>,
    /// The same of the CPU time of all threads.
    pub cpu: Option<f64>,
    /// The middle two thirds of the rounds' ratios.
    pub cpu_scatter: Option<[f64; 2]>,
    /// Wall time a picture of both, ms.
    pub ms: [Option<f64>; 2],
    /// Accuracy of both.
    pub accuracy: [Option<Accuracy>; 2],
    /// Why one of them does not count; then there are no ratios.
    pub against: Vec<String>,
}

/// Shares of the sorted rounds between which two thirds lie.
const SCATTER: [f64; 2] = [1.0 / 6.0, 5.0 / 6.0];

/// Median of the rounds' ratios, and their scatter. Round i of both ran next to each other.
fn ratio(a: &RowOf, b: &RowOf, of: impl Fn(&Round) -> Option<f64>) -> Option<(f64, [f64; 2])> {
    let both = a.rounds.iter().zip(&b.rounds);
    let mut ratios: Vec<f64> = both.map(|(a, b)| Some(of(a)? / of(b)?)).collect::<Option<_>>()?;
    ratios.retain(|r| r.is_finite());
    ratios.sort_by(f64::total_cmp);
    let last = ratios.len().checked_sub(1)?;
    let scatter = SCATTER.map(|share| ratios[(share * last as f64).round() as usize]);
    Some((median(ratios), scatter))
}

/// Compares two entries of one run.
///
/// # Errors
/// A name that is not in the run.
pub fn compare(results: &Results, a: &str, b: &str) -> Result<Vec<Compared>> {
    for name in [a, b] {
        if !results.entries.iter().any(|e| e.name == name) {
            let names: Vec<&str> = results.entries.iter().map(|e| e.name.as_str()).collect();
            return Err(Fault::usage(format!("no entry '{name}' in the run; it has {}", names.join(", ")))
                .next("name two of these"));
        }
    }
    let of = |name: &str| results.rows.iter().filter(|r| r.entry == name).collect::<Vec<_>>();
    let theirs = of(b);
    let pairs = of(a).into_iter().filter_map(|x| {
        let y = theirs.iter().find(|y| y.task == x.task && y.scenario == x.scenario)?;
        Some((x, *y))
    });
    let one = |(x, y): (&RowOf, &RowOf)| {
        let because =
            |row: &RowOf| row.against().into_iter().map(|w| format!("{}: {w}", row.entry)).collect::<Vec<_>>();
        let against = [because(x), because(y)].concat();
        let counts = against.is_empty();
        let wall = counts.then(|| ratio(x, y, |r| Some(r.ms()))).flatten();
        let cpu = counts.then(|| ratio(x, y, Round::cpu_ms)).flatten();
        Compared {
            task: x.task,
            scenario: x.scenario,
            wall: wall.map(|w| w.0),
            wall_scatter: wall.map(|w| w.1),
            cpu: cpu.map(|c| c.0),
            cpu_scatter: cpu.map(|c| c.1),
            ms: [x.ms(), y.ms()],
            accuracy: [x.accuracy, y.accuracy],
            against,
        }
    };
    Ok(pairs.map(one).collect())
}

#[cfg(test)]
mod tests {
    use super::super::result::tests::good;
    use super::super::result::{EntryOf, Machine};
    use super::*;

    pub fn run(rows: Vec<RowOf>) -> Results {
        let entry = |name: &str| EntryOf { name: name.into(), command: name.into(), closed: true, says: None };
        Results {
            sheetlight_bench: 1,
            driver: "0".into(),
            started: String::new(),
            machine: Machine::default(),
            rounds: 9,
            seconds: 1.0,
            entries: vec![entry("a"), entry("b")],
            rows,
        }
    }

    #[test]
    fn ratios_are_of_rounds_that_ran_next_to_each_other() {
        // The machine was three times as slow in the last round, for both.
        let slow = |factor: f64| {
            let mut row = good();
            row.rounds.iter_mut().for_each(|r| (r.wall_s, r.cpu_s) = (r.wall_s * factor, r.cpu_s.map(|s| s * 2.0)));
            row
        };
        let b = RowOf { entry: "b".into(), ..slow(2.0) };
        let found = &compare(&run(vec![good(), b]), "b", "a").unwrap()[0];
        assert_eq!((found.wall, found.wall_scatter, found.cpu), (Some(2.0), Some([2.0, 2.0]), Some(2.0)));
        let mut uneven = RowOf { entry: "b".into(), ..good() };
        let factors = [0.5, 1.0, 2.0, 3.0, 4.0];
        uneven.rounds.iter_mut().zip(factors).for_each(|(r, f)| r.wall_s *= f);
        let found = &compare(&run(vec![good(), uneven]), "b", "a").unwrap()[0];
        assert_eq!((found.wall, found.wall_scatter), (Some(2.0), Some([1.0, 3.0])));
    }

    #[test]
    fn an_entry_without_accuracy_has_no_ratio() {
        let b = RowOf { entry: "b".into(), accuracy: None, ..good() };
        let found = &compare(&run(vec![good(), b]), "a", "b").unwrap()[0];
        assert_eq!((found.wall, found.cpu), (None, None));
        assert_eq!(found.against, ["b: no accuracy"]);
        assert!(compare(&run(vec![]), "a", "c").unwrap_err().what.contains("'c'"));
    }
}
