//! In: cameras that are played, simulated, piped, filled into folders, streamed over GigE Vision, with and without
//! faults. Out: whether every picture is recorded or counted, paired with where things truly stood, and scanned as a
//! file's.
//! Frame and unit: pixels, mm, ms.

mod common;

#[path = "capture/axis.rs"]
mod axis;
#[path = "capture/brackets.rs"]
mod brackets;
#[path = "capture/cell.rs"]
mod cell;
#[path = "capture/device.rs"]
mod device;
#[path = "capture/exposures.rs"]
mod exposures;
#[path = "capture/gige.rs"]
mod gige;
#[path = "capture/pairing.rs"]
mod pairing;
#[path = "capture/profiles.rs"]
mod profiles;
#[path = "capture/recording.rs"]
mod recording;
#[path = "capture/registers.rs"]
mod registers;
#[path = "capture/robot.rs"]
mod robot;
#[path = "capture/sources.rs"]
mod sources;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

fn text(p: &Path) -> String {
    p.to_str().expect("UTF-8").to_owned()
}

/// One simulated recording of a board with parts by a robot, and its station; made once.
fn simulated() -> &'static Path {
    static MADE: OnceLock<tempfile::TempDir> = OnceLock::new();
    MADE.get_or_init(|| {
        let dir = tempfile::tempdir().expect("a folder");
        let out = text(&dir.path().join("sim"));
        common::sheetlight(&["simulate", "--out", &out, "--width", "320", "--shots", "24", "--quiet"]);
        dir
    })
    .path()
}

fn station() -> String {
    text(&simulated().join("sim/station"))
}

fn scan_folder() -> PathBuf {
    simulated().join("sim/scan")
}

/// Scans a recording and gives its cloud's bytes.
fn cloud_of(recording: &Path, out: &Path) -> Vec<u8> {
    let (from, to) = (text(recording), text(out));
    let args = ["scan", &from, "--station", &station(), "--out", &to, "--on", "cpu", "--overlays", "0", "--quiet"];
    common::sheetlight(&args);
    std::fs::read(out.join("cloud.ply")).expect("a cloud")
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).expect("a file")).expect("JSON")
}
