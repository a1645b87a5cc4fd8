//! In: the program and a simulated station. Out: failure where its screen lets somebody in, loses a job, cannot be
//! operated through its real pages, or is described otherwise than it is.
//! Frame and unit: mm, degrees, px.

mod common;

use common::sheetlight;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

fn source(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join(name)
}

/// A station that scanned a part of the board that is simulated by default; all of it where pictures for the
/// documents are made.
fn station(whole: bool) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().to_str().unwrap();
    let scene = dir.path().join("scene.toml");
    let text = std::fs::read_to_string(source("data/scenes/board.toml")).unwrap();
    let small = text.replace("region_mm = [-52, -38, 52, 38]", "region_mm = [-52, 0, 4, 28]");
    assert_ne!(text, small, "the scene is another one");
    std::fs::write(&scene, if whole { text } else { small }).unwrap();
    let (shots, sets) =
        if whole { ("200", "scan,surface,intrinsics,laserplane") } else { ("70", "scan,surface,intrinsics") };
    let scene = scene.to_str().unwrap();
    sheetlight(&[
        "--quiet", "simulate", "--out", out, "--set", sets, "--seed", "3", "--shots", shots, "--scene", scene,
    ]);
    std::fs::write(dir.path().join("station/station.toml"), "name = \"cell 3\"\nrobot = \"denso\"\n").unwrap();
    dir
}

/// A copy for each test: each has its own jobs.
fn copy() -> tempfile::TempDir {
    static MADE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let made = MADE.get_or_init(|| station(false));
    let dir = tempfile::tempdir().unwrap();
    let done = Command::new("cp").arg("-r").arg(made.path().join(".")).arg(dir.path()).status().unwrap();
    assert!(done.success());
    dir
}

/// Runs a script of tests/web or examples with the program and a folder; false where what it needs is not here.
fn python(script: &str, args: &[&str]) -> bool {
    let run = Command::new("python3").arg(source(script)).args(args).env("PYTHONDONTWRITEBYTECODE", "1").output();
    let why = match run {
        Ok(done) if done.status.success() => {
            print!("{}", String::from_utf8_lossy(&done.stdout));
            return true;
        }
        Ok(done) if done.status.code() == Some(77) => String::from_utf8_lossy(&done.stdout).into_owned(),
        Ok(done) => {
            panic!("{script}\n{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr))
        }
        Err(e) => format!("python3: {e}"),
    };
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{script} did not run: {why}");
    eprintln!(
        "\n*** SKIPPED: {script} needs python3, openssl, chromium and chromedriver (tools/browser.sh), and a broker \
         (tools/cameras.sh): {why} ***\n"
    );
    false
}

/// The program under test: this build, or the one that `SHEETLIGHT_BIN` names, such as a release build for the long
/// forms.
fn program() -> &'static str {
    static NAMED: OnceLock<String> = OnceLock::new();
    NAMED
        .get_or_init(|| std::env::var("SHEETLIGHT_BIN").unwrap_or_else(|_| env!("CARGO_BIN_EXE_sheetlight").to_owned()))
}

#[test]
fn nobody_gets_in_and_no_job_is_lost() {
    let dir = copy();
    python("tests/web/doors.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn an_operator_goes_from_scan_to_position_through_the_pages() {
    let pictures = std::env::var_os("SHEETLIGHT_WRITE").is_some();
    let dir = if pictures { station(true) } else { copy() };
    let (folder, images) = (dir.path().to_str().unwrap(), source("docs/images"));
    let mut args = vec![program(), folder];
    args.extend(images.to_str().filter(|_| pictures));
    python("tests/web/pages.py", &args);
}

#[test]
fn other_machines_need_the_password_and_speak_tls() {
    let dir = copy();
    python("tests/web/secured.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn state_and_results_reach_a_broker_which_orders_nothing() {
    let dir = copy();
    python("tests/web/broker.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn a_host_application_reads_the_station_as_a_node_and_orders_only_births() {
    let dir = copy();
    python("tests/web/sparkplug.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn a_plc_starts_and_follows_insertions_that_only_the_screen_confirms() {
    let [cell, recorded] = [tempfile::tempdir().unwrap(), copy()];
    // The long form inserts every part, and sends more random frames.
    let (parts, frames) = if long() { ("led,osc,flash,dimm", "1000") } else { ("osc", "20") };
    let [folder, recorded] = [&cell, &recorded].map(|dir| dir.path().to_str().unwrap());
    python("tests/web/plc.py", &[program(), folder, recorded, parts, "20", if long() { "0" } else { "30" }, frames]);
}

/// Whether the long forms run.
fn long() -> bool {
    std::env::var_os("SHEETLIGHT_LONG").is_some()
}

#[test]
fn components_are_inserted_through_the_pages_in_the_simulated_cell() {
    let dir = tempfile::tempdir().unwrap();
    let (folder, images) = (dir.path().to_str().unwrap(), source("docs/images"));
    // The long form at the cell's own pace, as an operator goes; the short one in a hurry, over a part of the field.
    let (parts, speed, sweep) = if long() { ("led,osc,flash,dimm", "1", "0") } else { ("osc", "20", "30") };
    let mut args = vec![program(), folder, parts, speed, sweep];
    args.extend(images.to_str().filter(|_| std::env::var_os("SHEETLIGHT_WRITE").is_some()));
    python("tests/web/insert.py", &args);
}

/// One script of the long forms over a simulated station of so many columns.
fn measured(script: &str, width: &str, shots: &str) {
    if long() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().to_str().unwrap();
        sheetlight(&[
            "--quiet", "simulate", "--out", folder, "--set", "scan", "--seed", "3", "--width", width, "--shots", shots,
        ]);
        python(script, &[program(), folder]);
    }
}

#[test]
fn a_live_picture_to_two_browsers_leaves_a_scan_its_time() {
    measured("tests/web/rates.py", "1280", "1200");
}

#[test]
fn a_million_points_turn() {
    measured("tests/web/million.py", "1280", "300");
}

#[test]
fn nothing_moves_that_nobody_holds_the_button_for() {
    let [dir, second] = [0; 2].map(|_| tempfile::tempdir().unwrap());
    python("tests/web/motion.py", &[program(), dir.path().to_str().unwrap(), second.path().to_str().unwrap()]);
}

#[test]
fn a_rig_is_calibrated_from_nothing_through_the_pages() {
    if long() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, images) = (dir.path().to_str().unwrap(), source("docs/images"));
        let mut args = vec![program(), folder];
        args.extend(images.to_str().filter(|_| std::env::var_os("SHEETLIGHT_WRITE").is_some()));
        python("tests/web/calibrate.py", &args);
    }
}

#[test]
fn a_program_drives_a_scan_as_the_documents_show() {
    let dir = copy();
    python(
        "tests/web/example.py",
        &[program(), dir.path().to_str().unwrap(), source("examples/scan_by_api.py").to_str().unwrap()],
    );
}

#[test]
fn a_client_made_from_the_description_drives_a_scan() {
    let dir = copy();
    let description = source("docs/openapi.json");
    python("tests/web/client.py", &[program(), dir.path().to_str().unwrap(), description.to_str().unwrap()]);
}

#[test]
fn a_live_picture_is_the_newest_with_its_peaks_and_all_others_are_counted() {
    let dir = copy();
    python("tests/web/live.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn exposure_and_region_are_set_from_the_picture() {
    let dir = copy();
    python("tests/web/picture.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn old_browsers_and_full_disks_are_told_what_to_do() {
    let dir = copy();
    python("tests/web/hurdles.py", &[program(), dir.path().to_str().unwrap()]);
}

#[test]
fn a_camera_that_stands_still_is_calibrated_as_on_the_command_line() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().to_str().unwrap();
    sheetlight(&["--quiet", "simulate", "--out", folder, "--set", "handeye,intrinsics", "--seed", "3"]);
    python("tests/web/mount.py", &[program(), folder]);
}

#[test]
fn an_axis_is_calibrated_through_its_page() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().to_str().unwrap();
    sheetlight(&["--quiet", "simulate", "--out", folder, "--set", "axis", "--motion", "linear", "--seed", "3"]);
    python("tests/web/axis.py", &[program(), folder]);
}

/// Texts that a script shows by its own words: `t("words")`, `t(so ? "words" : "others")`, `t({ a: "words" }[which])`.
fn own_words(script: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (at, _) in script.match_indices("t(") {
        // The end of another name is none.
        if script[..at].ends_with(|c: char| c.is_alphanumeric() || "_.$".contains(c)) {
            continue;
        }
        let (mut depth, mut quoted, mut chosen) = (1, None::<String>, false);
        let call = script[at + 2..].trim_start();
        let all = call.starts_with(['"', '{']);
        for c in call.chars() {
            match (&mut quoted, c) {
                (Some(word), '"') => {
                    words.extend((all || chosen).then(|| word.clone()));
                    quoted = None;
                }
                (Some(word), c) => word.push(c),
                (None, '"') => quoted = Some(String::new()),
                (None, '?') => chosen = true,
                (None, '(') => depth += 1,
                (None, ')') => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    words
}

/// Every text that a page shows by its own words is in the table, in all languages.
#[test]
fn every_text_has_its_translations() {
    let read = own_words(r#"h(t("a (b)"), post("c"), t(x === "d" ? "e" : f), t({ g: "h" }[i]), t(j))"#);
    assert_eq!(read, ["a (b)", "e", "h"]);
    let pages = source("program/src/web/pages");
    let table = std::fs::read_to_string(pages.join("base/texts.js")).unwrap();
    // The names of conditions follow as a table of their own (tests/docs/gates.rs).
    let table = table.split("export const GATES").next().unwrap();
    let table = &table[table.find('{').unwrap()..=table.rfind('}').unwrap()];
    let rows: BTreeMap<String, [String; 3]> = serde_json::from_str(table).unwrap();
    assert!(rows.len() > 500, "{}", rows.len());
    let scripts = ["base", "pages", "widgets", "widgets/view", "widgets/rig", "widgets/part"];
    let scripts = scripts.map(|f| std::fs::read_dir(pages.join(f)).unwrap());
    let mut missing = Vec::new();
    for path in
        scripts.into_iter().flatten().map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "js"))
    {
        let words = own_words(&std::fs::read_to_string(&path).unwrap());
        missing.extend(words.into_iter().filter(|w| !rows.contains_key(w)).map(|w| format!("{}: {w}", path.display())));
    }
    assert!(missing.is_empty(), "{missing:#?}");
}

/// Each plain input of a calibration has a field on the page, whose name is in the table, too.
#[test]
fn every_input_of_a_calibration_has_a_field() {
    // The page asks for these itself; poses of boards are files of another program, which the command line takes.
    let apart = ["procedure", "target", "recording", "board_poses", "board_sigma_mm", "board_sigma_deg"];
    let description = sheetlight_program::web::openapi();
    let schemas = description["components"]["schemas"].as_object().unwrap();
    let orders = schemas.iter().filter(|(name, _)| name.starts_with("OrderCalibrate") || *name == "OrderJoint");
    let inputs: BTreeSet<&str> = orders
        .filter_map(|(_, schema)| schema["properties"].as_object())
        .flatten()
        .filter(|(name, input)| input["type"] != "array" && !apart.contains(&name.as_str()))
        .filter(|(_, input)| !input["type"].as_array().is_some_and(|kinds| kinds.contains(&"array".into())))
        .map(|(name, _)| name.as_str())
        .collect();
    let pages = source("program/src/web/pages");
    let form = std::fs::read_to_string(pages.join("widgets/form.js")).unwrap();
    let fields = form.split("export const FIELDS = {").nth(1).unwrap().split("};").next().unwrap();
    let fields: BTreeMap<&str, &str> = fields.lines().filter_map(|line| line.trim().split_once(": ")).collect();
    assert_eq!(fields.keys().copied().collect::<BTreeSet<_>>(), inputs);
    let texts = std::fs::read_to_string(pages.join("base/texts.js")).unwrap();
    let without: Vec<&&str> =
        fields.values().filter(|words| !texts.contains(&format!("\n  {}:", words.trim_end_matches(',')))).collect();
    assert!(without.is_empty(), "{without:?}");
}

#[test]
fn touch_checks_layers_drawings_points_and_support_do_what_an_operator_expects() {
    let dir = copy();
    python("tests/web/station.py", &[program(), dir.path().to_str().unwrap()]);
}

/// Compares a document with what the program says of itself; writes it under `SHEETLIGHT_WRITE`.
fn same(name: &str, is: &str) {
    let path = source(name);
    if std::env::var_os("SHEETLIGHT_WRITE").is_some() {
        std::fs::write(&path, is).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(written == is, "{name} is not what the program says; SHEETLIGHT_WRITE=1 cargo test --test web writes it");
}

#[test]
fn messages_and_routes_are_described_as_they_are() {
    let messages = sheetlight_program::web::declarations();
    same("docs/messages.d.ts", &messages);
    let api = sheetlight_program::web::openapi();
    same("docs/openapi.json", &format!("{}\n", serde_json::to_string_pretty(&api).unwrap()));
    // Every message that is named is described, and operations have names of their own.
    let (mut named, mut operations) = (Vec::new(), Vec::new());
    fn walk(value: &serde_json::Value, key: &str, out: &mut Vec<String>) {
        match value {
            serde_json::Value::Object(map) => map.iter().for_each(|(k, v)| match v {
                serde_json::Value::String(name) if k == key => out.push(name.clone()),
                v => walk(v, key, out),
            }),
            serde_json::Value::Array(list) => list.iter().for_each(|v| walk(v, key, out)),
            _ => {}
        }
    }
    walk(&api, "$ref", &mut named);
    walk(&api, "operationId", &mut operations);
    assert!(named.len() > 100, "{named:?}");
    let message = |name: &str| name.strip_prefix("#/components/schemas/").expect("a message's name").to_owned();
    for name in &named {
        assert!(api["components"]["schemas"][message(name)].is_object(), "{name} is not described");
    }
    let mut sent = Vec::new();
    walk(&api["paths"], "$ref", &mut sent);
    for name in sent.iter().map(|name| message(name)).filter(|name| name != "Fault") {
        assert!(messages.contains(&format!("export type {name} =")), "{name} is not declared");
    }
    let count = operations.len();
    operations.sort();
    operations.dedup();
    assert!(count > 50 && operations.len() == count, "{operations:?}");
}
