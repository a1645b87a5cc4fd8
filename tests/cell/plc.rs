//! In: jobs that a PLC asks a station for over Modbus, each with one fault of the job's table. Out: whether the fault
//! reaches the registers as its code and with the words of the job's record, and whether the arm made no motion that
//! was not confirmed.
//! Frame and unit: mm; s.

use super::faults::{BEFORE, FAULTS, Fault, breaks, safe};
use super::workplace::{DARK, Set, dark_within, scene, set};
use rand::SeedableRng;
use rand_pcg::Pcg64;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A job that has not come so far by then does not come there.
const PATIENCE: Duration = Duration::from_secs(240);
/// Largest file of a disk that is full, kB: less than a scan needs.
const FULL_KB: u32 = 60;

/// The error codes that a fault may end in; 0: the job bears it.
fn codes(fault: Fault) -> &'static [u64] {
    match fault {
        // The link asks once more, or the connection of the screen has the fault.
        Fault::Cut | Fault::Lost | Fault::Late => &[0, 4, 5],
        Fault::CameraOut | Fault::ControllerGone => &[5],
        // The controller refuses the next motion.
        Fault::EmergencyStop | Fault::TeachMode | Fault::TakenByAnother => &[4],
        Fault::Killed => &[15],
        // A motion is halted, or there is none and the job is stopped.
        Fault::Interrupted => &[5, 12],
        Fault::DiskFull => &[13],
    }
}

/// A server of the cell's station with a person and a PLC, as a script; files grow to `most_kb` at most.
fn begin(set: &Set, most_kb: Option<u32>) -> Child {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    let recipes = set.station.join("recipes");
    std::fs::create_dir_all(&recipes).unwrap();
    let coarse = include_str!("../../data/recipes/osc.toml").replace("cell_mm = 0.5", "cell_mm = 0.8");
    std::fs::write(recipes.join("osc.toml"), coarse).unwrap();
    let mut command = Command::new("python3");
    command.arg(root.join("tests/web/plc_fault.py")).arg(env!("CARGO_BIN_EXE_sheetlight")).arg(set.dir.path());
    command.args([set.served.robot_uri(), set.served.camera_uri(), most_kb.unwrap_or(0).to_string()]);
    let said = std::fs::File::create(set.dir.path().join("said")).unwrap();
    command.env("PYTHONDONTWRITEBYTECODE", "1").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(said);
    command.spawn().expect("python3 starts")
}

/// One job with one fault: whether its code is one of those that it may end in; `None` if what it needs is not here.
fn one(fault: Fault, seed: u64) -> Option<bool> {
    let set = set(scene("osc", seed), seed, 2.0);
    let mut script = begin(&set, (fault == Fault::DiskFull).then_some(FULL_KB));
    let mut out = BufReader::new(script.stdout.take().unwrap());
    let mut first = String::new();
    out.read_line(&mut first).unwrap();
    if first.starts_with("pymodbus") {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "{first}");
        eprintln!("\n*** SKIPPED: {} ***\n", first.trim());
        script.wait().unwrap();
        return None;
    }
    let said = || std::fs::read_to_string(set.dir.path().join("said")).unwrap_or_default();
    let process: u32 = first.trim().parse().unwrap_or_else(|e| panic!("{first:?}: {e}\n{}", said()));
    // In the midst of the scan, whose motions follow those of the touch.
    let begun = Instant::now();
    while set.served.cell.moves() < BEFORE + 4 && script.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    breaks(fault, &set, process, &mut Pcg64::seed_from_u64(seed));
    let mut rest = String::new();
    out.read_to_string(&mut rest).unwrap();
    let status = script.wait().unwrap();
    assert!(status.success(), "{fault:?}: {rest}\n{}", said());
    let came: serde_json::Value = serde_json::from_str(rest.lines().last().unwrap()).unwrap();
    println!("{fault:?}: {came}");
    let inserted = set.served.cell.insertion().is_some_and(|i| i.inserted);
    assert_eq!(came["state"] == 3, inserted, "{fault:?}: {came}");
    safe(&set, seed, &format!("{fault:?}: {came}"));
    // A killed program cannot switch anything off; a controller that is gone cannot be asked to.
    if !matches!(fault, Fault::Killed | Fault::ControllerGone) {
        let stated =
            came["words"].as_str().unwrap().contains("the laser may still be on") || said().contains("the laser may");
        assert!(stated || dark_within(&set.served.cell, DARK).is_some(), "{fault:?}: a laser is on: {came}");
    }
    Some(codes(fault).contains(&came["error"].as_u64().unwrap()))
}

#[test]
fn a_fault_reaches_the_plc_as_its_code_and_with_its_words() {
    let faults: &[Fault] = match std::env::var_os("SHEETLIGHT_LONG") {
        Some(_) => &FAULTS,
        None => &[Fault::EmergencyStop],
    };
    let mut other = Vec::new();
    for (seed, fault) in (1..).zip(faults) {
        match one(*fault, seed) {
            None => return,
            Some(true) => {}
            Some(false) => other.push(fault),
        }
    }
    assert!(other.is_empty(), "another code is stated for {other:?}");
}
