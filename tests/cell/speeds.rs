//! Whether anything that the flange carries ever moves faster than the station allows, by the simulated controller's
//! own account of its joints.

use super::workplace::bare;
use sheetlight::arm::rules::{Carried, Confirmation, Guard, Limits, MotionLog, Plan, Space, Straight};
use sheetlight::arm::{Motion, Way};
use sheetlight::geometry::{Rigid, Vec3, exp};
use sheetlight_program::cell::{Cell, Served};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::SeqCst};
use std::thread::JoinHandle;
use std::time::Duration;

/// From one look to the next, s of the cell.
const STEP_S: f64 = 0.004;
/// What a test allows above a limit: the controller's ramps and its whole per mille.
pub const ROOM: f64 = 1.05;
/// Off the flange, mm.
pub const HEAD: [f64; 3] = [-180.0, 0.0, 240.0];

/// Follows a cell from now on.
pub struct Speeds {
    over: Arc<AtomicBool>,
    follows: JoinHandle<f64>,
}

impl Speeds {
    /// Of these points on its flange.
    pub fn follow(cell: &Cell, points: Vec<Vec3>) -> Speeds {
        let (over, cell) = (Arc::new(AtomicBool::new(false)), cell.clone());
        let ends = over.clone();
        let follows = std::thread::spawn(move || {
            let mut t = cell.clock().now();
            let (mut before, mut most) = (cell.reported(t), 0f64);
            loop {
                let (last, now) = (ends.load(SeqCst), cell.clock().now());
                while t + STEP_S < now {
                    t += STEP_S;
                    let at = cell.reported(t);
                    let speed = |p: &Vec3| (at.point(p) - before.point(p)).norm() / STEP_S;
                    most = points.iter().map(speed).fold(most, f64::max);
                    before = at;
                }
                if last {
                    return most;
                }
                std::thread::sleep(Duration::from_millis(2));
            }
        });
        Speeds { over, follows }
    }

    /// The greatest speed of any of them, mm/s.
    pub fn fastest(self) -> f64 {
        self.over.store(true, SeqCst);
        self.follows.join().unwrap()
    }
}

const SPACE: Space = Space { from_mm: [150.0, -300.0, 200.0], to_mm: [500.0, 300.0, 700.0] };

/// Makes one straight motion; the greatest speed of the points, and what the limits of speed and turn allow the
/// fastest of what it carries, mm/s.
fn once(served: &Served, carried: Carried, points: Vec<Vec3>, speed_mm_s: f64, turn: Vec3, shift: Vec3) -> (f64, f64) {
    served.controller.set_motor(true);
    let limits = Limits { speed_mm_s, max_silence_ms: 5000.0, max_still_ms: 5000.0, ..Limits::within(SPACE) };
    let limits_turn = limits.max_turn_deg_s.to_radians();
    let link = sheetlight::arm::open(&served.robot_uri()).unwrap();
    let mut guard = Guard::new(link, Some(limits), carried.clone(), MotionLog::default());
    guard.arm(true).unwrap();
    let at = guard.link().pose().unwrap().base_from_flange;
    let to = Rigid::new(at.rotation * exp(&turn), at.translation + shift);
    let leg = Motion { to, way: Way::Straight, speed_mm_s };
    let proposal = guard.propose(Plan::single("turn", "a test", leg)).unwrap();
    assert!(proposal.passed(), "{:?}", proposal.missed());
    let (way, speeds) = (Straight::new(&at, &to), Speeds::follow(&served.cell, points));
    let turning = carried.fastest(&way) * limits_turn / way.turn.norm();
    guard.make(&proposal, Confirmation::of(&*proposal.hash), &mut |_, _| Ok(())).unwrap();
    (speeds.fastest(), speed_mm_s.min(turning))
}

#[test]
fn tip_and_head_keep_the_speed_in_turns() {
    let (tip, head) = (Vec3::new(72.0, 0.0, 160.0), Vec3::from(HEAD));
    let carried = || Carried::new(Some(tip), Ok(vec![head]));
    let turn = |deg: f64| Vec3::new(0.0, 0.0, deg.to_radians());
    let tilt = |deg: f64| Vec3::new(deg.to_radians(), 0.0, 0.0);
    for (turn, shift) in [
        (turn(100.0), Vec3::zeros()),
        (tilt(25.0), Vec3::zeros()),
        (turn(-60.0), Vec3::new(30.0, 60.0, -50.0)),
        (turn(2.0), Vec3::new(0.0, -120.0, 20.0)),
    ] {
        for speed in [50.0, 250.0] {
            let served = super::cell(7, 10.0);
            let (most, allowed) = once(&served, carried(), vec![Vec3::zeros(), tip, head], speed, turn, shift);
            println!("limit {speed}: fastest {most:.1} mm/s of {allowed:.1}, turn {turn:?}, shift {shift:?}");
            assert!(most <= ROOM * allowed && allowed <= speed, "{most} mm/s, limit {allowed}");
            // Not slower than the rules ask either.
            assert!(most > 0.9 * allowed, "{most} mm/s, limit {allowed}");
        }
    }
}

#[test]
fn a_flange_that_carries_nothing_turns_no_faster_than_its_limit() {
    let served = super::cell(7, 10.0);
    // A point far out that nobody has described: 30 degrees a second of it.
    let out = Vec3::new(0.0, 1000.0, 0.0);
    let (most, _) = once(&served, bare(), vec![out], 250.0, Vec3::new(0.0, 0.0, 1.5), Vec3::zeros());
    assert!(most <= ROOM * 30f64.to_radians() * 1000.0 && most > 400.0, "{most}");
}
