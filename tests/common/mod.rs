//! In: the environment of a test run. Out: the reference data, its scorer and the program under test.
//! Frame and unit: as in the reference data's FORMAT.md: base frame, mm.
#![allow(dead_code)] // each test binary uses its own part

pub mod clouds;
pub mod hand_eye;
pub mod judge;
pub mod pose;
pub mod process;
pub mod rays;
pub mod sheets;
pub mod stall;
pub mod tries;
pub mod turned;
pub mod wait;

use std::path::{Path, PathBuf};
use std::process::Command;

/// The folder of reference data with known truth, or `None` after saying loudly that the test is
/// skipped. A variable that points nowhere is a failure, not a skip.
pub fn reference(test: &str) -> Option<PathBuf> {
    let Some(path) = std::env::var_os("SHEETLIGHT_REFERENCE").map(PathBuf::from) else {
        eprintln!("\n*** SKIPPED: {test} needs reference data; set SHEETLIGHT_REFERENCE to its folder ***\n");
        return None;
    };
    assert!(path.is_dir(), "SHEETLIGHT_REFERENCE is {}, which is no folder", path.display());
    Some(path)
}

/// Copies a folder with everything in it.
pub fn copied(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().map(Result::unwrap) {
        let (path, to) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() { copied(&path, &to) } else { std::fs::copy(&path, &to).map(|_| ()).unwrap() }
    }
}

/// An adapter. Without one the tests pass and say so, unless SHEETLIGHT_REQUIRE_GPU is set.
pub fn device() -> Option<sheetlight::gpu::Device> {
    match sheetlight::gpu::Device::open() {
        Ok(d) => Some(d),
        Err(e) if std::env::var_os("SHEETLIGHT_REQUIRE_GPU").is_some() => panic!("{e}"),
        Err(e) => {
            eprintln!("SKIPPED, no GPU adapter: {e}");
            None
        }
    }
}

/// The rigs in the reference data: (inputs folder, truth folder). Kept-back rigs have the same shape.
pub fn rigs(reference: &Path) -> Vec<(PathBuf, PathBuf)> {
    let inputs = reference.join("rendered/inputs");
    let mut rigs: Vec<_> = std::fs::read_dir(&inputs)
        .expect("rendered/inputs")
        .map(|e| e.unwrap().file_name())
        .map(|name| (inputs.join(&name), reference.join("rendered/truth").join(&name)))
        .filter(|(_, truth)| truth.is_dir())
        .collect();
    rigs.sort();
    rigs
}

/// Runs the reference data's own scorer on an estimate. `None`, said loudly, where Python or its
/// packages are missing; with CI=true that is a failure.
pub fn score(reference: &Path, estimate: &Path, truth: &Path) -> Option<serde_json::Value> {
    let out = estimate.with_extension("score.json");
    let scorer = reference.join("rendered/score.py");
    let run = Command::new("python3").arg(&scorer).arg(estimate).arg(truth).arg("--json").arg(&out).output();
    match run {
        Ok(done) if done.status.success() => {
            print!("{}", String::from_utf8_lossy(&done.stdout));
            Some(serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap())
        }
        other => {
            let why = match other {
                Ok(done) => String::from_utf8_lossy(&done.stderr).into_owned(),
                Err(e) => e.to_string(),
            };
            assert!(std::env::var_os("CI").is_none(), "the scorer did not run: {why}");
            eprintln!(
                "\n*** SKIPPED: the scorer needs python3 with numpy, scipy and libigl (make python): {why} ***\n"
            );
            None
        }
    }
}

/// The program under test, which cargo builds for the tests of its package.
pub fn program() -> &'static str {
    let Some(program) = option_env!("CARGO_BIN_EXE_sheetlight") else {
        panic!("only tests of the package sheetlight-program have a program");
    };
    program
}

/// Runs the program; gives its stdout, or panics with its stderr.
pub fn sheetlight(args: &[&str]) -> String {
    let done = Command::new(program()).args(args).output().expect("the program starts");
    assert!(done.status.success(), "sheetlight {}\n{}", args.join(" "), String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).expect("text")
}

/// Runs the program and expects it to fail; gives its exit code and stderr.
pub fn sheetlight_fails(args: &[&str]) -> (i32, String) {
    let done = Command::new(program()).args(args).output().expect("the program starts");
    assert!(!done.status.success(), "sheetlight {} succeeded", args.join(" "));
    (done.status.code().expect("an exit code"), String::from_utf8_lossy(&done.stderr).into_owned())
}

/// A figure of a score, by its path; panics where it is missing.
pub fn figure(score: &serde_json::Value, path: &[&str]) -> f64 {
    let found = path.iter().try_fold(score, |v, key| v.get(key));
    found.and_then(|v| v.as_f64()).unwrap_or_else(|| panic!("the score has no {}", path.join("/")))
}
