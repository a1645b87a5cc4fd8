//! In: this program and the program `sheetlight`. Out: failure where an OPC UA client that shares no code with it sees
//! or does something else than it may (opcua.py).
//! Frame and unit: mm; s.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The program `sheetlight`: beside this one, where `make test` builds it before, or the one that SHEETLIGHT_BIN names.
fn sheetlight() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_BIN_EXE_sheetlight-opcua")).with_file_name("sheetlight");
    let named = std::env::var_os("SHEETLIGHT_BIN").map(PathBuf::from);
    named.or(Some(beside)).filter(|program| program.is_file())
}

fn skipped(why: &str) {
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{why}");
    eprintln!("\n*** SKIPPED: {why} ***\n");
}

#[test]
fn an_opc_ua_client_starts_and_follows_insertions_that_only_the_screen_confirms() {
    let Some(sheetlight) = sheetlight() else {
        return skipped("the program sheetlight is not built: cargo build --package sheetlight-program, or make test");
    };
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    // The long form inserts every part, and sends more random frames.
    let (parts, sweep, frames) = match std::env::var_os("SHEETLIGHT_LONG") {
        Some(_) => ("led,osc,flash,dimm", "0", "10000"),
        None => ("osc", "30", "300"),
    };
    let run = Command::new("python3")
        .arg(here.join("tests/opcua.py"))
        .arg(env!("CARGO_BIN_EXE_sheetlight-opcua"))
        .arg(&sheetlight)
        .arg(folder.path())
        .args([parts, "20", sweep, frames])
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
