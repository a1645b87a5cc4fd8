//! In: entries that keep the format of docs/benchmark.md, and such that break it. Out: rows with a result or the reason
//! for none; comparison, rules and page of the same file. Frame and unit: px, ms a picture.

use std::path::Path;
use std::process::{Command, Output};

const PROGRAM: &str = env!("CARGO_BIN_EXE_sheetlight");

fn bench(folder: &Path, words: &[&str]) -> Output {
    Command::new(PROGRAM).args(["--quiet", "bench"]).args(words).current_dir(folder).output().unwrap()
}

fn done(folder: &Path, words: &[&str]) -> String {
    let out = bench(folder, words);
    assert!(out.status.success(), "{words:?}: {}", String::from_utf8_lossy(&out.stderr));
    String::from_utf8(out.stdout).unwrap()
}

/// The row of an entry in a scenario.
fn row<'a>(results: &'a serde_json::Value, entry: &str, scenario: &str) -> &'a serde_json::Value {
    let rows = results["rows"].as_array().unwrap();
    rows.iter().find(|r| r["entry"] == entry && r["scenario"] == scenario).unwrap()
}

/// A program for the shell that says hello and then does what `rest` says.
fn script(folder: &Path, name: &str, rest: &str) -> String {
    let path = folder.join(name);
    let hello = r#"{\"name\":\"script\"}"#;
    std::fs::write(&path, format!("read header\nprintf '%s\\n' \"{hello}\"\n{rest}\n")).unwrap();
    format!("{name}=sh {}", path.display())
}

#[test]
fn entries_take_turns_and_what_breaks_the_format_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let cpu = format!("cpu={PROGRAM} bench entry --on cpu");
    let open = format!("open={PROGRAM} bench entry --on cpu --quiet 2>/dev/null # {{scene}}");
    let pipe = format!("pipe={PROGRAM} bench entry --nothing");
    let bad = [
        ("dies", script(at, "dies", "exit 3"), "it ended with exit status: 3"),
        ("mute", "mute=true".to_owned(), "it wrote no first line"),
        ("chatty", "chatty=echo hello".to_owned(), "its first line \"hello"),
        // Number 7 where 0 is next, without points.
        ("other", script(at, "other", r"printf '\007\0\0\0\0\0\0\0'; cat > rest"), "it answered picture 7 where 0"),
        (
            "many",
            script(at, "many", r"printf '\0\0\0\0\377\377\377\377'; cat > rest"),
            "4294967295 points for picture 0",
        ),
        ("short", script(at, "short", r"printf '\0\0\0\0\1\0\0\0xyz'; exit 0"), "its output ends within 1 points"),
        ("speaks", script(at, "speaks", "echo no licence >&2; exit 1"), "stderr: no licence"),
        ("prints", script(at, "prints", "echo found 12 points; cat > rest"), "these bytes are text: \"found 12\""),
        ("absent", "absent=/no/such/program".to_owned(), "not found"),
    ];
    let mut words = vec!["run", "--scene", "clean", "--rounds", "2", "--seconds", "0.05", "--out", "r.json"];
    words.extend(["--size", "320x240", "--scenario", "single", "--scenario", "offline"]);
    words.extend(["--scenario", "camera", "--scenario", "streams", "--rate", "50"]);
    let all = [&cpu, &open, &pipe].into_iter().chain(bad.iter().map(|b| &b.1));
    words.extend(all.flat_map(|entry| ["--entry", entry.as_str()]));
    let out = bench(at, &words);
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    // Programs that failed are no success, and the others are stored.
    assert!(out.status.code() == Some(1) && said.contains("36 of 48 rows have no result"), "{said}");
    let table = String::from_utf8(out.stdout).unwrap();
    let results: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(at.join("r.json")).unwrap()).unwrap();
    for scenario in ["single", "offline", "camera", "streams"] {
        for entry in ["cpu", "open"] {
            let r = row(&results, entry, scenario);
            assert_eq!(r["failed"], serde_json::Value::Null, "{r}");
            assert_eq!(r["rounds"].as_array().unwrap().len(), 2);
            let a = &r["accuracy"];
            // Free ends of the stripe make the tail: at 320 columns 0.05 px rms, 0.012 px without them.
            assert!(a["found"].as_f64().unwrap() > 0.98 && a["rms_px"].as_f64().unwrap() < 0.08, "{r}");
            // Live pictures are measured with what the first one showed of the stripe. A few of these 32 small pictures
            // seem to have speckle, and then the median is 0.022 px.
            assert!(a["median_px"].as_f64().unwrap() < 0.03 && a["rms_mm"].as_f64().unwrap() < 0.09, "{r}");
            assert!(a["beyond_three_sigma"].as_f64().unwrap() < 0.06, "{r}");
            let cpu_s: f64 = r["rounds"].as_array().unwrap().iter().map(|r| r["cpu_s"].as_f64().unwrap()).sum();
            assert!(cpu_s > 0.0 && r["memory_mb"].as_f64().unwrap() > 5.0, "{r}");
            assert_eq!(r["rounds"][0]["latency_ms"].is_array(), ["single", "camera"].contains(&scenario), "{r}");
        }
        // Four processes share the work, so each picture counts four times.
        let pictures = |entry| row(&results, entry, scenario)["rounds"][0]["pictures"].as_u64().unwrap();
        assert_eq!(pictures("cpu") % if scenario == "streams" { 4 } else { 1 }, 0);
        for (entry, _, want) in &bad {
            let r = row(&results, entry, scenario);
            let failed = r["failed"].as_str().unwrap_or_else(|| panic!("{r}"));
            assert!(failed.contains(want) && r["accuracy"].is_null(), "{entry}, {scenario}: {failed}");
        }
    }
    assert!(row(&results, "cpu", "camera")["rate_hz"] == 50.0);
    let closed = |i: usize| results["entries"][i]["closed"].as_bool().unwrap();
    assert!(closed(0) && !closed(1) && results["entries"][0]["says"]["name"] == "Sheetlight");
    assert_eq!(table.matches("does not count: no points returned").count(), 4, "{table}");

    let compared = done(at, &["compare", "r.json", "cpu", "open"]);
    assert_eq!(compared.lines().filter(|l| l.starts_with("clean")).count(), 4, "{compared}");
    done(at, &["compare", "r.json", "cpu", "open", "--at-most", "1000"]);
    let slow = bench(at, &["compare", "r.json", "cpu", "open", "--at-most", "0.01"]);
    assert!(slow.status.code() == Some(1), "{slow:?}");
    // No ratio without accuracy: that is not "fast enough".
    let none = bench(at, &["compare", "r.json", "cpu", "pipe", "--at-most", "1000"]);
    assert!(none.status.code() == Some(1), "{none:?}");
    let rules = bench(at, &["verify", "r.json"]);
    let found = String::from_utf8(rules.stdout).unwrap();
    assert_eq!(rules.status.code(), Some(1));
    for want in ["rows have 2 rounds or more, 9 are needed", "no row for dim, speckle, thick"] {
        assert!(found.contains(want), "{found}");
    }
    assert!(!found.contains("were others") && !found.contains("not described"), "{found}");
    done(at, &["html", "r.json", "--out", "r.html"]);
    let page = std::fs::read_to_string(at.join("r.html")).unwrap();
    assert!(page.contains("open (open)") && page.contains("stderr: no licence"), "{page}");
}

#[test]
fn a_program_that_does_not_answer_is_named_once() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let keeps = script(at, "keeps", "cat > rest");
    let short = script(at, "short", r"printf '\0\0\0\0\1\0\0\0abcd'; cat > rest");
    let mut words = vec!["run", "--scene", "clean", "--scene", "dark", "--size", "64x64", "--scenario", "single"];
    words.extend(["--rounds", "1", "--timeout", "0.5", "--out", "r.json", "--entry", &keeps, "--entry", &short]);
    let out = bench(at, &words);
    assert_eq!(out.status.code(), Some(1));
    let results: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(at.join("r.json")).unwrap()).unwrap();
    let failed = |i: usize| results["rows"][i]["failed"].as_str().unwrap().to_owned();
    assert_eq!(failed(0), "no reply in 0.5 s, 0 bytes came: is its output flushed?");
    assert!(failed(1).contains("no reply in 0.5 s, 12 bytes came of a reply that is too short"), "{}", failed(1));
    assert!(failed(2).starts_with("not run after clean 64x64 8 bit: no reply"), "{}", failed(2));
}

/// What counts is what was returned in all rounds: an entry that works in one round of eight, or copies one good point,
/// gains nothing.
#[test]
fn rounds_without_points_are_scored_too() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // Passes everything through to a real entry and throws its points away after the two passes before the rounds.
    let lazy = format!("lazy=sh -c '{PROGRAM} bench entry --on cpu | python3 lazy.py'");
    std::fs::write(
        at.join("lazy.py"),
        "import sys\n\
         source, sink = sys.stdin.buffer, sys.stdout.buffer\n\
         sink.write(source.readline())\n\
         sink.flush()\n\
         answered = 0\n\
         while head := source.read(8):\n    \
             points = source.read(24 * int.from_bytes(head[4:], 'little'))\n    \
             answered += 1\n    \
             sink.write(head + points if answered <= 100 else head[:4] + bytes(4))\n    \
             sink.flush()\n",
    )
    .unwrap();
    let mut words = vec!["run", "--scene", "clean", "--size", "320x240", "--scenario", "offline"];
    words.extend(["--rounds", "4", "--seconds", "0.05", "--out", "r.json", "--entry", &lazy]);
    let table = done(at, &words);
    assert!(table.contains("does not count: "), "{table}");
}

#[test]
fn a_slow_program_drops_pictures_of_a_camera_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    // Ten pictures a second at most, of 200 that come.
    let lines = [
        "while n=$(dd bs=4 count=1 iflag=fullblock 2>/dev/null | od -An -tu4); [ -n \"$n\" ]; do",
        "dd bs=4096 count=1 iflag=fullblock > /dev/null 2>&1; sleep 0.1",
        "printf \"$(printf '\\\\%03o\\\\%03o\\\\0\\\\0\\\\0\\\\0\\\\0\\\\0' $((n % 256)) $((n / 256 % 256)))\"; done",
    ];
    let slow = script(at, "slow", &lines.join("\n"));
    let mut words = vec!["run", "--scene", "dark", "--size", "64x64", "--scenario", "camera", "--rate", "200"];
    words.extend(["--rounds", "1", "--seconds", "1", "--out", "r.json", "--entry", &slow]);
    done(at, &words);
    let results: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(at.join("r.json")).unwrap()).unwrap();
    let r = row(&results, "slow", "camera");
    assert_eq!(r["failed"], serde_json::Value::Null, "{r}");
    let of = |key: &str| r["rounds"][0][key].as_u64().unwrap();
    assert_eq!(of("pictures") + of("dropped"), 200, "{r}");
    assert!(of("pictures") <= 40 && of("dropped") >= 160, "{r}");
}

#[test]
fn wrong_options_and_files_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = dir.path();
    let refused = |words: &[&str], want: &str| {
        let out = bench(at, words);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && said.contains(want), "{words:?}: {said}");
    };
    let run = |more: &[&str], want: &str| refused(&[&["run", "--out", "r.json"], more].concat(), want);
    run(&["--entry", "nothing"], "is not NAME=COMMAND");
    run(&["--entry", "a=true", "--entry", "a=false"], "two entries are called a");
    run(&["--entry", "a=true", "--rounds", "0"], "0 rounds");
    run(&["--entry", "a=true", "--seconds", "nan"], "seconds a round");
    run(&["--entry", "a=true", "--size", "8x8"], "64 to 8192");
    run(&["--entry", "a=true", "--bits", "7"], "7");
    run(&["--entry", "a=true", "--rate", "0"], "pictures a second");
    run(&["--entry", "a=true", "--timeout", "0"], "a timeout of 0 s");
    run(&["--entry", "a=true", "--scene", "clen"], "unknown scene 'clen': clean, dim, speckle");
    run(&["--entry", "a=true", "--scenario", "live"], "unknown scenario 'live': single, offline, camera, streams");
    std::fs::write(at.join("x.json"), "{}").unwrap();
    refused(&["verify", "x.json"], "is not a result of the benchmark");
    refused(&["compare", "none.json", "a", "b"], "none.json");
}
