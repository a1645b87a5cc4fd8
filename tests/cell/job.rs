//! In: simulated cells with a part somewhere below the arm, a person who says yes. Out: whether the job inserts it, judged by the
//! cell's truth; whether it keeps away from what is missing, wrong or hidden; whether it survives being cut off.
//! Frame and unit: mm, degrees, s.

use sheetlight::arm::rules::{Confirmation, Guard, Limits, MotionLog, Space};
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::cell::{Cell, CellOptions, Insertion, Served};
use sheetlight::fault::Result;
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::simulate::SceneSpec;
use sheetlight::station::job::{Ask, Job, JobOptions, JobReport, JobState, Operator, Outcome, Phase};
use sheetlight::station::{Settings, ToolSpec};
use std::path::{Path, PathBuf};

/// A person who says yes to every motion that is shown, up to a step.
pub struct Yes {
    no_at: Option<&'static str>,
    asked: Vec<&'static str>,
    pub told: Vec<String>,
}

impl Yes {
    pub fn always() -> Yes {
        Yes { no_at: None, asked: vec![], told: vec![] }
    }
}

impl Operator for Yes {
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>> {
        self.asked.push(ask.step);
        Ok((self.no_at != Some(ask.step)).then(|| Confirmation::of(&*ask.proposal.hash)))
    }
    fn tell(&mut self, line: &str) {
        self.told.push(line.to_owned());
    }
}

/// The circuit board with one part of the shipped scene alone, turned by the seed.
pub fn scene(part: &str, seed: u64) -> SceneSpec {
    let dimm = include_str!("../../data/scenes/dimm.toml");
    let text = if part == "dimm" { dimm } else { sheetlight::simulate::DEFAULT_SCENE };
    let mut spec = SceneSpec::parse(text).unwrap();
    spec.part.retain(|p| p.name == part);
    spec.solid.truncate(2);
    let k = seed as f64;
    if let Some(p) = spec.part.first_mut() {
        // A long part fills the picture: it is turned less.
        let most = if part == "dimm" { 2.0 } else { 8.0 };
        (p.at_mm[0], p.at_mm[1], p.turn_deg) = (0.0, 0.0, most * (0.7 * k).sin());
    }
    spec
}

/// A cell with a scene, its station folder with the true calibration, and everything a job needs.
struct Set {
    served: Served,
    station: PathBuf,
    _dir: tempfile::TempDir,
}

fn set(mut spec: SceneSpec, seed: u64, tilt_deg: f64) -> Set {
    let options = CellOptions { speed: 20.0, tilt_deg, ..CellOptions::of(spec.clone(), seed) };
    let served = Served::here(Cell::new(options).unwrap()).unwrap();
    // The operator jogs until the part is in view; here it is laid where the camera looks, by some millimetres.
    let camera = served.cell.true_flange(0.0) * served.cell.station().flange_from_camera;
    let seen = served.cell.base_from_scene().inverse() * camera;
    let axis = seen.rotation.column(2).into_owned();
    let foot = seen.translation - axis * (seen.translation.z / axis.z);
    let k = seed as f64;
    (spec.part[0].at_mm[0], spec.part[0].at_mm[1]) = (foot.x + 4.0 * (1.3 * k).sin(), foot.y + 4.0 * (2.1 * k).cos());
    served.cell.lay(&spec, None).unwrap();
    served.controller.set_motor(true);
    let dir = tempfile::tempdir().unwrap();
    let station = dir.path().join("station");
    std::fs::create_dir_all(&station).unwrap();
    served.cell.station().store(&station).unwrap();
    let workspace = Space { from_mm: [150.0, -300.0, 250.0], to_mm: [600.0, 300.0, 700.0] };
    let tool = Some(ToolSpec { flange_from_tool: served.cell.flange_from_tool() });
    // Two busy cores may keep the link's threads waiting for long; that a silent link halts is shown by the rules' own test.
    let motion = Limits { max_silence_ms: 3000.0, ..Limits::within(workspace) };
    Settings { motion: Some(motion), tool, ..Settings::default() }.store(&station).unwrap();
    Set { served, station, _dir: dir }
}

impl Set {
    fn options(&self, recipe: &str, out: &str, sweep_mm: f64) -> JobOptions {
        JobOptions {
            station: self.station.clone(),
            recipe: Path::new(env!("CARGO_MANIFEST_DIR")).join("data/recipes").join(recipe),
            out: self._dir.path().join(out),
            robot: Convention::Denso,
            place: Where::Cpu,
            speed_mm_s: None,
            sweep_mm: Some(sweep_mm),
            max_tilt_deg: 3.0,
        }
    }

    fn guard(&self) -> Guard {
        let limits = Settings::load(&self.station).unwrap().motion;
        let log = MotionLog::file(&self._dir.path().join("motions.jsonl"));
        let mut guard = Guard::new(sheetlight::arm::open(&self.served.robot_uri()).unwrap(), limits, log);
        guard.arm(true).unwrap();
        guard
    }

    fn run(&self, options: &JobOptions, who: &mut Yes) -> Result<JobReport> {
        let camera = CellCamera::open(&self.served.camera.to_string(), -1.0)?;
        let mut guard = self.guard();
        Job::open(options, &mut guard, Box::new(camera), who)?.run()
    }
}

/// Runs a job to its end; the insertion as the truth judges it.
fn inserted(part: &str, seed: u64, tilt_deg: f64, sweep_mm: f64) -> (JobReport, Option<Insertion>, usize, Vec<String>) {
    let set = set(scene(part, seed), seed, tilt_deg);
    let mut who = Yes::always();
    let report = set.run(&set.options(&format!("{part}.toml"), "job", sweep_mm), &mut who).unwrap();
    let t = set.served.cell.clock().now();
    println!("{part} seed {seed}: {:?} after {:.0} s of the cell; {:?}", report.outcome, t, report.why);
    for line in &who.told {
        println!("  {line}");
    }
    (report, set.served.cell.insertion(), set.served.cell.collisions(), who.told)
}

#[test]
fn a_component_goes_into_its_socket() {
    let (report, insertion, collisions, _) = inserted("osc", 3, 5.0, 34.0);
    assert_eq!(report.outcome, Outcome::Inserted, "{}", report.why);
    let judged = insertion.expect("the gripper has let go");
    println!("{judged:?}");
    assert!(judged.inserted && judged.lateral_mm <= 0.15 && collisions == 0, "{judged:?}, {collisions} collisions");
    assert_eq!((report.confirmations_to_position, report.confirmations), (Some(3), 5));
}

#[test]
fn sockets_of_many_cells_are_filled() {
    let Some(long) = std::env::var_os("SHEETLIGHT_LONG") else { return };
    let seeds = long.to_str().and_then(|s| s.parse().ok()).filter(|n| *n > 1).unwrap_or(20);
    let (mut squares, mut worst, mut count) = (0.0, 0f64, 0);
    for seed in 1..=seeds {
        for (part, sweep) in [("led", 40.0), ("osc", 34.0), ("flash", 44.0), ("dimm", 40.0)] {
            let (report, insertion, collisions, _) = inserted(part, seed, 10.0, sweep);
            assert_eq!(report.outcome, Outcome::Inserted, "{part} {seed}: {}", report.why);
            let judged = insertion.unwrap();
            assert!(judged.inserted && collisions == 0, "{part} {seed}: {judged:?}");
            squares += judged.lateral_mm * judged.lateral_mm;
            (worst, count) = (worst.max(judged.lateral_mm), count + 1);
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("{count} of {count} inserted, lateral rms {rms:.4} mm, worst {worst:.4} mm");
    assert!(rms <= 0.06 && worst <= 0.15);
}

#[test]
fn nothing_moves_towards_a_part_that_is_another_one() {
    // An LED's socket lies there, the oscillator's is looked for.
    let set = set(scene("led", 2), 2, 2.0);
    let mut who = Yes::always();
    let report = set.run(&set.options("osc.toml", "job", 24.0), &mut who).unwrap();
    assert_eq!(report.outcome, Outcome::Stopped);
    assert!(!report.why.is_empty() && !who.asked.contains(&"approach"), "{}: {:?}", report.why, who.asked);
    let moves = set.served.cell.moves();
    println!("{}; {moves} moves, all of touch and scan", report.why);
    // A no at the first question moves nothing at all.
    let mut no = Yes { no_at: Some("touch"), ..Yes::always() };
    let report = set.run(&set.options("osc.toml", "another", 24.0), &mut no).unwrap();
    assert!(report.why.contains("by the operator") && set.served.cell.moves() == moves);
}

#[test]
fn a_job_that_was_cut_off_backs_out_or_goes_on() {
    let set = set(scene("osc", 1), 1, 0.0);
    let options = set.options("osc.toml", "job", 20.0);
    std::fs::create_dir_all(&options.out).unwrap();
    let start = set.served.cell.true_flange(0.0);
    // As kill -9 in the motion down leaves it.
    let down = sheetlight::geometry::Rigid::new(
        start.rotation,
        start.translation - sheetlight::geometry::Vec3::new(0.0, 0.0, 40.0),
    );
    let above = |mm: f64| {
        sheetlight::geometry::Rigid::new(
            start.rotation,
            down.translation + sheetlight::geometry::Vec3::new(0.0, 0.0, mm),
        )
    };
    let state = JobState {
        phase: Phase::Insert,
        moving: true,
        poses: Some([above(30.0), down, above(60.0)]),
        ..JobState::new(start)
    };
    state.store(&options.out).unwrap();
    let mut who = Yes::always();
    let report = set.run(&options, &mut who).unwrap();
    assert_eq!(who.asked, ["retract"]);
    assert!(report.outcome == Outcome::Stopped && report.why.contains("backed out"), "{}", report.why);
    let now = set.served.cell.true_flange(set.served.cell.clock().now());
    let rose = now.translation.z - start.translation.z;
    assert!((rose - 20.0).abs() < 0.5 && set.served.cell.insertion().is_none(), "{rose}");
    // What ended stays ended.
    let again = set.run(&options, &mut who).unwrap();
    assert!(again.outcome == Outcome::Stopped && set.served.cell.moves() == 1);
}
