//! In: the program with its output closed, full or cut off, with names that steer a terminal, with hardly any memory
//! for
//! threads. Out: a sensible exit code, and no panic. Frame and unit: none.
#![cfg(target_os = "linux")]

use std::process::Command;

/// Runs a line of the shell in which `$S` is the program; its exit code and both outputs.
fn shell(line: &str) -> (Option<i32>, String) {
    let done = Command::new("bash")
        .args(["-c", &format!("set -o pipefail; {line}")])
        .env("S", env!("CARGO_BIN_EXE_sheetlight"))
        .output()
        .expect("bash starts");
    let text = [done.stdout, done.stderr].concat();
    (done.status.code(), String::from_utf8_lossy(&text).into_owned())
}

#[test]
fn outputs_that_take_nothing() {
    for (line, code, says) in [
        // A reader that has seen enough is no error.
        ("$S bench --help | true", 0, ""),
        ("$S --json station show --station /nowhere | true", 1, "error"),
        ("$S station show --station /nowhere 2>&-", 1, ""),
        ("$S station show --station /nowhere 2>/dev/full", 1, ""),
        ("$S --json station show --station /nowhere >&- 2>&-", 1, ""),
        ("$S --json station show --station /nowhere >/dev/full", 1, "error"),
    ] {
        let (got, text) = shell(line);
        assert!(got == Some(code) && text.contains(says) && !text.contains("panicked"), "{line}: {got:?} {text}");
    }
    let dir = tempfile::tempdir().unwrap();
    let station = dir.path().join("s");
    let new = format!("$S station new --station {} --robot ur", station.display());
    let (code, text) = shell(&new);
    assert_eq!(code, Some(0), "{text}");
    let show = format!("$S station show --station {}", station.display());
    let (code, text) = shell(&format!("{show} | true"));
    assert!(code == Some(0) && text.is_empty(), "{code:?} {text}");
    let (code, text) = shell(&format!("{show} >/dev/full"));
    assert!(code == Some(1) && text.contains("No space left") && text.contains("next step"), "{code:?} {text}");
    let (code, text) = shell(&format!("{show} >&-"));
    assert!(code == Some(0) && !text.contains("panicked"), "{code:?} {text}");
}

#[test]
fn names_that_steer_the_terminal() {
    let dir = tempfile::tempdir().unwrap();
    let meta = r#"{"format": 1, "set": "a", "units": "\u001b]0;gone\u0007\u001b[31m\u009b2J", 
        "image": {"width": 4, "height": 4, "bits": 8, "channels": 1, "response": "linear",
                  "pixel_centre": "integer coordinates"},
        "frames": [{"laser": "a.png"}]}"#;
    std::fs::write(dir.path().join("meta.json"), meta).unwrap();
    let station = dir.path().join("s");
    for json in ["", "--json"] {
        let new = format!(
            "$S station new --station {0} --robot ur >&2; $S {json} calibrate camera {1} --station {0}",
            station.display(),
            dir.path().display()
        );
        let (code, text) = shell(&new);
        assert!(code == Some(1) && text.contains("units are"), "{code:?} {text}");
        assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
        let _ = std::fs::remove_dir_all(&station);
    }
}

#[test]
fn fewer_threads_than_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("board.svg");
    let line =
        format!("ulimit -v 3000000; RAYON_NUM_THREADS=60000 $S station new --robot ur --station {}", out.display());
    let (code, text) = shell(&line);
    assert!(code == Some(0) && !text.contains("panicked"), "{code:?} {text}");
}
