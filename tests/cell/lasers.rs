//! Whatever goes wrong in whichever phase of what switches a laser: the lasers are off within a second, or it is said
//! that the controller was not reached; what was left lit goes off first when the program is started again.

use super::cold::{Cold, coarse_options};
use super::trap::{Trap, TrapCamera, TrapPerson, What, When};
use super::workplace::{DARK, dark_within, lit, scene, set};
use sheetlight::arm::{Outputs, Switchboard};
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::capture::{PictureSource, tune};
use sheetlight::fault::Result;
use sheetlight::recording::Beam;
use sheetlight::station::job::Job;
use sheetlight::station::{Output, try_output};
use sheetlight_program::cell::Served;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::time::{Duration, Instant};

/// What is under way.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Where {
    Touch,
    Scan,
    Find,
    Approach,
    Insert,
    Retract,
    Auto,
    Tune,
    TryLine,
    TryPointer,
}

use What::{CameraLost, DiskFull, Gone, Killed, LinkCut, Panic};

/// Tune and the outputs write nothing, and a try of an output has no step of ours in which a bug could be.
const ALL: [(Where, &[What]); 10] = [
    (Where::Touch, &[Panic, DiskFull, LinkCut, Gone, Killed, CameraLost]),
    (Where::Scan, &[DiskFull, Panic, LinkCut, Gone, Killed, CameraLost]),
    (Where::Find, &[LinkCut, DiskFull, Panic, Gone, Killed]),
    (Where::Approach, &[Killed, DiskFull, Panic, LinkCut, Gone]),
    (Where::Insert, &[Gone, DiskFull, Panic, LinkCut, Killed]),
    (Where::Retract, &[Panic, DiskFull, LinkCut, Gone, Killed]),
    (Where::Auto, &[Panic, DiskFull, LinkCut, Gone, Killed, CameraLost]),
    (Where::Tune, &[LinkCut, Panic, Gone, Killed, CameraLost]),
    (Where::TryLine, &[LinkCut, Gone, Killed]),
    (Where::TryPointer, &[Killed, LinkCut, Gone]),
];

/// Runs what is under way into what goes wrong; what was said of it: a fault, a report, lines that were told.
fn run(place: Where, what: What, trapped: impl FnOnce(&Trap, &Served, &mut dyn FnMut() -> Result<String>)) {
    let when = match place {
        Where::Touch => When::Pictures("touch"),
        Where::Scan => When::Pictures("scan"),
        Where::Find => When::Told("points from"),
        Where::Approach => When::Moving("approach"),
        Where::Insert => When::Moving("insert"),
        Where::Retract => When::Moving("retract"),
        Where::Auto => When::From(4),
        // The third of the pictures from which the first exposures are judged.
        Where::Tune => When::From(2),
        Where::TryLine | Where::TryPointer => When::From(-1),
    };
    // A bug has to be in the thread of the job.
    let when = match (what, when) {
        (Panic | DiskFull, When::Moving(step)) => When::Asked(step),
        (_, when) => when,
    };
    match place {
        Where::Auto => {
            let cold = Cold::new(coarse_options());
            let trap = Trap::new(what, when, &cold.served, &cold.dir.path().join("pictures"));
            trapped(&trap, &cold.served, &mut || {
                let mut guard = cold.guard();
                trap.may_stop(&guard.stop_button());
                let camera = CellCamera::open(&cold.served.camera.to_string(), -1.0)?;
                let mut who = TrapPerson::new(&trap);
                let camera = Box::new(TrapCamera(camera, trap.clone()));
                cold.calibrate_with(&mut guard, camera, &mut who, 0.2, 40).map(|_| "calibrated".into())
            });
        }
        Where::Tune | Where::TryLine | Where::TryPointer => {
            let set = set(scene("osc", 3), 3, 2.0);
            let trap = Trap::new(what, when, &set.served, &set.dir.path().join("nothing"));
            let beam = if place == Where::TryPointer { Output::Pointer } else { Output::Line };
            trapped(&trap, &set.served, &mut || {
                let mut guard = set.guard();
                if place == Where::Tune {
                    let mut camera = CellCamera::open(&set.served.camera.to_string(), 50.0)?;
                    // Much too dark: it tries several.
                    camera.set("ExposureTime", "40")?;
                    let mut lights = Switchboard::of(guard.link(), Outputs::default())?;
                    let mut camera = TrapCamera(camera, trap.clone());
                    return lights.lit(Beam::Line, || tune(&mut camera, |_, _| {})).map(|_| "tuned".into());
                }
                let stop = trap.signal();
                std::thread::scope(|threads| {
                    threads.spawn(|| {
                        let begun = Instant::now();
                        while lit(&set.served.cell).is_empty() && begun.elapsed() < Duration::from_secs(20) {
                            std::thread::sleep(Duration::from_millis(1));
                        }
                        trap.fire();
                    });
                    try_output(guard.link(), &Outputs::default(), beam, &stop).map(|n| format!("{n} was tried"))
                })
            });
        }
        _ => {
            let set = set(scene("osc", 3), 3, 2.0);
            let options = set.options("osc.toml", "job", 28.0);
            let trap = Trap::new(what, when, &set.served, &options.out);
            trapped(&trap, &set.served, &mut || {
                let mut guard = set.guard();
                trap.may_stop(&guard.stop_button());
                let camera = CellCamera::open(&set.served.camera.to_string(), -1.0)?;
                let mut who = TrapPerson::new(&trap);
                let camera = Box::new(TrapCamera(camera, trap.clone()));
                let report = Job::open(&options, &mut guard, camera, &mut who)?.run()?;
                Ok(format!("{:?}: {}", report.outcome, report.why))
            });
        }
    }
}

/// One row of the table.
fn one(place: Where, what: What) {
    run(place, what, |trap, served, work| {
        let ended = AtomicBool::new(false);
        let (said, dark) = std::thread::scope(|threads| {
            let seen = threads.spawn(|| {
                while trap.fired().is_none() && !ended.load(SeqCst) {
                    std::thread::sleep(Duration::from_millis(1));
                }
                dark_within(&served.cell, DARK)
            });
            let done = catch_unwind(AssertUnwindSafe(work));
            ended.store(true, SeqCst);
            let said = match done {
                Ok(Ok(said)) => said,
                Ok(Err(fault)) => fault.to_string(),
                Err(panic) => format!("panic: {}", panic.downcast_ref::<&str>().unwrap_or(&"?")),
            };
            (said, seen.join().unwrap())
        });
        let row = format!("{place:?} {what:?}");
        let (_, burnt) = trap.fired().unwrap_or_else(|| panic!("{row}: nothing went wrong: {said}"));
        let lights_then = !matches!(place, Where::Find | Where::Approach | Where::Insert | Where::Retract);
        // Tests nothing otherwise; while somebody is asked and while the tool is at the part no laser is on.
        assert_eq!(!burnt.is_empty(), lights_then, "{row}: {burnt:?} {said}");
        println!("{row}: dark after {dark:?}; {said}");
        match what {
            Gone if lights_then => {
                assert!(said.contains("the laser may still be on: the controller was not reached"), "{row}: {said}");
                // The controller is there again, the program is started anew.
                served.faults.clear();
                let arm = sheetlight::arm::open(&served.robot_uri()).unwrap();
                assert!(!lit(&served.cell).is_empty(), "{row}");
                Switchboard::of(&*arm, Outputs::default()).unwrap();
                assert!(lit(&served.cell).is_empty(), "{row}");
            }
            _ => assert!(dark.is_some(), "{row}: {:?} on a second later: {said}", lit(&served.cell)),
        }
    });
}

/// One fault in each place; with SHEETLIGHT_LONG all of them.
#[test]
fn lasers_go_off_whatever_goes_wrong() {
    let long = std::env::var_os("SHEETLIGHT_LONG").is_some();
    let rows = ALL.iter().flat_map(|(place, faults)| {
        let some = if long { faults } else { &faults[..1] };
        some.iter().map(|what| (*place, *what))
    });
    let rows: Vec<_> = rows.collect();
    assert!(!long || rows.len() >= 45, "{}", rows.len());
    rows.into_iter().for_each(|(place, what)| one(place, what));
}

/// The command that tries an output, told to end by a signal while the laser is on.
#[test]
fn a_signal_does_not_leave_a_tried_laser_on() {
    for signal in ["-TERM", "-INT"] {
        let set = set(scene("osc", 3), 3, 2.0);
        let mut command = Command::new(env!("CARGO_BIN_EXE_sheetlight"));
        command.args(["robot", "output", "line", "--allow-motion"]).arg("--station").arg(&set.station);
        command.args(["--robot", &set.served.robot_uri()]).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().expect("the program starts");
        let begun = Instant::now();
        while lit(&set.served.cell).is_empty() && begun.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(lit(&set.served.cell), [set.served.cell.options().outputs.line]);
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert!(dark_within(&set.served.cell, DARK).is_some(), "{signal}");
        child.wait().unwrap();
    }
}

/// The gripper stays as it is when the outputs are let go: what it holds would fall.
#[test]
fn the_gripper_does_not_open_when_the_outputs_are_let_go() {
    let set = set(scene("osc", 3), 3, 2.0);
    let mut arm = sheetlight::arm::open(&set.served.robot_uri()).unwrap();
    let outputs = Outputs::default();
    let mut all = Switchboard::of(&*arm, outputs).unwrap();
    all.grip(true).unwrap();
    all.light(Some(Beam::Line)).unwrap();
    drop(all);
    assert!(arm.signal(outputs.gripper).unwrap() && !arm.signal(outputs.line).unwrap());
    assert!(set.served.cell.insertion().is_none());
}
