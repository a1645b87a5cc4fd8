//! In: what was measured. Out: the file of a benchmark run, and whether a row counts (docs/benchmark.md, "What
//! counts").
//! Frame and unit: stated at the fields.

use super::scene::{SceneKind, Task};
use super::wire::{Hello, Scenario};
use sheetlight::fault::{Fault, Result};
use std::path::Path;

/// Least share of the lines that must be found.
const LEAST_FOUND: f64 = 0.8;
/// Largest share of false points.
const MOST_FALSE: f64 = 0.15;
/// Largest rms distance from the lines, px.
const MOST_RMS_PX: f64 = 0.5;
/// Largest rms distance of X, Y, Z from the true place, mm: far above every entry whose geometry is right.
const MOST_RMS_MM: f64 = 1.0;
/// Most false points in a picture without a stripe.
const MOST_DARK: f64 = 5.0;

/// A benchmark run.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Results {
    /// Version of the rules and of this file.
    pub sheetlight_bench: u32,
    /// Version of the driver.
    pub driver: String,
    /// Beginning of the run, UTC, RFC 3339.
    pub started: String,
    /// The machine.
    pub machine: Machine,
    /// Rounds that were asked for.
    pub rounds: usize,
    /// Least duration of a round, s.
    pub seconds: f64,
    /// The entries, in the order of their turns.
    pub entries: Vec<EntryOf>,
    /// One row for each task, scenario and entry.
    pub rows: Vec<RowOf>,
}

/// The machine of a run.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Machine {
    /// The processor's name.
    pub processor: String,
    /// Number of threads that a program may use.
    pub threads: usize,
    /// Memory, MB.
    pub memory_mb: Option<u64>,
    /// Operating system and its version.
    pub system: String,
    /// Mean number of waiting processes in the minute before the run; a quiet machine has less than 0.5.
    pub load: Option<f64>,
}

/// An entry of a run.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EntryOf {
    /// Its name in the run.
    pub name: String,
    /// Its command, with placeholders.
    pub command: String,
    /// Whether the command is the same for every scene.
    pub closed: bool,
    /// What the program said of itself; `None` if it never did.
    pub says: Option<Hello>,
}

/// One entry at one task in one scenario.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RowOf {
    /// Scene, size, depth.
    pub task: Task,
    /// SHA-256 of the pictures.
    pub pictures_sha256: String,
    /// How the pictures were sent.
    pub scenario: Scenario,
    /// Name of the entry.
    pub entry: String,
    /// Pictures a second of `Camera`.
    pub rate_hz: Option<f64>,
    /// The rounds; round i of every entry of a task ran after round i - 1 of all.
    pub rounds: Vec<Round>,
    /// From replies of all rounds, chosen by chance.
    pub accuracy: Option<Accuracy>,
    /// Most memory of the process and its children, MB.
    pub memory_mb: Option<f64>,
    /// Why there is no result.
    pub failed: Option<String>,
}

/// One round.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Round {
    /// Pictures answered.
    pub pictures: u64,
    /// Pictures dropped before they were sent; only `Camera` drops.
    pub dropped: u64,
    /// From the first picture sent to the last points received, s.
    pub wall_s: f64,
    /// CPU time of the process and its children, s.
    pub cpu_s: Option<f64>,
    /// Time from a picture to its points, ms: median, 90th and 99th percentile. `None` where pictures wait for others.
    pub latency_ms: Option<[f64; 3]>,
}

impl Round {
    /// Wall time a picture, ms.
    pub fn ms(&self) -> f64 {
        1e3 * self.wall_s / self.pictures.max(1) as f64
    }
    /// CPU time a picture, ms.
    pub fn cpu_ms(&self) -> Option<f64> {
        self.cpu_s.map(|s| 1e3 * s / self.pictures.max(1) as f64)
    }
}

/// How right the points are.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Accuracy {
    /// Points returned a picture.
    pub points_a_picture: f64,
    /// Share of the lines' columns with a point within 1 px; `None` if there is no line.
    pub found: Option<f64>,
    /// Points more than 3 px from every line, as a share of these and of the columns with a point on a line.
    pub false_share: Option<f64>,
    /// Number of such points a picture.
    pub false_a_picture: f64,
    /// Median distance of the other points from the line, px: means over the points of a column.
    pub median_px: Option<f64>,
    /// Root mean square of that distance, px.
    pub rms_px: Option<f64>,
    /// Root mean square distance of X, Y, Z from the exact point of the line, mm.
    pub rms_mm: Option<f64>,
    /// Share of the points that lie beyond three of their stated standard deviations.
    pub beyond_three_sigma: Option<f64>,
}

/// The median; NaN for an empty list.
pub(super) fn median(numbers: impl IntoIterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = numbers.into_iter().collect();
    all.sort_by(f64::total_cmp);
    let n = all.len();
    if n == 0 { f64::NAN } else { 0.5 * (all[(n - 1) / 2] + all[n / 2]) }
}

impl RowOf {
    /// Wall time a picture, ms: the median of the rounds; `None` for `Camera`, where it is the camera's.
    pub fn ms(&self) -> Option<f64> {
        (!self.rounds.is_empty() && self.scenario != Scenario::Camera)
            .then(|| median(self.rounds.iter().map(Round::ms)))
    }

    /// CPU time a picture, ms: the median of the rounds.
    pub fn cpu_ms(&self) -> Option<f64> {
        let all: Option<Vec<f64>> = self.rounds.iter().map(Round::cpu_ms).collect();
        all.filter(|a| !a.is_empty()).map(median)
    }

    /// Latency, ms: medians of the rounds' median, 90th and 99th percentile.
    pub fn latency_ms(&self) -> Option<[f64; 3]> {
        let all: Option<Vec<[f64; 3]>> = self.rounds.iter().map(|r| r.latency_ms).collect();
        all.filter(|a| !a.is_empty()).map(|a| std::array::from_fn(|i| median(a.iter().map(|l| l[i]))))
    }

    /// Share of the pictures that were dropped.
    pub fn dropped(&self) -> f64 {
        let [dropped, answered] =
            self.rounds.iter().fold([0, 0], |[d, a], r| [d + r.dropped, a + r.pictures]).map(|n: u64| n as f64);
        dropped / (dropped + answered).max(1.0)
    }

    /// Why the row does not count; empty if it counts.
    pub fn against(&self) -> Vec<String> {
        if let Some(failed) = &self.failed {
            return vec![failed.clone()];
        }
        let Some(a) = &self.accuracy else { return vec!["no accuracy".into()] };
        let mut why = Vec::new();
        let mut above = |what: &str, is: f64, limit: f64, factor: f64, unit: &str| {
            if is.is_nan() || is > limit {
                why.push(format!("{what} {:.3} {unit}, limit {}", factor * is, factor * limit));
            }
        };
        if self.task.scene == SceneKind::Dark {
            above("false points a picture", a.false_a_picture, MOST_DARK, 1.0, "");
            return why;
        }
        if a.points_a_picture == 0.0 {
            return vec!["no points returned".into()];
        }
        above("false points", a.false_share.unwrap_or(f64::NAN), MOST_FALSE, 100.0, "%");
        above("rms", a.rms_px.unwrap_or(f64::NAN), MOST_RMS_PX, 1.0, "px");
        above("rms of X, Y, Z", a.rms_mm.unwrap_or(f64::NAN), MOST_RMS_MM, 1.0, "mm");
        let found = a.found.unwrap_or(0.0);
        if found < LEAST_FOUND {
            why.push(format!("{:.1} % of the lines found, {} % needed", 100.0 * found, 100.0 * LEAST_FOUND));
        }
        why
    }
}

impl Results {
    /// Reads a file that `sheetlight bench run` wrote.
    ///
    /// # Errors
    /// The file cannot be read, or has another format or another version.
    pub fn read(path: &Path) -> Result<Results> {
        let text = sheetlight::files::read_text(path)?;
        let read = serde_json::from_str::<Results>(&text).map_err(|e| e.to_string());
        let version = |r: Results| match r.sheetlight_bench {
            super::wire::FORMAT => Ok(r),
            other => Err(format!("format {other}, {} is known", super::wire::FORMAT)),
        };
        read.and_then(version).map_err(|e| {
            Fault::input(format!("{}: is not a result of the benchmark ({e})", path.display()))
                .cause("the file was written by another program or another version")
                .next("give a file that sheetlight bench run --out wrote")
        })
    }
}

/// This machine.
pub(super) fn machine() -> Machine {
    let text = |read: std::io::Result<String>| read.unwrap_or_default();
    let after = |text: &str, key: &str| {
        let line = text.lines().find(|l| l.starts_with(key))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    let kernel = text(std::fs::read_to_string("/proc/sys/kernel/osrelease"));
    let memory = after(&text(std::fs::read_to_string("/proc/meminfo")), "MemTotal");
    Machine {
        processor: after(&text(std::fs::read_to_string("/proc/cpuinfo")), "model name")
            .unwrap_or_else(|| std::env::consts::ARCH.into()),
        threads: std::thread::available_parallelism().map_or(1, |n| n.get()),
        memory_mb: memory.and_then(|m| Some(m.split_whitespace().next()?.parse::<u64>().ok()? / 1024)),
        system: format!("{} {}", std::env::consts::OS, kernel.trim()).trim().to_owned(),
        load: text(std::fs::read_to_string("/proc/loadavg")).split_whitespace().next().and_then(|l| l.parse().ok()),
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row that counts.
    pub fn good() -> RowOf {
        let round = |ms: f64| Round {
            pictures: 100,
            dropped: 0,
            wall_s: ms / 10.0,
            cpu_s: Some(2.0 * ms / 10.0),
            latency_ms: Some([ms, 1.2 * ms, 2.0 * ms]),
        };
        RowOf {
            task: Task::example(640, 480, 8),
            pictures_sha256: String::new(),
            scenario: Scenario::Offline,
            entry: "a".into(),
            rate_hz: None,
            rounds: [3.0, 1.0, 2.0, 9.0, 2.5].map(round).into(),
            accuracy: Some(Accuracy {
                points_a_picture: 600.0,
                found: Some(0.99),
                false_share: Some(0.001),
                false_a_picture: 0.6,
                median_px: Some(0.03),
                rms_px: Some(0.05),
                rms_mm: Some(0.02),
                beyond_three_sigma: Some(0.004),
            }),
            memory_mb: Some(50.0),
            failed: None,
        }
    }

    #[test]
    fn medians_are_of_the_rounds() {
        let row = good();
        assert_eq!(row.ms(), Some(2.5));
        assert!((row.cpu_ms().unwrap() - 5.0).abs() < 1e-12 && row.dropped() == 0.0);
        assert_eq!(row.latency_ms().unwrap(), [2.5, 3.0, 5.0]);
        assert_eq!(median([4.0, 1.0]), 2.5);
        assert!(median([]).is_nan());
    }

    #[test]
    fn every_rule_about_accuracy_is_held() {
        assert!(good().against().is_empty());
        let with = |change: fn(&mut Accuracy)| {
            let mut row = good();
            change(row.accuracy.as_mut().unwrap());
            row.against().len()
        };
        assert_eq!(with(|a| a.false_share = Some(0.151)), 1);
        assert_eq!(with(|a| a.rms_px = Some(0.51)), 1);
        assert_eq!(with(|a| a.rms_mm = Some(1.1)), 1);
        assert_eq!(with(|a| a.rms_mm = Some(f64::NAN)), 1);
        assert_eq!(with(|a| a.found = Some(0.79)), 1);
        assert_eq!(with(|a| (a.found, a.rms_px, a.rms_mm, a.false_share) = (None, None, None, None)), 4);
        assert_eq!(with(|a| a.points_a_picture = 0.0), 1);
        assert_eq!(RowOf { accuracy: None, ..good() }.against(), ["no accuracy"]);
        assert_eq!(RowOf { failed: Some("died".into()), ..good() }.against(), ["died"]);
        let dark = Task { scene: SceneKind::Dark, ..good().task };
        assert!(RowOf { task: dark, ..good() }.against().is_empty());
        let mut many = RowOf { task: dark, ..good() };
        many.accuracy.as_mut().unwrap().false_a_picture = 5.5;
        assert_eq!(many.against().len(), 1);
    }
}
