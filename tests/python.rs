//! Builds the Python package's wheel beside this build of the library, installs it aside, and runs its tests
//! (python/tests).

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Instant;

fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

fn python<A: AsRef<OsStr>>(arguments: impl IntoIterator<Item = A>) -> Command {
    let mut command = Command::new("python3");
    command.args(arguments).current_dir(root()).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

fn done(what: &str, command: &mut Command) -> Output {
    let started = Instant::now();
    let out = command.output().unwrap_or_else(|e| panic!("{what}: {e}"));
    let said = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{what}:\n{said}");
    println!("{what}: {:.1} s", started.elapsed().as_secs_f64());
    out
}

/// Without the variables that cargo sets for the programs that it runs: build scripts read some of them (ring's does),
/// and would run again because this test has them and the build before had not.
fn as_by_hand(command: &mut Command) -> &mut Command {
    let told = ["CARGO_PKG_", "CARGO_MANIFEST_", "CARGO_BIN_", "CARGO_CRATE_", "CARGO_PRIMARY_", "CARGO_TARGET_TMPDIR"];
    for (name, _) in std::env::vars_os() {
        if told.iter().any(|t| name.to_string_lossy().starts_with(t)) {
            command.env_remove(&name);
        }
    }
    command
}

/// Whether this machine's Python has what builds and tests the package; says loudly where it has not.
fn has_tools() -> bool {
    let tried = python(["-c", "import maturin, mypy, numpy, pytest, scipy"]).output();
    let why = match tried {
        Ok(out) if out.status.success() => return true,
        Ok(out) => String::from_utf8_lossy(&out.stderr).into_owned(),
        Err(e) => e.to_string(),
    };
    assert!(std::env::var_os("CI").is_none(), "the Python package was not tested: {why}");
    eprintln!("\n*** SKIPPED: the Python package needs maturin, mypy, numpy, pytest, scipy (make python): {why} ***\n");
    false
}

/// The one wheel in a folder.
fn wheel(folder: &Path) -> PathBuf {
    let all: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    let [wheel] = &all[..] else { panic!("one wheel is made, not {all:?}") };
    wheel.clone()
}

#[test]
fn the_python_package_is_built_and_passes_its_tests() {
    if !has_tools() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let (wheels, site) = (dir.path().join("wheels"), dir.path().join("site"));
    // With the features of this build, so that the library is not compiled a second time.
    let build = ["-m", "maturin", "build", "--profile", "dev", "--features", "whole", "--locked"];
    let manifest = ["--manifest-path", "python/Cargo.toml", "--out"];
    let built = done("the wheel", as_by_hand(python(build).args(manifest).arg(&wheels)));
    let again = String::from_utf8_lossy(&built.stderr).contains("Compiling sheetlight v");
    assert!(
        !again,
        "the library was compiled a second time: the features of python/Cargo.toml are not those of this build"
    );
    let wheel = wheel(&wheels);
    let name = wheel.file_name().unwrap().to_string_lossy().into_owned();
    assert!(name.contains("-cp39-abi3-"), "{name} is not for CPython 3.9 and later");
    println!("{name}: {:.1} MB, not optimised", wheel.metadata().unwrap().len() as f64 / 1e6);
    let install = ["-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target"];
    done("its installation", python(install).arg(&site).arg(&wheel));
    let tests = ["-m", "pytest", "-q", "-rs", "-s", "-p", "no:cacheprovider", "--durations=8", "python/tests"];
    let program = env!("CARGO_BIN_EXE_sheetlight");
    let out = done("its tests", python(tests).env("PYTHONPATH", &site).env("SHEETLIGHT_PROGRAM", program));
    print!("{}", String::from_utf8_lossy(&out.stdout));
}
