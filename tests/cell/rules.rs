//! In: plans of which one thing is wrong, confirmations that do not belong, links and people that go while the arm
//! moves. Out: no motion in the controller's log, or a Halt there in time.
//! Frame and unit: base frame; mm, degrees; ms.

use super::cell;
use super::workplace::bare;
use crate::common::tries::{judged, tries};
use sheetlight::arm::rules::{Carried, Confirmation, Evidence, Guard, Limits, MotionLog, Plan, Space, StopButton};
use sheetlight::arm::{Allowed, Arm, ControllerError, Halt, Mode, Motion, PoseSource, State, TimedPose, Way};
use sheetlight::fault::{Fault, Gate};
use sheetlight::geometry::{Base, Flange, Rigid, Vec3, exp};
use sheetlight_program::cell::{Event, Served};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};
use std::time::{Duration, Instant};

const SPACE: Space = Space { from_mm: [150.0, -300.0, 200.0], to_mm: [500.0, 300.0, 700.0] };

/// The usual limits, and the longest silence: a machine that stands still is silent too, and only one test is about
/// silence.
fn limits() -> Limits {
    Limits { max_silence_ms: 5000.0, max_still_ms: 5000.0, ..Limits::within(SPACE) }
}

fn guard(served: &Served, change: impl FnOnce(&mut Limits)) -> Guard {
    served.controller.set_motor(true);
    let mut limits = limits();
    change(&mut limits);
    let mut guard = carrying(served, limits, bare());
    guard.arm(true).unwrap();
    guard
}

fn carrying(served: &Served, limits: Limits, carried: Carried) -> Guard {
    let link = sheetlight::arm::open(&served.robot_uri()).unwrap();
    Guard::new(link, Some(limits), carried, MotionLog::default())
}

/// A straight motion from the start pose by so much, at a speed.
fn leg(guard: &mut Guard, by: [f64; 3], speed_mm_s: f64) -> Motion {
    let at = guard.link().pose().unwrap().base_from_flange;
    Motion { to: Rigid::new(at.rotation, at.translation + Vec3::from(by)), way: Way::Straight, speed_mm_s }
}

fn plan(legs: Vec<Motion>) -> Plan {
    Plan { name: "test".into(), why: "a test".into(), legs, evidence: Evidence::default() }
}

/// What making a plan says; its own hash confirms it.
fn made(guard: &mut Guard, plan: Plan) -> Result<(), String> {
    let proposal = guard.propose(plan).map_err(|e| e.to_string())?;
    let yes = Confirmation::of(&*proposal.hash);
    guard.make(&proposal, yes, &mut |_, _| Ok(())).map_err(|e| e.to_string())
}

#[test]
fn each_gate_that_is_broken_by_itself_moves_nothing() {
    let served = cell(4, 50.0);
    let mut refusals = Vec::new();
    let mut broken =
        |says: &str, limits: &dyn Fn(&mut Limits), breaks: &dyn Fn(&mut Plan, &Served), mends: &dyn Fn(&Served)| {
            let mut guard = guard(&served, |l| limits(l));
            let good = leg(&mut guard, [10.0, 0.0, -20.0], 50.0);
            let mut plan = plan(vec![good]);
            let before = served.cell.moves();
            breaks(&mut plan, &served);
            let said = made(&mut guard, plan).expect_err(says);
            mends(&served);
            assert!(said.contains(says), "'{says}' is not in: {said}");
            assert_eq!(served.cell.moves(), before, "{says}");
            refusals.push(said.lines().next().unwrap_or("").to_owned());
        };
    let (none, nothing) = (|_: &mut Limits| {}, |_: &Served| {});
    let up = |p: &mut Plan| p.evidence.normal = Some(Vec3::z());
    let poses: [(&str, &dyn Fn(&mut Plan)); 11] = [
        ("orthonormality error of the rotation", &|p| p.legs[0].to.rotation[(0, 0)] = f64::NAN),
        ("orthonormality error of the rotation", &|p| p.legs[0].to.rotation *= 1.001),
        ("speed, mm/s is 51.000, limit 50.000", &|p| p.legs[0].speed_mm_s = 51.0),
        ("slowest speed", &|p| p.legs[0].speed_mm_s = 0.0),
        ("slowest speed", &|p| p.legs[0].speed_mm_s = f64::NAN),
        ("outside the workspace, mm is 20.000, limit 0.000", &|p| p.legs[0].to.translation.x = 520.0),
        ("step, mm is 424.617, limit 400.000", &|p| p.legs[0].to.translation += Vec3::new(0.0, 290.0, -290.0)),
        ("turn, degrees is 130.000, limit 120.000", &|p| {
            p.legs[0].to.rotation *= exp(&Vec3::new(0.0, 0.0, 130f64.to_radians()))
        }),
        ("motions is 0", &|p| p.legs.clear()),
        ("scan of this calibration", &|p| p.evidence.fingerprints = Some(("a".into(), "b".into()))),
        ("age of the scan, s is 901.000, limit 900.000", &|p| p.evidence.scan_age_s = Some(901.0)),
    ];
    for (says, breaks) in poses {
        broken(says, &none, &|p, _| breaks(p), &nothing);
    }
    broken(
        "tilt to the measured normal, degrees is 30.000, limit 25.000",
        &none,
        &|p, _| {
            up(p);
            p.legs[0].to.rotation *= exp(&Vec3::new(30f64.to_radians(), 0.0, 0.0));
        },
        &nothing,
    );
    broken(
        "score is 0.400, limit 0.500",
        &none,
        &|p, _| p.evidence.measured.push(Gate::least("score", 0.4, 0.5)),
        &nothing,
    );
    let wall = |l: &mut Limits| l.keep_out.push(Space { from_mm: [280.0, -50.0, 560.0], to_mm: [400.0, 50.0, 575.0] });
    broken("way through a keep-out", &wall, &|_, _| {}, &nothing);
    broken("automatic mode is 0.000, limit 1.000", &none, &|_, s| s.controller.set_mode(2), &|s| {
        s.controller.set_mode(3)
    });
    broken("motor on is 0.000, limit 1.000", &none, &|_, s| s.controller.set_motor(false), &|s| {
        s.controller.set_motor(true)
    });
    broken("number of the tool is 1.000, limit 0.000", &none, &|_, s| s.controller.set_frames(1, 0), &|s| {
        s.controller.set_frames(0, 0)
    });
    broken("number of the work frame is 3", &none, &|_, s| s.controller.set_frames(0, 3), &|s| {
        s.controller.set_frames(0, 0)
    });
    for says in ["errors on the controller is 1.000, limit 0.000", "on the controller stands 83204072"] {
        broken(says, &none, &|_, s| s.controller.fail(0x8320_4072), &|s| s.controller.clear_errors());
    }
    broken("no emergency stop is 0.000, limit 1.000", &none, &|_, s| s.controller.emergency_stop(), &|s| {
        s.controller.release_emergency_stop();
        s.controller.clear_errors();
        s.controller.set_motor(true);
    });
    broken(
        "out of reach",
        &|l| l.workspace.to_mm = [900.0; 3],
        &|p, _| p.legs[0].to.translation += Vec3::new(300.0, 200.0, 0.0),
        &nothing,
    );
    broken(
        "fence",
        &none,
        &|_, s| s.controller.set_fence(Some([Vec3::new(305.0, -5.0, 560.0), Vec3::new(320.0, 5.0, 575.0)])),
        &|s| s.controller.set_fence(None),
    );
    println!("{} gates broken, 0 moves:\n  {}", refusals.len(), refusals.join("\n  "));
}

#[test]
fn one_confirmation_moves_once_and_only_what_was_shown() {
    let served = cell(5, 50.0);
    let mut guard = guard(&served, |_| {});
    let (near, far) = (leg(&mut guard, [0.0, 0.0, -10.0], 50.0), leg(&mut guard, [0.0, 0.0, -40.0], 50.0));
    let (shown, other) = (guard.propose(plan(vec![near])).unwrap(), guard.propose(plan(vec![far])).unwrap());
    let same = guard.propose(plan(vec![near])).unwrap();
    assert!(shown.passed() && shown.hash != same.hash, "each showing has its own hash");
    let mut make = |p, hash: &str| guard.make(p, Confirmation::of(hash), &mut |_, _| Ok(())).map_err(|e| e.what);
    assert!(make(&other, &shown.hash).unwrap_err().contains("the confirmation belongs to"));
    assert!(make(&same, &shown.hash).is_err() && make(&shown, "").is_err());
    assert_eq!(served.cell.moves(), 0);
    make(&shown, &shown.hash).unwrap();
    assert!(make(&shown, &shown.hash).unwrap_err().contains("was already used"));
    assert!(make(&other, &other.hash).unwrap_err().contains("the arm moved by 10.00 mm"), "it starts elsewhere now");
    assert_eq!(served.cell.moves(), 1);
}

#[test]
fn nothing_moves_unarmed_nor_while_another_has_the_arm() {
    let served = cell(6, 50.0);
    served.controller.set_motor(true);
    let open = || sheetlight::arm::open(&served.robot_uri()).unwrap();
    let mut reader = Guard::new(open(), Some(limits()), bare(), MotionLog::default());
    let good = leg(&mut reader, [0.0, 0.0, -10.0], 50.0);
    assert!(made(&mut reader, plan(vec![good])).unwrap_err().contains("armed"));
    assert!(reader.arm(false).unwrap_err().next.contains("--allow-motion"));
    assert!(Guard::new(open(), None, bare(), MotionLog::default()).arm(true).unwrap_err().cause.contains("[motion]"));
    let _first = guard(&served, |_| {});
    let said = reader.arm(true).unwrap_err().what;
    assert!(said.contains("TakeArm") && said.contains("8320F001"), "{said}");
    assert_eq!(served.cell.moves(), 0);
}

/// What stops a motion, and how.
struct Stopped<'a> {
    /// Of the controller's address.
    uri: &'a str,
    /// Longest silence, ms.
    silence_ms: f64,
    /// Longest stand on the way, ms.
    still_ms: f64,
    /// What is done to it on its way; none: the motion itself is what is wrong, from its beginning on.
    does: Option<fn(&Served, &StopButton, &AtomicBool)>,
    /// What is wrong with the controller before it is armed.
    before: fn(&Served),
    /// What the guard says of it, in part.
    says: &'a str,
    /// The Halt has to be at the controller within so many ms.
    within_ms: f64,
}

impl Stopped<'_> {
    /// Stops a motion of 100 mm at 20 mm/s: how long after there was a reason the Halt was at the controller, ms of
    /// the cell, which runs in real time. Where the machine stood still the motion may have ended, or silence may
    /// have stopped it, before anything is done to it.
    fn once(&self) -> Result<f64, String> {
        let served = cell(7, 1.0);
        served.controller.set_motor(true);
        (self.before)(&served);
        let link = sheetlight::arm::open(&format!("{}{}", served.robot_uri(), self.uri)).unwrap();
        let limits = Limits { max_silence_ms: self.silence_ms, max_still_ms: self.still_ms, ..limits() };
        let mut guard = Guard::new(link, Some(limits), bare(), MotionLog::default());
        guard.arm(true).unwrap();
        let (button, signal) = (guard.stop_button(), Arc::new(AtomicBool::new(false)));
        button.listen(signal.clone());
        let long = leg(&mut guard, [60.0, 0.0, -80.0], 20.0);
        let proposal = guard.propose(plan(vec![long])).unwrap();
        let (made, done): (_, Option<f64>) = std::thread::scope(|threads| {
            let moving = threads.spawn(|| {
                let yes = Confirmation::of(&*proposal.hash);
                guard.make(&proposal, yes, &mut |_, _| Ok(()))
            });
            while served.cell.moves() == 0 && !moving.is_finished() {
                std::thread::sleep(Duration::from_millis(1));
            }
            let done = self.does.map(|does| {
                std::thread::sleep(Duration::from_millis(150));
                let now = served.cell.clock().now();
                does(&served, &button, &signal);
                now
            });
            (moving.join().unwrap(), done)
        });
        let said = made.err().ok_or("the motion came to its end")?.what;
        assert!(guard.unknown().is_some(), "it must say that the place is unknown");
        assert_eq!(served.cell.moves(), 1);
        let log = served.cell.log();
        let when = |what: fn(&Event) -> bool| log.iter().find(|e| what(&e.event)).map(|e| e.t_s);
        let halt = when(|e| matches!(e, Event::Halt { moving: true, .. }));
        let since = done.or_else(|| when(|e| matches!(e, Event::Move { .. }))).expect("it moved");
        let ms = (halt.ok_or_else(|| format!("not halted on its way: {said}"))? - since) * 1e3;
        judged(ms, said.contains(self.says) && ms > 0.0 && ms < self.within_ms, format!("{ms} ms, {said}"))
    }

    /// The same with a controller that does not say that it is simulated, and whose stamps turn wrong on the way.
    fn stamped(&self, does: fn(&Served, &StopButton, &AtomicBool)) -> f64 {
        Stopped { does: Some(does), before: |s| s.controller.as_real(), ..*self }.in_time()
    }

    fn in_time(&self) -> f64 {
        tries(10, || self.once())
    }
}

#[test]
fn whoever_goes_while_the_arm_moves_halts_it_in_time() {
    let usual = Stopped {
        uri: "",
        silence_ms: 5000.0,
        still_ms: 5000.0,
        does: None,
        before: |_| {},
        says: "",
        within_ms: 50.0,
    };
    let stop = Stopped { does: Some(|_, button, _| button.press()), says: "STOP", ..usual }.in_time();
    let signal = Stopped { does: Some(|_, _, up| up.store(true, SeqCst)), says: "told to end", ..usual }.in_time();
    let lease = Stopped {
        does: Some(|_, button, _| button.lease(Duration::from_millis(100))),
        says: "lease ran out",
        within_ms: 150.0,
        ..usual
    };
    let lease = lease.in_time();
    // One call of the link ends its connection: the one that reads poses.
    let cut = Stopped { does: Some(|s, _, _| s.faults.cut.store(1, SeqCst)), says: "link was lost", ..usual }.in_time();
    // The controller's full speed is four times what the link was told.
    let fast = Stopped { uri: "?full=250", says: "mm/s, limit 35", within_ms: 1500.0, ..usual }.in_time();
    // Nothing is cut, but no pose comes any more.
    let silent = Stopped {
        silence_ms: 200.0,
        does: Some(|s, _, _| s.faults.lose.store(1, SeqCst)),
        says: "no pose for",
        within_ms: 250.0,
        ..usual
    };
    let silent = silent.in_time();
    // Its poses stand while it moves, with fresh times.
    let frozen = Stopped {
        still_ms: 300.0,
        does: Some(|s, _, _| s.controller.freeze()),
        says: "has not changed for",
        within_ms: 400.0,
        ..usual
    };
    let frozen = frozen.in_time();
    println!("halt at the controller after ms: poses that stand for 300 {frozen:.1}");
    println!(
        "halt at the controller after ms: STOP {stop:.1}, signal {signal:.1}, lease of 100 {lease:.1}, link cut \
         {cut:.1}, four times as fast {fast:.1}, silence of 200 {silent:.1}"
    );
}

#[test]
fn a_controller_whose_time_is_not_ours_is_halted() {
    let usual = Stopped {
        uri: "",
        silence_ms: 5000.0,
        still_ms: 5000.0,
        does: None,
        before: |_| {},
        says: "time stamps stand still or have another unit",
        within_ms: 400.0,
    };
    let stamps: [fn(&Served, &StopButton, &AtomicBool); 3] = [
        |s, _, _| s.controller.stamp_with(|ms| ms * 1e-3),
        |s, _, _| s.controller.stamp_with(|ms| ms * 1e3),
        |s, _, _| s.controller.stamp_with(|_| 12345.0),
    ];
    for stamp in stamps {
        println!("halt at the controller after {:.1} ms", usual.stamped(stamp));
    }
    let lost = Stopped { says: "are accepted", within_ms: 50.0, ..usual };
    let never: [fn(&Served, &StopButton, &AtomicBool); 2] =
        [|s, _, _| s.controller.stamp_with(|_| f64::INFINITY), |s, _, _| s.controller.stamp_with(|_| 1e20)];
    for stamp in never {
        println!("lost link: halt at the controller after {:.1} ms", lost.stamped(stamp));
    }
}

#[test]
fn a_right_motion_at_the_slowest_speed_is_not_halted() {
    tries(5, || {
        let served = cell(7, 1.0);
        served.controller.as_real();
        let mut guard = guard(&served, |l| l.max_still_ms = 300.0);
        // The link sends 0.1 % at least, 1 mm/s: what is slower would be made faster than it was confirmed.
        let slower = leg(&mut guard, [0.0, 0.0, -1.5], 0.1);
        let said = made(&mut guard, plan(vec![slower])).unwrap_err();
        assert!(said.contains("0.10 mm/s is 0.010 %"), "{said}");
        let slow = leg(&mut guard, [0.0, 0.0, -1.5], 1.0);
        let said = made(&mut guard, plan(vec![slow]));
        judged((), said.is_ok(), format!("{said:?}"))
    });
}

#[test]
fn a_turn_that_is_faster_than_it_was_confirmed_is_halted() {
    tries(5, || {
        let served = cell(7, 1.0);
        served.controller.set_motor(true);
        // The controller turns ten times as fast as its link was told.
        let link = sheetlight::arm::open(&format!("{}?turn=20", served.robot_uri())).unwrap();
        let mut guard = Guard::new(link, Some(limits()), bare(), MotionLog::default());
        guard.arm(true).unwrap();
        let mut turned = leg(&mut guard, [0.0; 3], 50.0);
        turned.to.rotation *= exp(&Vec3::new(0.0, 0.0, 90f64.to_radians()));
        let said = made(&mut guard, plan(vec![turned])).err().ok_or("the turn came to its end")?;
        assert!(said.contains("the flange turns at") && said.contains("limit 39.5"), "{said}");
        let halted = served.cell.log().iter().any(|e| matches!(e.event, Event::Halt { moving: true, .. }));
        judged((), halted, "the arm had arrived before it was halted")
    });
}

#[test]
fn what_the_flange_carries_keeps_out_and_what_nobody_judged_is_shown() {
    let served = cell(4, 50.0);
    served.controller.set_motor(true);
    let wall = Space { from_mm: [280.0, -50.0, 400.0], to_mm: [400.0, 50.0, 480.0] };
    let proposal = |carried: Carried| {
        let mut guard = carrying(&served, Limits { keep_out: vec![wall], ..limits() }, carried);
        guard.arm(true).unwrap();
        let beside = leg(&mut guard, [20.0, 0.0, -20.0], 50.0);
        let from = guard.link().pose().unwrap().base_from_flange;
        let clear = guard.keeps_clear(&from, &beside.to);
        (guard.propose(plan(vec![beside])).unwrap(), clear)
    };
    let far = |x: f64, z: f64| Vec3::new(x, 0.0, z);
    // The flange passes above the wall; a tool, or the sensor's far corner alone, would not.
    let (shown, clear) = proposal(bare());
    assert!(shown.passed() && clear, "{:?}", shown.missed());
    assert_eq!(shown.unjudged, ["the tool: none is described in station.toml"]);
    for carried in [
        Carried::new(Some(far(0.0, 140.0)), Ok(vec![])),
        Carried::new(None, Ok(vec![far(0.0, 30.0), far(20.0, 120.0)])),
    ] {
        let (shown, clear) = proposal(carried);
        assert!(!clear && shown.missed()[0].starts_with("way through a keep-out"), "{:?}", shown.missed());
    }
    let (shown, _) = proposal(Carried::new(Some(far(0.0, 20.0)), Err("nobody knows".into())));
    assert!(shown.passed() && shown.unjudged == ["the sensor head: nobody knows"], "{:?}", shown.unjudged);
}

#[test]
fn a_way_that_the_controller_does_not_begin_leaves_a_known_place() {
    // The wrist would pass near its stretched pose: both ends are within reach, the straight way is not.
    let not_begun = |off: f64| {
        let served = cell(8, 50.0);
        let mut guard = guard(&served, |_| {});
        let mut turned = leg(&mut guard, [0.0, 0.0, 0.0], 50.0);
        turned.to.rotation = exp(&(Vec3::new(off, -1.0, 0.0).normalize() * 115f64.to_radians())) * turned.to.rotation;
        let proposal = guard.propose(plan(vec![turned])).unwrap();
        assert!(proposal.passed(), "{:?}", proposal.missed());
        let yes = Confirmation::of(&*proposal.hash);
        let Ok(Some(refusal)) = guard.attempt(&proposal, yes, &mut |_, _| Ok(())) else { return false };
        println!("{refusal}");
        assert!(guard.unknown().is_none() && served.cell.moves() == 0, "{refusal}");
        // Something else may be done at once, with a confirmation of its own.
        let near = leg(&mut guard, [0.0, 0.0, -10.0], 50.0);
        made(&mut guard, plan(vec![near])).unwrap();
        served.cell.moves() == 1
    };
    assert!([0.003, 0.008, 0.015].into_iter().any(not_begun));
}

#[test]
fn a_figure_that_changes_is_refused_before_and_halted_on_the_way() {
    let served = cell(8, 1.0);
    let mut guard = guard(&served, |_| {});
    let figure = guard.link().pose().unwrap().figure.expect("Denso says it");
    // So slow that it is still on its way when a machine that stood still for seconds has read the figure.
    let long = leg(&mut guard, [40.0, 0.0, -40.0], 5.0);
    served.controller.turn_figure(figure ^ 4);
    let said = made(&mut guard, plan(vec![long])).unwrap_err();
    assert!(
        said.contains(&format!("the arm configuration changed during the motion, from {figure} to {}", figure ^ 4)),
        "{said}"
    );
    let halted =
        |served: &Served| served.cell.log().iter().any(|e| matches!(e.event, Event::Halt { moving: true, .. }));
    assert!(halted(&served) && guard.unknown().is_some());
    // What was shown with one figure is not made with another.
    guard.looked().unwrap();
    let back = leg(&mut guard, [0.0, 0.0, 10.0], 40.0);
    let shown = guard.propose(plan(vec![back])).unwrap();
    assert!(shown.passed(), "{:?}", shown.missed());
    served.controller.turn_figure(figure);
    let before = served.cell.moves();
    // The other program that brings the arm to the same place.
    served.controller.turned_figure();
    let said = guard.make(&shown, Confirmation::of(&*shown.hash), &mut |_, _| Ok(())).unwrap_err().what;
    assert!(said.contains(&format!("the arm configuration is {figure}; it was {}", figure ^ 4)), "{said}");
    assert_eq!(served.cell.moves(), before);
}

#[test]
fn a_flange_that_leaves_the_workspace_on_its_way_is_halted() {
    // In real time the way outside takes long enough for a machine that stands still for a second or two.
    let served = cell(9, 1.0);
    let to = |guard: &mut Guard, y: f64, way: Way, speed_mm_s: f64| {
        let at = guard.link().pose().unwrap().base_from_flange;
        Motion { to: Rigid::new(at.rotation, Vec3::new(260.0, y, 590.0)), way, speed_mm_s }
    };
    let mut first = guard(&served, |l| l.speed_mm_s = 250.0);
    let aside = to(&mut first, -150.0, Way::Straight, 250.0);
    made(&mut first, plan(vec![aside])).unwrap();
    drop(first);
    // By joints the flange goes round the base, 300 mm from it: both ends are in the box, the way is not.
    let mut second = guard(&served, |l| l.workspace.to_mm[0] = 275.0);
    let round = to(&mut second, 150.0, Way::Joint, 50.0);
    let said = made(&mut second, plan(vec![round])).unwrap_err();
    assert!(said.contains("mm outside the workspace, limit 1"), "{said}");
    assert!(served.cell.log().iter().any(|e| matches!(e.event, Event::Halt { moving: true, .. })));
    let now = served.cell.true_flange(served.cell.clock().now()).translation;
    assert!(now.y < 100.0, "{now:?}");
}

/// An arm that refuses every motion; what it is like afterwards.
struct Stubborn {
    at: Rigid<Base, Flange>,
    fault: fn() -> Fault,
    then: fn(&mut Stubborn),
    state: State,
    mute: bool,
    halts: Arc<AtomicUsize>,
}

struct Counted(Arc<AtomicUsize>);

impl Halt for Counted {
    fn halt(&self) -> Result<(), Fault> {
        self.0.fetch_add(1, SeqCst);
        Ok(())
    }
}

struct Stands(Rigid<Base, Flange>);

fn timed(base_from_flange: Rigid<Base, Flange>) -> TimedPose {
    let now = Instant::now();
    TimedPose { base_from_flange, figure: None, asked: now, here: now, device: None }
}

impl PoseSource for Stands {
    fn pose(&mut self) -> Result<TimedPose, Fault> {
        Ok(timed(self.0))
    }
}

impl PoseSource for Stubborn {
    fn pose(&mut self) -> Result<TimedPose, Fault> {
        Ok(timed(self.at))
    }
}

impl Arm for Stubborn {
    fn name(&self) -> &str {
        "stubborn"
    }
    fn state(&mut self) -> Result<State, Fault> {
        if self.mute { Err(Fault::device("no answer")) } else { Ok(self.state.clone()) }
    }
    fn watch(&self) -> Result<Box<dyn PoseSource>, Fault> {
        Ok(Box::new(Stands(self.at)))
    }
    fn stop(&self) -> Result<Arc<dyn Halt>, Fault> {
        Ok(Arc::new(Counted(self.halts.clone())))
    }
    fn take(&mut self) -> Result<(), Fault> {
        Ok(())
    }
    fn make(&mut self, _: Allowed) -> Result<(), Fault> {
        (self.then)(self);
        Err((self.fault)())
    }
}

/// What is said, whether the place is unknown afterwards, how often it was halted.
fn refused_by(fault: fn() -> Fault, then: fn(&mut Stubborn)) -> (bool, bool, usize) {
    let at = Rigid::new(sheetlight::geometry::Mat3::identity(), Vec3::new(300.0, 0.0, 400.0));
    let state = State {
        model: "stubborn".into(),
        mode: Mode::Automatic,
        motor: Some(true),
        busy: Some(false),
        emergency_stop: Some(false),
        errors: vec![],
        tool: Some(0),
        work: Some(0),
    };
    let halts = Arc::new(AtomicUsize::new(0));
    let arm = Stubborn { at, fault, then, state, mute: false, halts: halts.clone() };
    let mut guard = Guard::new(Box::new(arm), Some(limits()), bare(), MotionLog::default());
    guard.arm(true).unwrap();
    let down = leg(&mut guard, [0.0, 0.0, -10.0], 50.0);
    let proposal = guard.propose(plan(vec![down])).unwrap();
    let yes = Confirmation::of(&*proposal.hash);
    let said = guard.attempt(&proposal, yes, &mut |_, _| Ok(()));
    (matches!(said, Ok(Some(_))), guard.unknown().is_some(), halts.load(SeqCst))
}

#[test]
fn an_order_that_was_answered_with_an_error_is_known_only_where_nothing_moved() {
    let code: fn() -> Fault = || Fault::refused("83204073");
    assert_eq!(refused_by(code, |_| {}), (true, false, 0), "the arm stands as before");
    let unknown = (false, true, 1);
    assert_eq!(refused_by(|| Fault::device("silence"), |_| {}), unknown, "no answer: it may have begun");
    assert_eq!(refused_by(code, |a| a.at.translation.z -= 0.05), unknown, "it has moved");
    assert_eq!(refused_by(code, |a| a.at.rotation = exp(&Vec3::new(0.0, 0.0, 2e-4))), unknown, "it has turned");
    assert_eq!(refused_by(code, |a| a.state.busy = Some(true)), unknown, "it moves");
    assert_eq!(refused_by(code, |a| a.state.busy = None), unknown, "nobody says whether it moves");
    assert_eq!(refused_by(code, |a| a.state.emergency_stop = Some(true)), unknown, "somebody stopped it");
    assert_eq!(refused_by(code, |a| a.mute = true), unknown, "its state cannot be read");
    let error = |a: &mut Stubborn| a.state.errors = vec![ControllerError { code: 1, text: String::new() }];
    assert_eq!(refused_by(code, error), unknown, "an error stands: a person clears it");
}
