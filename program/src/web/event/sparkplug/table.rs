//! In: what was last seen of bar and jobs. Out: the metrics of a station. Births, data and docs/connections.md have
//! them from this table.
//! Frame and unit: as each row states.

use super::payload::{Value, datatype};
use super::seen::Seen;
use serde_json::Value as Json;

/// A metric.
pub struct Row {
    /// Its name.
    pub name: &'static str,
    /// Its unit; empty: it has none.
    pub unit: &'static str,
    /// Its description.
    pub what: &'static str,
    read: Read,
}

/// How a value is read; `None`: it is not known.
enum Read {
    Flag(fn(&Seen) -> Option<bool>),
    Count(fn(&Seen) -> Option<i64>),
    Number(fn(&Seen) -> Option<f64>),
    Text(fn(&Seen) -> Option<String>),
}

use Read::{Count, Flag, Number, Text};

impl Row {
    /// Number of its data type.
    pub fn datatype(&self) -> u32 {
        match self.read {
            Flag(_) => datatype::BOOLEAN,
            Count(_) => datatype::INT64,
            Number(_) => datatype::DOUBLE,
            Text(_) => datatype::STRING,
        }
    }

    /// Its present value; `None` if that is unknown.
    pub fn value(&self, seen: &Seen) -> Option<Value> {
        match self.read {
            Flag(read) => read(seen).map(Value::Boolean),
            // The wire has negative numbers as their two's complement.
            Count(read) => read(seen).map(|n| Value::Long(n as u64)),
            Number(read) => read(seen).filter(|x| x.is_finite()).map(Value::Double),
            Text(read) => read(seen).map(Value::Text),
        }
    }
}

const fn row(name: &'static str, unit: &'static str, what: &'static str, read: Read) -> Row {
    Row { name, unit, what, read }
}

/// All metrics of a station, in the order in which they are published. Figures that change with each reading are
/// rounded, because every change is published.
pub const ROWS: &[Row] = &[
    row("Station/Name", "", "name in `station.toml`", Text(|s| text(&s.bar, "/station"))),
    row("Station/Mode", "", "`live`, `replay` or `simulated`", Text(|s| text(&s.bar, "/mode"))),
    row("Station/Version", "", "version of the program", Text(|_| Some(env!("CARGO_PKG_VERSION").into()))),
    row("Robot/Linked", "", "the robot answers", Flag(|s| robot(s).map(|is| is != "no_link"))),
    row("Robot/Armed", "", "motions may be confirmed", Flag(|s| robot(s).map(|is| is == "armed" || is == "moving"))),
    row("Robot/Moving", "", "the robot moves", Flag(|s| robot(s).map(|is| is == "moving"))),
    row("Laser/On", "", "line or pointer is on; null if no link reports it", Flag(|s| flag(&s.bar, "/laser"))),
    row("Camera/Rate", "Hz", "pictures that the camera sends", Number(|s| s.rate_hz.map(tenths))),
    row("Shots/Seen", "", "pictures of the present scan or view", Count(|s| count(&s.bar, "/frames/seen"))),
    row("Shots/Measured", "", "those with at least one point", Count(|s| count(&s.bar, "/frames/measured"))),
    row("Shots/Dropped", "", "those that were skipped", Count(dropped)),
    row("Delay/Median", "ms", "from a picture to its points", Number(|s| delay_ms(s, 0))),
    row("Delay/P99", "ms", "the same, exceeded by one of 100", Number(|s| delay_ms(s, 1))),
    row("Calibration/Age", "d", "age of the oldest calibration", Number(age_days)),
    row(
        "Calibration/ExpectedError",
        "mm",
        "expected error of all calibrations together, 1 sigma",
        Number(|s| number(&s.bar, "/calibration/expected_mm")),
    ),
    row("Calibration/Verdict", "", "the worst verdict", Text(|s| text(&s.bar, "/calibration/verdict"))),
    row("Disk/Free", "B", "free on the disk that holds the jobs", Count(disk_free)),
    row("Memory/Used", "B", "memory of the program", Count(memory)),
    row("Viewers/Count", "", "browsers that are connected", Count(|s| count(&s.bar, "/viewers"))),
    row("Alarms/Count", "", "alarms that the bar shows", Count(|s| alarms(s).map(|all| all.len() as i64))),
    row("Alarms/Text", "", "the alarms, one a line", Text(|s| alarms(s).map(|all| all.join("\n")))),
    row("Job/Id", "", "the job that runs, or that changed last", Text(|s| text(&s.job, "/id"))),
    row("Job/Procedure", "", "such as `scan`, `find`, `insert`", Text(|s| text(&s.job, "/order/procedure"))),
    row(
        "Job/State",
        "",
        "`queued`, `running`, `done`, `failed`, `stopped`, `cut_off`",
        Text(|s| text(&s.job, "/state")),
    ),
    row("Job/Done", "", "its steps that are done", Count(|s| count(&s.job, "/done"))),
    row("Job/Total", "", "its steps; null while unknown", Count(|s| count(&s.job, "/of"))),
    row("Job/Error", "", "why it failed; null otherwise", Text(|s| text(&s.job, "/problem/what"))),
    row("Result/Job", "", "the last job that found or inserted a part", Text(|s| text(&s.result, "/id"))),
    row("Result/Recipe", "", "its recipe", Text(|s| text(s.part(), "/recipe"))),
    row("Result/Passed", "", "every gate passed", Flag(|s| flag(s.part(), "/passed"))),
    row("Result/Score", "", "score of the match, 0 to 1", Number(|s| number(s.part(), "/score"))),
    row("Result/Frame", "", "frame of the pose", Text(|s| text(s.part(), "/frame"))),
    row("Result/X", "mm", "the inserting tool along x; null if a gate failed", Number(|s| pose(s, 0))),
    row("Result/Y", "mm", "the same, along y", Number(|s| pose(s, 1))),
    row("Result/Z", "mm", "the same, along z", Number(|s| pose(s, 2))),
    row("Result/A", "deg", "its rotation about z: Rz(A)·Ry(B)·Rx(C)", Number(|s| pose(s, 3))),
    row("Result/B", "deg", "the same, about y", Number(|s| pose(s, 4))),
    row("Result/C", "deg", "the same, about x", Number(|s| pose(s, 5))),
    row(
        "Result/WithinTolerance",
        "",
        "3 sigma lie within the recipe's tolerances",
        Flag(|s| flag(s.part(), "/within_tolerance")),
    ),
    row(
        "Result/Complete",
        "",
        "false: a term is unknown, and the deviations below are lower bounds",
        Flag(|s| flag(s.part(), "/complete")),
    ),
    row("Result/SigmaX", "mm", "standard deviation along the part's x", Number(|s| number(s.part(), "/sigma_mm/0"))),
    row("Result/SigmaY", "mm", "the same, along y", Number(|s| number(s.part(), "/sigma_mm/1"))),
    row("Result/SigmaZ", "mm", "the same, along z", Number(|s| number(s.part(), "/sigma_mm/2"))),
    row("Result/SigmaRx", "deg", "standard deviation about the part's x", Number(|s| number(s.part(), "/sigma_deg/0"))),
    row("Result/SigmaRy", "deg", "the same, about y", Number(|s| number(s.part(), "/sigma_deg/1"))),
    row("Result/SigmaRz", "deg", "the same, about z", Number(|s| number(s.part(), "/sigma_deg/2"))),
    row("Scan/Job", "", "the last finished scan", Text(|s| text(&s.scan, "/id"))),
    row("Scan/Shots", "", "its shots, skipped ones included", Count(|s| count(&s.scan, "/outcome/shots"))),
    row("Scan/Points", "", "its points", Count(|s| count(&s.scan, "/outcome/points"))),
    row(
        "Scan/Sigma",
        "mm",
        "median of their standard deviations",
        Number(|s| number(&s.scan, "/outcome/median_sigma_mm")),
    ),
    row(
        "Scan/Coverage",
        "",
        "measured part of the height map, 0 to 1",
        Number(|s| number(&s.scan, "/outcome/coverage")),
    ),
];

fn text(from: &Json, at: &str) -> Option<String> {
    from.pointer(at)?.as_str().map(str::to_owned)
}

fn flag(from: &Json, at: &str) -> Option<bool> {
    from.pointer(at)?.as_bool()
}

fn count(from: &Json, at: &str) -> Option<i64> {
    from.pointer(at)?.as_i64()
}

fn number(from: &Json, at: &str) -> Option<f64> {
    from.pointer(at)?.as_f64()
}

fn tenths(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}

fn robot(seen: &Seen) -> Option<&str> {
    seen.bar.pointer("/robot")?.as_str()
}

fn dropped(seen: &Seen) -> Option<i64> {
    seen.bar.pointer("/frames/dropped")?.as_object().map(|all| all.values().filter_map(Json::as_i64).sum())
}

fn delay_ms(seen: &Seen, which: usize) -> Option<f64> {
    seen.bar.pointer("/delay_ms")?.get(which)?.as_f64().map(tenths)
}

fn age_days(seen: &Seen) -> Option<f64> {
    number(&seen.bar, "/calibration/days").map(tenths)
}

/// Bytes of the disk, in whole 10 MB.
fn disk_free(seen: &Seen) -> Option<i64> {
    number(&seen.bar, "/disk_left_gb").map(|gb| (gb * 1e2).floor() as i64 * 10_000_000)
}

/// Bytes of memory, in whole 10 MB.
fn memory(seen: &Seen) -> Option<i64> {
    number(&seen.bar, "/memory_mb/0").map(|mb| (mb * 1e-1).floor() as i64 * 10_000_000)
}

fn alarms(seen: &Seen) -> Option<Vec<&str>> {
    seen.bar.pointer("/alarms")?.as_array().map(|all| all.iter().filter_map(Json::as_str).collect())
}

/// A number of the insertion pose in one convention for all robots, because names and units of metrics are fixed.
fn pose(seen: &Seen, which: usize) -> Option<f64> {
    let notations = seen.part().pointer("/poses/notations")?.as_array()?;
    notations.iter().find(|n| n["name"] == "kuka")?["numbers"].get(which)?.as_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use sheetlight::robot::Convention;
    use std::collections::BTreeSet;

    fn of(seen: &Seen, name: &str) -> Option<Value> {
        ROWS.iter().find(|row| row.name == name).unwrap().value(seen)
    }

    #[test]
    fn a_name_is_there_once_and_nothing_is_known_at_first() {
        let names: BTreeSet<&str> = ROWS.iter().map(|row| row.name).collect();
        assert_eq!(names.len(), ROWS.len());
        for row in ROWS.iter().filter(|row| row.name != "Station/Version") {
            assert_eq!(row.value(&Seen::default()), None, "{}", row.name);
        }
    }

    #[test]
    fn the_document_has_these_rows() {
        let words = |datatype| match datatype {
            datatype::BOOLEAN => "Boolean",
            datatype::INT64 => "Int64",
            datatype::DOUBLE => "Double",
            _ => "String",
        };
        let line = |row: &Row| format!("| `{}` | {} | {} | {} |", row.name, words(row.datatype()), row.unit, row.what);
        let table: Vec<String> = ROWS.iter().map(|row| line(row).replace("  ", " ")).collect();
        let document = include_str!("../../../../../docs/connections.md").replace("  ", " ");
        assert!(document.contains(&table.join("\n")), "docs/connections.md lacks:\n{}", table.join("\n"));
    }

    #[test]
    fn figures_of_the_bar_keep_their_units() {
        let bar = json!({
            "robot": "armed", "laser": null, "frames": {"seen": 7, "dropped": {"dark": 2, "late": 1}},
            "delay_ms": [1.26, 9.0], "calibration": {"days": 3.123456, "expected_mm": null}, "disk_left_gb": 12.345678,
            "memory_mb": [123.4, 200.0], "alarms": ["one", "two"],
        });
        let seen = Seen { bar, rate_hz: Some(29.97), ..Seen::default() };
        for (name, wanted) in [
            ("Robot/Linked", Some(Value::Boolean(true))),
            ("Robot/Armed", Some(Value::Boolean(true))),
            ("Robot/Moving", Some(Value::Boolean(false))),
            ("Laser/On", None),
            ("Camera/Rate", Some(Value::Double(30.0))),
            ("Shots/Seen", Some(Value::Long(7))),
            ("Shots/Dropped", Some(Value::Long(3))),
            ("Delay/Median", Some(Value::Double(1.3))),
            ("Delay/P99", Some(Value::Double(9.0))),
            ("Calibration/Age", Some(Value::Double(3.1))),
            ("Calibration/ExpectedError", None),
            ("Disk/Free", Some(Value::Long(12_340_000_000))),
            ("Memory/Used", Some(Value::Long(120_000_000))),
            ("Alarms/Count", Some(Value::Long(2))),
            ("Alarms/Text", Some(Value::Text("one\ntwo".into()))),
        ] {
            assert_eq!(of(&seen, name), wanted, "{name}");
        }
    }

    #[test]
    fn a_pose_is_written_in_the_one_convention_whatever_the_robot_has() {
        let notations: Vec<Json> = Convention::ALL
            .iter()
            .map(|c| json!({"name": c.name(), "numbers": [1.0, 2.0, 3.0, 4.0, 5.0, f64::from(c.name() == "kuka")]}))
            .collect();
        let poses = json!({"notations": notations});
        let found = json!({"score": 0.75, "passed": true, "poses": poses, "sigma_mm": [0.1, 0.2, 0.3]});
        let inserted = json!({"procedure": "insert", "found": found.clone()});
        let mut looked = found;
        looked["procedure"] = "find".into();
        for outcome in [inserted, looked] {
            let seen = Seen { result: json!({"id": "7", "outcome": outcome}), ..Seen::default() };
            assert_eq!(of(&seen, "Result/X"), Some(Value::Double(1.0)));
            assert_eq!(of(&seen, "Result/C"), Some(Value::Double(1.0)));
            assert_eq!(of(&seen, "Result/SigmaZ"), Some(Value::Double(0.3)));
            assert_eq!(of(&seen, "Result/Score"), Some(Value::Double(0.75)));
        }
        assert_eq!(Convention::Kuka.labels(), ["X mm", "Y mm", "Z mm", "A deg", "B deg", "C deg"]);
        let missed = Seen { result: json!({"outcome": {"procedure": "find", "poses": null}}), ..Seen::default() };
        assert_eq!(of(&missed, "Result/X"), None);
    }
}
