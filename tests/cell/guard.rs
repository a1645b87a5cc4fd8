//! In: an arm that does what a test tells it, also what no simulated controller does. Out: whether the rules notice:
//! what is not allowed is not asked of it, what goes wrong halts it, and what is done stands in the log first.
//! Frame and unit: base frame; mm.

use super::workplace::bare;
use sheetlight::arm::rules::{Confirmation, Evidence, Guard, Limits, MotionLog, Plan, Space};
use sheetlight::arm::{Allowed, Arm, Halt, Mode, Motion, PoseSource, State, TimedPose, Way};
use sheetlight::fault::{Fault, Result};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

/// What the arm is and what was asked of it.
struct Inside {
    at: Rigid<Base, Flange>,
    busy: bool,
    /// It stops so far beside its goal, mm.
    short: f64,
    /// The next motion is refused.
    refuses: bool,
    /// Somebody else has it.
    taken: bool,
    made: Vec<Rigid<Base, Flange>>,
    halts: usize,
    /// Read when a motion is made.
    log: std::path::PathBuf,
    log_then: String,
}

#[derive(Clone)]
struct Fake(Arc<Mutex<Inside>>);

impl Fake {
    fn of(&self) -> MutexGuard<'_, Inside> {
        self.0.lock().unwrap()
    }
    /// Motions made and halts asked for.
    fn counted(&self) -> (usize, usize) {
        let inside = self.of();
        (inside.made.len(), inside.halts)
    }
}

impl PoseSource for Fake {
    fn pose(&mut self) -> Result<TimedPose> {
        let now = Instant::now();
        Ok(TimedPose { base_from_flange: self.of().at, figure: None, asked: now, here: now, device: None })
    }
}

impl Halt for Fake {
    fn halt(&self) -> Result<()> {
        self.of().halts += 1;
        Ok(())
    }
}

impl Arm for Fake {
    fn name(&self) -> &str {
        "fake"
    }
    fn state(&mut self) -> Result<State> {
        let (busy, zero) = (Some(self.of().busy), Some(0));
        let (mode, motor, emergency_stop) = (Mode::Automatic, Some(true), Some(false));
        Ok(State { model: "fake".into(), mode, motor, busy, emergency_stop, errors: vec![], tool: zero, work: zero })
    }
    fn watch(&self) -> Result<Box<dyn PoseSource>> {
        Ok(Box::new(self.clone()))
    }
    fn stop(&self) -> Result<Arc<dyn Halt>> {
        Ok(Arc::new(self.clone()))
    }
    fn take(&mut self) -> Result<()> {
        if self.of().taken { Err(Fault::refused("taken by another")) } else { Ok(()) }
    }
    fn make(&mut self, allowed: Allowed) -> Result<()> {
        let mut inside = self.of();
        inside.log_then = std::fs::read_to_string(&inside.log).unwrap_or_default();
        if inside.refuses {
            return Err(Fault::device("the controller is silent"));
        }
        let to = allowed.motion().to;
        inside.made.push(to);
        inside.at = Rigid::new(to.rotation, to.translation + Vec3::new(inside.short, 0.0, 0.0));
        Ok(())
    }
}

const SPACE: Space = Space { from_mm: [150.0, -300.0, 200.0], to_mm: [500.0, 300.0, 700.0] };

fn fake(dir: &tempfile::TempDir, change: impl FnOnce(&mut Limits)) -> (Fake, Guard) {
    let at = Rigid::from_vectors(&Vec3::new(std::f64::consts::PI, 0.0, 0.0), Vec3::new(300.0, 0.0, 590.0));
    let log = dir.path().join("motions.jsonl");
    let inside = Inside {
        at,
        busy: false,
        short: 0.0,
        refuses: false,
        taken: false,
        made: vec![],
        halts: 0,
        log: log.clone(),
        log_then: String::new(),
    };
    let arm = Fake(Arc::new(Mutex::new(inside)));
    // It jumps to its goal: slower, the watch would find it too fast. A machine that stands still is no silent link.
    let mut limits =
        Limits { speed_mm_s: 250.0, max_silence_ms: 5000.0, max_still_ms: 5000.0, ..Limits::within(SPACE) };
    change(&mut limits);
    (arm.clone(), Guard::new(Box::new(arm), Some(limits), bare(), MotionLog::file(&log)))
}

/// Legs that go down by so much each.
fn down(fake: &Fake, by: &[f64]) -> Plan {
    let mut at = fake.of().at;
    let legs = by.iter().map(|mm| {
        at = Rigid::new(at.rotation, at.translation - Vec3::new(0.0, 0.0, *mm));
        Motion { to: at, way: Way::Straight, speed_mm_s: 250.0 }
    });
    let legs = legs.collect();
    Plan { name: "down".into(), why: "a test".into(), legs, evidence: Evidence::default() }
}

type Each<'a> = &'a mut dyn FnMut(&mut dyn Arm, usize) -> Result<()>;

fn made(guard: &mut Guard, plan: Plan, each: Each) -> std::result::Result<(), String> {
    let shown = guard.propose(plan).map_err(|e| e.what)?;
    let yes = Confirmation::of(&*shown.hash);
    guard.make(&shown, yes, each).map_err(|e| e.what)
}

#[test]
fn what_a_motion_comes_to_is_looked_at_and_what_goes_wrong_halts() {
    let dir = tempfile::tempdir().unwrap();
    let (fake, mut guard) = fake(&dir, |_| {});
    guard.arm(true).unwrap();
    // It is on the disk before anything moves, with its pose and its hash.
    made(&mut guard, down(&fake, &[5.0, 5.0]), &mut |_, _| Ok(())).unwrap();
    let log = fake.of().log_then.clone();
    let lines: Vec<serde_json::Value> = log.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.iter().map(|l| l["event"].as_str().unwrap()).collect::<Vec<_>>(), ["asked", "begun"]);
    assert!(lines[0]["hash"] == lines[1]["hash"] && lines[0]["to"].as_array().unwrap().len() == 2);
    assert_eq!(fake.counted(), (2, 0));
    // Elsewhere than it was sent.
    fake.of().short = 1.0;
    let said = made(&mut guard, down(&fake, &[5.0, 5.0]), &mut |_, _| Ok(())).unwrap_err();
    assert!(said.contains("stands 1.00 mm"), "{said}");
    assert_eq!(fake.counted(), (3, 1), "the second leg is not made");
    // Nothing moves until somebody has looked.
    fake.of().short = 0.0;
    let said = made(&mut guard, down(&fake, &[5.0]), &mut |_, _| Ok(())).unwrap_err();
    assert!(said.contains("the arm's place is known is 0.000") && said.contains("stands 1.00 mm"), "{said}");
    assert_eq!(fake.of().made.len(), 3);
    guard.looked().unwrap();
    made(&mut guard, down(&fake, &[5.0]), &mut |_, _| Ok(())).unwrap();
    // What is done at a stop fails; then the motion's own connection does.
    let camera = |_: &mut dyn Arm, _: usize| Err(Fault::device("no picture"));
    let said = made(&mut guard, down(&fake, &[5.0, 5.0]), &mut { camera }).unwrap_err();
    assert!(said.contains("no picture") && fake.counted() == (5, 2), "{said}");
    guard.looked().unwrap();
    fake.of().refuses = true;
    let said = made(&mut guard, down(&fake, &[5.0]), &mut |_, _| Ok(())).unwrap_err();
    assert!(said.contains("silent") && fake.counted() == (5, 3), "{said}");
    fake.of().refuses = false;
    guard.looked().unwrap();
    // STOP while the arm stands between two legs: the next one is not sent.
    let button = guard.stop_button();
    let said = made(&mut guard, down(&fake, &[5.0, 5.0]), &mut |_, _| {
        button.press();
        Ok(())
    });
    assert!(said.unwrap_err().contains("STOP") && fake.of().made.len() == 6);
    guard.looked().unwrap();
    let said = made(&mut guard, down(&fake, &[5.0]), &mut |_, _| Ok(())).unwrap_err();
    assert!(said.contains("STOP was pressed") && fake.of().made.len() == 6, "{said}");
    button.release();
    made(&mut guard, down(&fake, &[5.0]), &mut |_, _| Ok(())).unwrap();
}

#[test]
fn what_changes_between_the_showing_and_the_yes_is_seen() {
    let dir = tempfile::tempdir().unwrap();
    let (fake, mut guard) = fake(&dir, |_| {});
    fake.of().taken = true;
    assert!(guard.arm(true).is_err() && !guard.is_armed());
    fake.of().taken = false;
    guard.arm(true).unwrap();
    let shown = |guard: &mut Guard| {
        let plan = down(&fake, &[5.0]);
        guard.propose(plan).unwrap()
    };
    let yes = |guard: &mut Guard, p: &sheetlight::arm::rules::Proposal| {
        guard.make(p, Confirmation::of(&*p.hash), &mut |_, _| Ok(())).map_err(|e| e.what)
    };
    // A program on the controller begins to run.
    let p = shown(&mut guard);
    assert!(p.passed());
    fake.of().busy = true;
    let said = yes(&mut guard, &p).unwrap_err();
    assert!(said.contains("standing still is 0.000, limit 1.000"), "{said}");
    assert!(!guard.propose(down(&fake, &[5.0])).unwrap().passed());
    fake.of().busy = false;
    // A confirmation is used up by a motion that was begun and stopped, too.
    let p = shown(&mut guard);
    fake.of().refuses = true;
    assert!(yes(&mut guard, &p).is_err());
    fake.of().refuses = false;
    guard.looked().unwrap();
    assert!(yes(&mut guard, &p).unwrap_err().contains("was already used"));
    assert!(fake.of().made.is_empty());
}

#[test]
fn a_yes_to_what_was_shown_too_long_ago_moves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let (fake, mut guard) = fake(&dir, |l| l.max_shown_s = 1.0);
    guard.arm(true).unwrap();
    let shown = guard.propose(down(&fake, &[5.0])).unwrap();
    std::thread::sleep(Duration::from_millis(1100));
    let said = guard.make(&shown, Confirmation::of(&*shown.hash), &mut |_, _| Ok(())).unwrap_err().what;
    assert!(said.contains("limit 1 s") && fake.of().made.is_empty(), "{said}");
}

#[test]
fn limits_hold_whatever_the_station_states() {
    let dir = tempfile::tempdir().unwrap();
    // More than 250 mm/s: it cannot be armed, and the gate has the lower limit anyway.
    let (arm, mut guard) = fake(&dir, |l| l.speed_mm_s = 400.0);
    assert!(guard.arm(true).unwrap_err().what.contains("motion.speed_mm_s is 400, allowed 1..=250"));
    let mut fast = down(&arm, &[5.0]);
    fast.legs[0].speed_mm_s = 300.0;
    let missed = guard.propose(fast).unwrap().missed();
    assert!(missed.iter().any(|m| m == "speed, mm/s is 300.000, limit 250.000"), "{missed:?}");
    // From outside the box no motion begins, not even one into it.
    let (arm, mut guard) = fake(&dir, |l| l.workspace.to_mm[2] = 585.0);
    guard.arm(true).unwrap();
    let missed = guard.propose(down(&arm, &[5.0])).unwrap().missed();
    assert_eq!(missed, ["starts outside the workspace, mm is 5.000, limit 0.000"]);
    // A scan of the future is none.
    let (arm, mut guard) = fake(&dir, |_| {});
    guard.arm(true).unwrap();
    for (age, says) in [(-5.0, "age of the scan, s is inf"), (f64::NAN, "age of the scan, s is inf")] {
        let mut plan = down(&arm, &[5.0]);
        plan.evidence.scan_age_s = Some(age);
        let missed = guard.propose(plan).unwrap().missed();
        assert!(missed.len() == 1 && missed[0].starts_with(says), "{age}: {missed:?}");
    }
    // Numbers that are none are the worst there are, in every leg.
    for k in 0..2 {
        let mut plan = down(&arm, &[5.0, 5.0]);
        plan.legs[k].to.translation.y = f64::NAN;
        let missed = guard.propose(plan).unwrap().missed();
        assert!(missed.iter().any(|m| m.starts_with("outside the workspace, mm is inf")), "{k}: {missed:?}");
    }
}
