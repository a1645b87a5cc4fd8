//! In: this program and the program `sheetlight`. Out: failure where readers that share no code with it (Zenoh's own
//! subscribers, rosbags) see other messages than the scan has, where broken input does harm (ros2.py), or where calls
//! of services do something else at a station than they may (station.py).
//! Frame and unit: m; s.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// The program `sheetlight`: beside this one, where `make test` builds it before, or the one that SHEETLIGHT_BIN names.
fn sheetlight() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_BIN_EXE_sheetlight-ros2")).with_file_name("sheetlight");
    let named = std::env::var_os("SHEETLIGHT_BIN").map(PathBuf::from);
    named.or(Some(beside)).filter(|program| program.is_file())
}

fn skipped(why: &str) {
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{why}");
    eprintln!("\n*** SKIPPED: {why} ***\n");
}

/// One test at a time: the scan of one delays the stream of the other.
static ALONE: Mutex<()> = Mutex::new(());

/// Runs a test in Python.
fn python(script: &str, words: &[&str]) {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(sheetlight) = sheetlight() else {
        return skipped("the program sheetlight is not built: cargo build --package sheetlight-program, or make test");
    };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let run = Command::new("python3")
        .arg(here.join("tests").join(script))
        .arg(env!("CARGO_BIN_EXE_sheetlight-ros2"))
        .arg(&sheetlight)
        .arg(folder.path())
        .args(words)
        .env("PYTHONPATH", here.join("../tests/web"))
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .output();
    match run {
        Ok(done) if done.status.success() => print!("{}", String::from_utf8_lossy(&done.stdout)),
        Ok(done) if done.status.code() == Some(77) => skipped(&String::from_utf8_lossy(&done.stdout)),
        Ok(done) => {
            panic!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr))
        }
        Err(e) => skipped(&format!("python3: {e}")),
    }
}

fn is_long() -> bool {
    std::env::var_os("SHEETLIGHT_LONG").is_some()
}

#[test]
fn subscribers_of_zenoh_get_the_scan_in_the_form_of_rmw_zenoh() {
    // The long form relays profiles for a minute.
    python("ros2.py", &[if is_long() { "60" } else { "4" }]);
}

#[test]
fn clients_of_services_start_jobs_that_only_the_screen_confirms() {
    // The long form sends more foreign requests.
    python("station.py", &["osc", "20", if is_long() { "10000" } else { "300" }]);
}
