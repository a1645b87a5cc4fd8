//! In: archives of small simulated recordings. Out: `sheetlight batch` gives the same bytes in any number of shards,
//! however often a process is killed; what is wrong with a manifest or a folder is one clear error.
//! Frame and unit: none. SHEETLIGHT_LONG: 64 recordings instead of 8, and a manifest of a million lines.

use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

fn long() -> bool {
    std::env::var_os("SHEETLIGHT_LONG").is_some()
}

/// Recordings of the archive.
fn many() -> usize {
    if long() { 64 } else { 8 }
}

fn program<'a>(words: impl IntoIterator<Item = &'a str>) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
    command.args(words).arg("--quiet");
    command
}

fn output(mut command: Command) -> Output {
    command.output().expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn done(command: Command) -> Vec<Value> {
    let out = output(command);
    assert!(out.status.success(), "{}", text(&out.stderr));
    lines(&out)
}

fn lines(out: &Output) -> Vec<Value> {
    text(&out.stdout)
        .lines()
        .filter(|l| l.starts_with('{'))
        .map(|l| serde_json::from_str(l).expect("a line of JSON"))
        .collect()
}

/// The error of a command that fails so, with what it says at every line.
fn refused(command: Command, code: i32) -> String {
    let out = output(command);
    assert_eq!(out.status.code(), Some(code), "{}", text(&out.stderr));
    refused_by(out)
}

/// What a command says that has failed.
fn refused_by(out: Output) -> String {
    let said = text(&out.stderr);
    assert!(said.matches("error: ").count() == 1, "one error: {said}");
    assert!(said.contains("likely cause: ") && said.contains("next step: "), "{said}");
    said
}

/// A folder with `station`, `part.toml` and the archive: `recordings/N`, `manifest.txt`.
fn archive() -> &'static Path {
    static MADE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let dir = MADE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        make(dir.path(), many());
        dir
    });
    dir.path()
}

/// One simulated recording and copies of it, in which the robot reports other places.
fn make(folder: &Path, count: usize) {
    let at = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let rig = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/rigs/paper.toml");
    let (out, rig) = (at("sim"), rig.to_str().unwrap().to_owned());
    done(
        program(["simulate", "--out", &out, "--rig", &rig, "--seed", "3", "--width", "320"]).into_with("--set", "scan"),
    );
    std::fs::rename(at("sim/station"), at("station")).unwrap();
    std::fs::rename(at("sim/notched.toml"), at("part.toml")).unwrap();
    for k in 0..count {
        copy(&folder.join("sim/scan"), &folder.join(format!("recordings/{k}")), 0.05 * k as f64);
    }
    let (list, recordings) = (at("manifest.txt"), at("recordings"));
    done(program(["batch", "manifest", &recordings, "--out", &list]));
}

trait With {
    fn into_with(self, name: &str, value: &str) -> Self;
}

impl With for Command {
    fn into_with(mut self, name: &str, value: &str) -> Command {
        self.args([name, value]);
        self
    }
}

/// The same pictures with poses that are moved along the base's x, mm.
fn copy(from: &Path, to: &Path, x_mm: f64) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(|e| e.unwrap()) {
        let (path, name) = (entry.path(), entry.file_name().into_string().unwrap());
        if name.starts_with("poses") && name.ends_with(".json") {
            let mut read: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
            for pose in read["poses"].as_array_mut().unwrap() {
                let x = &mut pose["matrix"][3];
                *x = (x.as_f64().unwrap() + x_mm).into();
            }
            std::fs::write(to.join(name), read.to_string()).unwrap();
        } else if name.ends_with(".png") || name.ends_with(".json") {
            std::fs::copy(&path, to.join(name)).unwrap();
        }
    }
}

/// `sheetlight batch` on the archive into a folder.
fn batch(out: &Path) -> Command {
    of_manifest(&archive().join("manifest.txt"), out)
}

fn of_manifest(manifest: &Path, out: &Path) -> Command {
    let at = |name: &str| archive().join(name);
    let mut command = program(["batch", "--on", "cpu"]);
    command.arg(manifest).arg("--station").arg(at("station")).arg("--recipe").arg(at("part.toml"));
    command.arg("--out").arg(out);
    command
}

fn merge(out: &Path) -> Command {
    let mut command = program(["batch", "merge"]);
    command.arg(out);
    command
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// All files of a batch's folder; locks are of no batch.
fn files(folder: &Path) -> Files {
    let (mut open, mut found) = (vec![folder.to_owned()], Files::new());
    while let Some(at) = open.pop() {
        for path in std::fs::read_dir(&at).unwrap().map(|e| e.unwrap().path()) {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_none_or(|e| e != "lock") {
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), std::fs::read(&path).unwrap());
            }
        }
    }
    found
}

/// Several exposures of a pose are merged as `scan` merges them; another long exposure is another recording.
#[test]
fn recordings_of_several_exposures_give_what_a_scan_gives() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
    let (sim, archive, list) = (at("sim"), at("archive"), at("manifest.txt"));
    let simulate = ["simulate", "--out", &sim, "--width", "320", "--shots", "20", "--exposures", "0.2,1,5"];
    done(program(simulate).into_with("--set", "scan"));
    std::fs::create_dir(&archive).unwrap();
    std::fs::rename(at("sim/scan"), at("archive/one")).unwrap();
    done(program(["batch", "manifest", &archive, "--out", &list]));
    let station = at("sim/station");
    let (batched, scanned) = (at("batch"), at("scan"));
    done(program(["batch", &list, "--station", &station, "--out", &batched, "--on", "cpu"]));
    let one = at("archive/one");
    done(program(["scan", &one, "--station", &station, "--out", &scanned, "--on", "cpu"]));
    let found = files(Path::new(&batched));
    let key = &results(&found)[0];
    let theirs: Value = serde_json::from_slice(&found[&key.join("scan/scan.json")]).unwrap();
    let ours: Value = serde_json::from_slice(&std::fs::read(Path::new(&scanned).join("scan.json")).unwrap()).unwrap();
    assert_eq!(ours["exposures"]["pictures"], 60, "{}", ours["exposures"]);
    for figure in ["exposures", "points", "shots", "median_sigma_mm"] {
        assert!(
            ours[figure] == theirs[figure] && !ours[figure].is_null(),
            "{figure}: {} {}",
            ours[figure],
            theirs[figure]
        );
    }
    // The longest exposure of one pose is exchanged for that of another.
    let before = std::fs::read_to_string(&list).unwrap();
    std::fs::copy(at("archive/one/laser_0003_3.png"), at("archive/one/laser_0004_3.png")).unwrap();
    done(program(["batch", "manifest", &archive, "--out", &at("again.txt")]));
    assert_ne!(std::fs::read_to_string(at("again.txt")).unwrap(), before);
    let (again, out) = (at("again.txt"), at("batch2"));
    let failed = output(program(["batch", &again, "--station", &station, "--out", &out, "--on", "cpu"]));
    let said = text(&failed.stderr) + &text(&failed.stdout);
    assert!(said.contains("laser_0004.png") && said.contains("disagree"), "{said}");
}

/// The folder of a single run of the whole archive, and its files.
fn single() -> &'static (tempfile::TempDir, Files) {
    static MADE: OnceLock<(tempfile::TempDir, Files)> = OnceLock::new();
    MADE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let started = Instant::now();
        let said = done(batch(&dir.path().join("out")));
        let s = started.elapsed().as_secs_f64();
        println!("{} recordings in one run: {s:.1} s", many());
        assert_eq!(said.len(), many());
        assert!(said.iter().all(|l| l["state"] == "done" && l["made"] == true), "{said:?}");
        let files = files(&dir.path().join("out"));
        (dir, files)
    })
}

fn same(found: &Files, wanted: &Files) {
    let names = |files: &Files| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(wanted));
    let other: Vec<_> = found.iter().filter(|(name, bytes)| wanted[*name] != **bytes).map(|(n, _)| n).collect();
    assert!(other.is_empty(), "other bytes: {other:?}");
}

#[test]
fn shards_give_the_bytes_of_a_single_run_however_often_they_are_killed() {
    let wanted = &single().1;
    for name in ["batch.json", "manifest.txt", "recordings.parquet", "shots.parquet", "matches.parquet", "repeats.json"]
    {
        assert!(wanted.contains_key(Path::new(name)), "{name}");
    }
    for shards in [1, 2, 4] {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("elsewhere/out");
        let shard = |k: usize| {
            let mut command = batch(&out);
            // Other threads, another clock, another folder.
            command.args(["--shard", &format!("{k}/{shards}")]).env("RAYON_NUM_THREADS", shards.to_string());
            command
        };
        for kill in 0..3 {
            let mut child = shard(shards).stdout(Stdio::piped()).spawn().unwrap();
            let mut said = BufReader::new(child.stdout.take().unwrap()).lines();
            // In the middle of another recording each time.
            (0..=kill.min(many() / shards - 1)).for_each(|_| drop(said.next()));
            std::thread::sleep(Duration::from_millis(30 * kill as u64));
            child.kill().unwrap();
            child.wait().unwrap();
        }
        let all: Vec<_> = (1..=shards).map(|k| shard(k).stdout(Stdio::null()).spawn().unwrap()).collect();
        all.into_iter().for_each(|mut child| assert!(child.wait().unwrap().success()));
        let said = done(merge(&out));
        assert_eq!((said[0]["recordings"].as_u64(), said[0]["missing"].as_u64()), (Some(many() as u64), Some(0)));
        same(&files(&out), wanted);
        // A run over all of it does nothing, and says so.
        let again = done(batch(&out));
        assert!(again.iter().all(|l| l["made"] == false && l["state"] == "done"), "{again:?}");
        same(&files(&out), wanted);
    }
}

#[test]
fn results_hold_no_time_and_no_place() {
    let (dir, files) = single();
    let place = dir.path().to_str().unwrap();
    let year = text(
        &output({
            let mut date = Command::new("date");
            date.arg("-u").arg("+%Y-%m-%d");
            date
        })
        .stdout,
    );
    for (name, bytes) in files {
        let text = String::from_utf8_lossy(bytes);
        for word in [place, archive().to_str().unwrap(), year.trim()] {
            assert!(!text.contains(word), "{}: {word}", name.display());
        }
        if name.ends_with("scan.json") {
            let report: Value = serde_json::from_slice(bytes).unwrap();
            assert_eq!((&report["seconds"], &report["shots_per_second"]), (&0.0.into(), &0.0.into()), "{text}");
            assert_eq!((&report["created"], &report["ran_on"]), (&"1970-01-01T00:00:00Z".into(), &"".into()), "{text}");
        }
    }
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only debug builds can be stopped at a file operation")]
fn whatever_stops_a_run_leaves_whole_results_or_none() {
    let wanted = &single().1;
    let dir = tempfile::tempdir().unwrap();
    let step = if long() { 7 } else { 61 };
    for variable in ["SHEETLIGHT_DIE_AT", "SHEETLIGHT_FULL_AT"] {
        let out = dir.path().join(variable);
        let mut tries = 0;
        for at in (3..).step_by(step) {
            let mut command = batch(&out);
            command.env(variable, at.to_string());
            let ended = output(command);
            // Under a final name there is all of it.
            let found = files(&out);
            let half = |p: &Path| {
                p.starts_with("work") || p.to_string_lossy().contains(".sheetlight.") || p.starts_with("tables.part")
            };
            for (name, bytes) in found.iter().filter(|(n, _)| !half(n)) {
                let moving = name.strip_prefix("tables.whole").or(name.strip_prefix("tables.moving")).unwrap_or(name);
                assert!(wanted.get(moving) == Some(bytes), "{variable}={at}: {}", name.display());
            }
            for key in results(&found) {
                let whole = wanted.keys().filter(|n| n.starts_with(&key)).all(|n| found.contains_key(n));
                assert!(whole, "{variable}={at}: {} is half a result", key.display());
            }
            if variable == "SHEETLIGHT_FULL_AT" && !ended.status.success() {
                let said = text(&ended.stderr);
                assert!(said.contains("the disk is full") && said.contains("next step"), "{said}");
                let hosts = std::fs::read_dir(out.join("work")).into_iter().flatten();
                let work: usize = hosts.map(|h| std::fs::read_dir(h.unwrap().path()).unwrap().count()).sum();
                assert_eq!(work, 0, "{variable}={at}: something is left of what found no room");
            }
            tries += 1;
            if ended.status.success() {
                break;
            }
        }
        println!("{variable}: {tries} times");
        assert!(tries > 3, "{tries}");
        done(batch(&out));
        same(&files(&out), wanted);
    }
}

/// The folders of results.
fn results(found: &Files) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> =
        found.keys().filter(|n| n.starts_with("results")).map(|n| n.components().take(3).collect()).collect();
    all.dedup();
    all
}

#[test]
fn a_recording_is_named_by_what_sha256sum_prints() {
    let list = std::fs::read_to_string(archive().join("manifest.txt")).unwrap();
    let (hash, name) = list.lines().next().unwrap().split_once("  ").unwrap();
    assert_eq!(name, "recordings/0");
    let find = "find * -type f -print0 | LC_ALL=C sort -z | xargs -0 sha256sum | sha256sum";
    let mut bash = Command::new("bash");
    bash.args(["-c", find]).current_dir(archive().join(name));
    assert_eq!(text(&output(bash).stdout).split(' ').next(), Some(hash), "docs/archives.md shows this command");
}

/// A manifest beside the archive's with other lines.
fn other_manifest(name: &str, change: impl FnOnce(Vec<String>) -> Vec<String>) -> PathBuf {
    let text = std::fs::read_to_string(archive().join("manifest.txt")).unwrap();
    let path = archive().join(name);
    std::fs::write(&path, change(text.lines().map(str::to_owned).collect()).join("\n")).unwrap();
    path
}

#[test]
fn missing_and_changed_recordings_are_named_and_the_others_go_on() {
    let dir = tempfile::tempdir().unwrap();
    copy(&archive().join("recordings/1"), &archive().join("changed"), 0.0);
    let list = other_manifest("bad.txt", |l| {
        let second = l[1].replace("recordings/1", "changed");
        vec![l[0].clone(), second, format!("{}  gone", "a".repeat(64))]
    });
    std::fs::write(archive().join("changed/meta.json"), "{}").unwrap();
    let out = output(of_manifest(&list, dir.path()));
    assert_eq!(out.status.code(), Some(1));
    let said = lines(&out);
    let states: Vec<_> = said.iter().map(|l| l["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["done", "failed", "failed"]);
    let what = |k: usize| said[k]["problem"]["what"].as_str().unwrap().to_owned();
    assert!(what(1).contains("has the hash") && what(1).contains("its manifest says"), "{}", what(1));
    assert!(what(2).contains("there is no such folder"), "{}", what(2));
    assert!(said[1..].iter().all(|l| l["problem"]["cause"] != "" && l["problem"]["next"] != ""));
    assert!(text(&out.stderr).contains("2 of 3 recordings have no result to use"), "{}", text(&out.stderr));
    let error = refused(merge(dir.path()), 1);
    assert!(error.contains("2 of 3 recordings have no results; the first is changed"), "{error}");
    let csv = std::fs::read_to_string(dir.path().join("recordings.csv")).unwrap();
    assert_eq!((csv.lines().count(), csv.matches("no results").count()), (4, 2), "{csv}");
    assert_eq!(results(&files(dir.path())).len(), 1, "what failed has no folder");
}

#[test]
fn a_picture_that_is_cut_refuses_its_recording_unless_it_is_excluded() {
    let dir = tempfile::tempdir().unwrap();
    let cut = dir.path().join("cut");
    copy(&archive().join("recordings/1"), &cut, 0.0);
    let picture = cut.join("laser_0030.png");
    let bytes = std::fs::read(&picture).unwrap();
    std::fs::write(&picture, &bytes[..bytes.len() / 2]).unwrap();
    let run = |name: &str, more: &[&str]| {
        let mut command = program(["batch", "--on", "cpu"]);
        command.arg(&cut).arg("--recipe").arg(archive().join("part.toml")).args(more);
        command.arg("--station").arg(archive().join("station")).arg("--out").arg(dir.path().join(name));
        output(command)
    };
    let out = run("whole", &[]);
    let line = &lines(&out)[0];
    assert_eq!((out.status.code(), &line["state"]), (Some(1), &"refused".into()), "{line}");
    let problem = |key: &str| line["problem"][key].as_str().unwrap();
    assert!(problem("what").starts_with("recording/laser_0030.png: is not a readable picture"), "{line}");
    assert!(problem("next").contains("--skip-bad") && !problem("what").contains("kept"), "{line}");
    let out = run("most", &["--skip-bad"]);
    let line = &lines(&out)[0];
    assert_eq!((out.status.code(), &line["state"]), (Some(0), &"done".into()), "{line}");
    let scan = dir.path().join("most").join(line["results"].as_str().unwrap()).join("scan/scan.json");
    let scan = std::fs::read_to_string(scan).unwrap();
    assert!(scan.contains("laser_0030.png") && !scan.contains(dir.path().to_str().unwrap()), "{scan}");
    // Results with excluded pictures are others: a batch of one kind does not take those of the other.
    let other = refused_by(run("most", &[]));
    assert!(other.contains("its settings is"), "{other}");
}

#[test]
fn a_refusal_is_a_result_and_the_others_go_on() {
    let dir = tempfile::tempdir().unwrap();
    // Another part's recipe.
    let recipe = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes/led.toml");
    let run = || {
        let mut command = program(["batch", "--on", "cpu"]);
        command.arg(archive().join("recordings/2")).arg(archive().join("recordings/0")).arg(dir.path().join("none"));
        command.arg("--recipe").arg(&recipe);
        command.arg("--station").arg(archive().join("station")).arg("--out").arg(dir.path().join("out"));
        output(command)
    };
    let out = run();
    assert_eq!(out.status.code(), Some(1));
    let said = lines(&out);
    let states: Vec<_> = said.iter().map(|l| l["state"].as_str().unwrap()).collect();
    assert_eq!(states, ["failed", "refused", "refused"], "{said:?}");
    assert!(said[1]["problem"]["what"].as_str().unwrap().contains("was not found"), "{said:?}");
    let first = files(&dir.path().join("out"));
    assert_eq!(results(&first).len(), 2);
    let again = lines(&run());
    assert!(again[1..].iter().all(|l| l["made"] == false), "{again:?}");
    same(&files(&dir.path().join("out")), &first);
}

#[test]
fn wrong_use_is_refused_with_one_error() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let twice = other_manifest("twice.txt", |l| vec![l[0].clone(), l[1].clone(), l[0].clone()]);
    let error = refused(of_manifest(&twice, &out), 1);
    assert!(error.contains("lines 1 and 3 name one folder"), "{error}");
    let copied = other_manifest("copied.txt", |l| vec![l[0].clone(), l[0].replace("recordings/0", "copy")]);
    let error = refused(of_manifest(&copied, &out), 1);
    assert!(error.contains("lines 1 and 2 have one hash"), "{error}");
    let error = refused(of_manifest(&archive().join("part.toml"), &out), 1);
    assert!(error.contains("line 2 is not a hash and a folder"), "{error}");
    assert!(!out.exists(), "nothing was begun");
    // Two batches into one folder: another manifest, other settings.
    done(batch(&out).into_with("--shard", "1/8"));
    let less = other_manifest("less.txt", |l| l[1..].to_vec());
    let error = refused(of_manifest(&less, &out), 2);
    assert!(error.contains("contains another batch: its manifest is"), "{error}");
    let error = refused(batch(&out).into_with("--set", "threshold.minimum=14"), 2);
    assert!(error.contains("contains another batch: its settings is"), "{error}");
    let error = refused(of_manifest(&less, &archive().join("recordings/0")), 2);
    assert!(error.contains("is a recording"), "{error}");
    let error = refused(merge(dir.path()), 1);
    assert!(error.contains("contains no batch.json"), "{error}");
    let error = refused(merge(&out), 1);
    assert!(
        error.contains(&format!("{} of {} recordings have no results", many() - many().div_ceil(8), many())),
        "{error}"
    );
    let bad = output(batch(&out).into_with("--shard", "9/8"));
    assert_eq!(bad.status.code(), Some(2));
    assert!(text(&bad.stderr).contains("shard 9 of 8: the first is 1, the last 8"), "{}", text(&bad.stderr));
    // A result that somebody edited.
    let result = out.join(&results(&files(&out))[0]).join("result.json");
    let edited = std::fs::read_to_string(&result).unwrap().replacen("\"format\": 1", "\"format\": 2", 1);
    std::fs::write(&result, edited).unwrap();
    let error = refused(merge(&out), 1);
    assert!(error.contains("is not the result that its folder's name says"), "{error}");
}

/// The largest memory of a process, MB.
fn peak_mb(command: &mut Command) -> (f64, f64) {
    let started = Instant::now();
    let mut child = command.stdout(Stdio::null()).spawn().unwrap();
    let mut peak = 0.0_f64;
    let status = format!("/proc/{}/status", child.id());
    while child.try_wait().unwrap().is_none() {
        let read = std::fs::read_to_string(&status).unwrap_or_default();
        let kb = read.lines().find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.trim().parse().ok());
        peak = peak.max(kb.unwrap_or(0.0) / 1e3);
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(child.wait().unwrap().success());
    (peak, started.elapsed().as_secs_f64())
}

/// docs/archives.md has what this prints.
#[test]
#[cfg_attr(not(target_os = "linux"), ignore = "memory is read from /proc")]
fn a_manifest_of_a_million_lines_is_planned_in_little_memory() {
    let sizes: &[u32] = if long() { &[1_000, 10_000, 100_000, 1_000_000] } else { &[1_000, 100_000] };
    for &size in sizes {
        let dir = tempfile::tempdir().unwrap();
        let list = dir.path().join("manifest.txt");
        let line =
            |k: u32| format!("{k:08x}{}  archive/2026/station-{:02}/recording-{k:07}\n", "ab".repeat(28), k % 20);
        std::fs::write(&list, (0..size).map(line).collect::<String>()).unwrap();
        let out = dir.path().join("out");
        let (first, first_s) = peak_mb(of_manifest(&list, &out).arg("--plan"));
        let (second, second_s) = peak_mb(of_manifest(&list, &out).arg("--plan"));
        println!(
            "{size} recordings: planned in {first_s:.2} s and {first:.0} MB, again {second_s:.2} s, {second:.0} MB"
        );
        let limit = if size > 100_000 { (300.0, 60.0) } else { (120.0, 20.0) };
        assert!(first.max(second) < limit.0 && first_s.max(second_s) < limit.1, "limits: {limit:?} MB, s");
    }
}
