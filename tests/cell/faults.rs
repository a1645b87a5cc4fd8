//! In: jobs run as processes against simulated cells, each with one fault at a random moment. Out: whether every one
//! ends inserted or safely stopped, and whether the arm ever made a motion that was not confirmed: the cell's own log
//! against the log of motions.
//! Frame and unit: mm, degrees; s.

use super::workplace::{DARK, Set, dark_within, scene, set};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::geometry::{Base, Flange, Rigid};
use sheetlight::station::job::{JobState, Phase, Resumes};
use sheetlight_program::cell::{Entry, Event};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::Ordering::SeqCst;
use std::time::{Duration, Instant};

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    Cut,
    Lost,
    Late,
    CameraOut,
    EmergencyStop,
    Killed,
    Interrupted,
    ControllerGone,
    DiskFull,
    TeachMode,
    TakenByAnother,
}

pub const FAULTS: [Fault; 11] = [
    Fault::Cut,
    Fault::Lost,
    Fault::Late,
    Fault::CameraOut,
    Fault::EmergencyStop,
    Fault::Killed,
    Fault::Interrupted,
    Fault::ControllerGone,
    Fault::DiskFull,
    Fault::TeachMode,
    Fault::TakenByAnother,
];

/// Motions of a whole job before its scan, and after it: approach, down to it, insertion, retract.
pub const BEFORE: usize = 7;
const AFTER: usize = 4;
/// A job that has not ended by then hangs.
const PATIENCE: Duration = Duration::from_secs(180);

/// A job as a process; files grow to `most_kb` at most, as on a disk that is full.
fn begin(set: &Set, most_kb: Option<u64>) -> Child {
    let at = |name: &str| set.dir.path().join(name);
    let recipe = at("recipe.toml");
    let coarse = include_str!("../../data/recipes/osc.toml").replace("cell_mm = 0.5", "cell_mm = 0.8");
    std::fs::write(&recipe, coarse).unwrap();
    let limit = most_kb.map_or("unlimited".into(), |kb| kb.to_string());
    let mut command = Command::new("bash");
    command.args(["-c", &format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" \"$@\"")]);
    command.arg(env!("CARGO_BIN_EXE_sheetlight")).arg("job").arg("--station").arg(&set.station);
    command.args(["--robot", &set.served.robot_uri(), "--camera", &set.served.camera_uri()]);
    command.arg("--recipe").arg(&recipe).arg("--out").arg(at("job"));
    command.args(["--allow-motion", "--yes", "--on", "cpu", "--sweep", "28"]);
    let said = std::fs::OpenOptions::new().create(true).append(true).open(at("said")).unwrap();
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(said).spawn().expect("the program starts")
}

/// Its exit code; none where it was killed.
fn end(child: &mut Child) -> Option<i32> {
    let begun = Instant::now();
    while begun.elapsed() < PATIENCE {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    panic!("the job hangs");
}

/// Waits for a moment of the job: so many motions and then some milliseconds, or its end.
fn wait(set: &Set, child: &mut Child, moves: usize, then_ms: u64) {
    let begun = Instant::now();
    while set.served.cell.moves() < moves && child.try_wait().unwrap().is_none() && begun.elapsed() < PATIENCE {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_millis(then_ms));
}

/// Something goes wrong with the cell, or with the process that has its robot.
pub fn breaks(fault: Fault, set: &Set, process: u32, rng: &mut Pcg64) {
    let signal = |name: &str| drop(Command::new("kill").args([name, &process.to_string()]).status());
    let (faults, controller) = (&set.served.faults, &set.served.controller);
    match fault {
        Fault::Cut => faults.cut.store(1, SeqCst),
        Fault::Lost => faults.lose.store(rng.random_range(1..4), SeqCst),
        Fault::Late => {
            faults.delay_ms.store(rng.random_range(20..1500), SeqCst);
            std::thread::sleep(Duration::from_secs(2));
            faults.delay_ms.store(0, SeqCst);
        }
        Fault::CameraOut => faults.camera_gone.store(true, SeqCst),
        Fault::EmergencyStop => controller.emergency_stop(),
        Fault::Killed => signal("-KILL"),
        Fault::Interrupted => signal("-INT"),
        Fault::ControllerGone => faults.gone.store(true, SeqCst),
        Fault::DiskFull => {}
        Fault::TeachMode => controller.set_mode(2),
        Fault::TakenByAnother => controller.take_by_another(),
    }
}

/// As a person does it who was called: everything is as it should be again.
fn mended(set: &Set) {
    set.served.faults.clear();
    let controller = &set.served.controller;
    controller.release_emergency_stop();
    controller.clear_errors();
    controller.set_mode(3);
    controller.set_motor(true);
    controller.given_by_another();
}

/// The poses of every plan that was begun, in order, as the log of motions has them.
fn begun(log: &Path) -> Vec<Vec<Rigid<Base, Flange>>> {
    let text = std::fs::read_to_string(log).unwrap_or_default();
    // A line that a kill or a full disk has cut off is no confirmation.
    let lines: Vec<serde_json::Value> = text.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
    let asked = |hash: &serde_json::Value| {
        let line =
            lines.iter().find(|l| l["event"] == "asked" && l["hash"] == *hash).expect("what is begun was asked for");
        let rows: Vec<[f64; 16]> = serde_json::from_value(line["to"].clone()).unwrap();
        rows.iter().map(|r| Rigid::from_rows(r).unwrap().0).collect()
    };
    lines.iter().filter(|l| l["event"] == "begun").map(|l| asked(&l["hash"])).collect()
}

/// The motions of the cell's log are the beginnings of the plans that were begun, one plan after the other, each leg
/// at most once.
fn all_confirmed(log: &[Entry], plans: &[Vec<Rigid<Base, Flange>>]) -> Result<usize, String> {
    let moves = log.iter().filter_map(|e| match &e.event {
        Event::Move { to, .. } => Some(to),
        _ => None,
    });
    let (mut plan, mut leg, mut count) = (0, 0, 0);
    for to in moves {
        let same = |p: &Rigid<Base, Flange>| {
            let (angle, mm) = p.difference(to);
            mm < 1e-3 && angle < 1e-5
        };
        loop {
            let Some(legs) = plans.get(plan) else {
                return Err(format!("motion {count} to {:?} was not confirmed", to.translation));
            };
            if legs.get(leg).is_some_and(same) {
                leg += 1;
                break;
            }
            (plan, leg) = (plan + 1, 0);
        }
        count += 1;
    }
    Ok(count)
}

/// The arm stands still, and stays so.
fn stands(set: &Set) -> bool {
    let at = || set.served.cell.true_flange(set.served.cell.clock().now());
    // What was under way when a job was killed comes to its own end, three seconds later at most.
    (0..75).any(|_| {
        let before = at();
        std::thread::sleep(Duration::from_millis(40));
        before.difference(&at()).1 < 1e-9
    })
}

/// One job with one fault at a random moment, then again without until it has ended. What came of it: first and last.
fn one(seed: u64, fault: Fault, whole: usize) -> (String, Phase) {
    let mut rng = Pcg64::seed_from_u64(seed);
    let set = set(scene("osc", seed), seed, 2.0);
    let scan = BEFORE + 1..whole - AFTER;
    // As many faults in the short phases as in the long one.
    let moves = match rng.random_range(0..7) {
        0 => 0,
        1 => rng.random_range(1..=BEFORE),
        2 => rng.random_range(scan),
        3 => whole - AFTER,
        4 => rng.random_range(whole - AFTER + 1..=whole - 2),
        k => whole - 6 + k,
    };
    let then_ms = rng.random_range(0..if moves == 0 || moves == whole - AFTER { 600 } else { 60 });
    let most_kb = (fault == Fault::DiskFull).then(|| [2, 4, 8, 40, 100, 150, 200, 400, 1000][rng.random_range(0..9)]);
    let mut child = begin(&set, most_kb);
    wait(&set, &mut child, moves, then_ms);
    breaks(fault, &set, child.id(), &mut rng);
    let mut code = end(&mut child);
    let job = set.dir.path().join("job");
    let state = || JobState::load(&job).expect("job.json is whole");
    let phase = || state().map_or(Phase::Touch, |s| s.phase);
    // It stands away from the part, or holds its component still: a person may leave it at that.
    let at_rest = || {
        state().is_some_and(|s| s.resumes() == Resumes::Over || (s.stopped && !s.moving && s.phase != Phase::Retract))
    };
    if fault != Fault::Killed {
        let said = std::fs::read_to_string(set.dir.path().join("said")).unwrap_or_default();
        let stated = said.contains("the laser may still be on");
        assert!(
            stated || dark_within(&set.served.cell, DARK).is_some(),
            "seed {seed}, {fault:?}: a laser is on\n{said}"
        );
    }
    let mut first = format!("{fault:?} after {moves} motions and {then_ms} ms: exit {code:?}, {:?}", phase());
    safe(&set, seed, &first);
    for _ in 0..6 {
        if code == Some(0) || at_rest() {
            break;
        }
        mended(&set);
        // A controller takes a while until it lets a program go that was killed.
        std::thread::sleep(Duration::from_millis(500));
        let _ = writeln(&set, "-- again --");
        code = end(&mut begin(&set, None));
        // Also where the run before was killed with a laser on.
        assert!(dark_within(&set.served.cell, DARK).is_some(), "seed {seed}, {first}: a laser is on");
        first += &format!("; again: {code:?}, {:?}", phase());
        safe(&set, seed, &first);
    }
    let said = std::fs::read_to_string(set.dir.path().join("said")).unwrap_or_default();
    assert!(!said.contains("panicked"), "seed {seed}, {first}:\n{said}");
    let why = JobState::load(&job).unwrap().map_or(String::new(), |s| s.why);
    let inserted = set.served.cell.insertion().is_some_and(|i| i.inserted);
    assert!(at_rest(), "seed {seed}, {first}:\n{said}");
    assert_eq!(phase() == Phase::Done, inserted, "seed {seed}, {first}:\n{said}");
    (format!("{first} {why}"), phase())
}

fn writeln(set: &Set, line: &str) -> std::io::Result<()> {
    use std::io::Write;
    let mut said = std::fs::OpenOptions::new().append(true).open(set.dir.path().join("said"))?;
    writeln!(said, "{line}")
}

/// Nothing was hit or let go elsewhere, the arm stands, and all that it did was confirmed.
pub fn safe(set: &Set, seed: u64, first: &str) {
    let said = || std::fs::read_to_string(set.dir.path().join("said")).unwrap_or_default();
    assert!(stands(set), "seed {seed}, {first}: the arm moves on\n{}", said());
    let log = set.served.cell.log();
    let bad = log.iter().find(|e| match &e.event {
        Event::Collision { .. } => true,
        Event::Released(i) => !i.inserted,
        _ => false,
    });
    assert!(bad.is_none(), "seed {seed}, {first}: {bad:?}\n{}", said());
    if let Err(e) = all_confirmed(&log, &begun(&set.station.join("motions.jsonl"))) {
        panic!("seed {seed}, {first}: {e}\n{}", said());
    }
}

/// How many motions a job of this test has, and what it says where nothing goes wrong.
fn whole() -> usize {
    let set = set(scene("osc", 0), 0, 2.0);
    assert_eq!(
        end(&mut begin(&set, None)),
        Some(0),
        "{}",
        std::fs::read_to_string(set.dir.path().join("said")).unwrap()
    );
    safe(&set, 0, "no fault");
    let moves = set.served.cell.moves();
    assert!(moves > BEFORE + AFTER + 10, "{moves}");
    moves
}

/// Runs some faults on two threads.
fn run(seeds: std::ops::RangeInclusive<u64>, of: impl Fn(u64) -> Fault + Sync) -> Vec<(String, Phase)> {
    let whole = whole();
    let next = std::sync::atomic::AtomicU64::new(*seeds.start());
    std::thread::scope(|threads| {
        let work = || {
            let mut done = Vec::new();
            loop {
                let seed = next.fetch_add(1, SeqCst);
                if seed > *seeds.end() {
                    return done;
                }
                let came = one(seed, of(seed), whole);
                println!("{seed}: {} -> {:?}", came.0, came.1);
                done.push(came);
            }
        };
        let other = threads.spawn(work);
        let mut done = work();
        done.extend(other.join().unwrap());
        done
    })
}

#[test]
fn a_job_with_a_fault_ends_inserted_or_safely_stopped() {
    const SHORT: [Fault; 6] =
        [Fault::Cut, Fault::Killed, Fault::EmergencyStop, Fault::CameraOut, Fault::ControllerGone, Fault::TeachMode];
    run(1..=6, |seed| SHORT[seed as usize - 1]);
}

#[test]
fn two_hundred_jobs_with_a_fault_each() {
    let Some(long) = std::env::var_os("SHEETLIGHT_LONG") else { return };
    let count = long.to_str().and_then(|s| s.parse().ok()).filter(|n| *n > 1).unwrap_or(200);
    let done = run(1001..=1000 + count, |seed| FAULTS[seed as usize % FAULTS.len()]);
    let inserted = done.iter().filter(|d| d.1 == Phase::Done).count();
    println!("{} jobs with a fault each: {inserted} inserted, {} safely stopped", done.len(), done.len() - inserted);
}
