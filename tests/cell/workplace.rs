//! In: a simulated cell with a part somewhere below the arm. Out: its station folder, a robot behind its rules, a
//! person who says yes: what every test of a job begins with.
//! Frame and unit: mm, degrees.

use super::speeds::{HEAD, Speeds};
use sheetlight::arm::rules::{Carried, Confirmation, Guard, Limits, Space};
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::fault::Result;
use sheetlight::geometry::Vec3;
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::simulate::SceneSpec;
use sheetlight::station::job::{Ask, Job, JobOptions, JobReport, Operator};
use sheetlight::station::{HeadSpec, Settings, ToolSpec, guarded};
use sheetlight_program::cell::{Cell, CellOptions, Event, Served};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A person who says yes to every motion that is shown, up to a step.
pub struct Yes {
    pub no_at: Option<&'static str>,
    pub asked: Vec<&'static str>,
    pub told: Vec<String>,
    /// What he says when he is asked whether he has looked at the robot.
    pub has_looked: bool,
}

/// A flange that carries nothing.
pub fn bare() -> Carried {
    Carried::new(None, Ok(vec![]))
}

impl Yes {
    pub fn always() -> Yes {
        Yes { no_at: None, asked: vec![], told: vec![], has_looked: true }
    }
}

impl Operator for Yes {
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>> {
        self.asked.push(ask.step);
        Ok((self.no_at != Some(ask.step)).then(|| Confirmation::of(&*ask.proposal.hash)))
    }
    fn looked(&mut self, why: &str) -> Result<bool> {
        self.told.push(why.to_owned());
        Ok(self.has_looked)
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
pub struct Set {
    pub served: Served,
    pub station: PathBuf,
    pub dir: tempfile::TempDir,
}

/// A cell with the part of a scene where the operator has jogged it into view.
pub fn set(spec: SceneSpec, seed: u64, tilt_deg: f64) -> Set {
    set_but(spec, seed, tilt_deg, |_| {})
}

/// The same, with something else about the scene when it has been laid.
pub fn set_but(mut spec: SceneSpec, seed: u64, tilt_deg: f64, but: impl FnOnce(&mut SceneSpec)) -> Set {
    let options = CellOptions { speed: 20.0, tilt_deg, ..CellOptions::of(spec.clone(), seed) };
    let served = Served::here(Cell::new(options).unwrap()).unwrap();
    // The operator jogs until the part is in view; here it is laid where the camera looks, by some millimetres.
    let camera = served.cell.true_flange(0.0) * served.cell.station().flange_from_camera;
    let seen = served.cell.base_from_scene().inverse() * camera;
    let axis = seen.rotation.column(2).into_owned();
    let foot = seen.translation - axis * (seen.translation.z / axis.z);
    let k = seed as f64;
    (spec.part[0].at_mm[0], spec.part[0].at_mm[1]) = (foot.x + 4.0 * (1.3 * k).sin(), foot.y + 4.0 * (2.1 * k).cos());
    but(&mut spec);
    served.cell.lay(&spec, None).unwrap();
    served.controller.set_motor(true);
    let dir = tempfile::tempdir().unwrap();
    let station = dir.path().join("station");
    std::fs::create_dir_all(&station).unwrap();
    served.cell.station().store(&station).unwrap();
    let workspace = Space { from_mm: [150.0, -300.0, 250.0], to_mm: [600.0, 300.0, 700.0] };
    let tool = Some(ToolSpec { flange_from_tool: served.cell.flange_from_tool() });
    // Two busy cores may keep the link's threads waiting for long; that a silent link halts is shown by the rules'
    // own test.
    let motion = Limits { max_silence_ms: 5000.0, max_still_ms: 5000.0, ..Limits::within(workspace) };
    let head = Some(HeadSpec { points_mm: vec![HEAD] });
    Settings { motion: Some(motion), tool, head, ..Settings::default() }.store(&station).unwrap();
    Set { served, station, dir }
}

/// Lasers are off so soon after whatever went wrong.
pub const DARK: Duration = Duration::from_secs(1);

/// How long it takes from now until no laser of a cell is on, by the controller's own log; none where that is longer
/// than asked for.
pub fn dark_within(cell: &Cell, most: Duration) -> Option<Duration> {
    let begun = Instant::now();
    loop {
        if lit(cell).is_empty() {
            return Some(begun.elapsed());
        }
        if begun.elapsed() > most {
            return None;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// The numbers of the lasers' outputs that are on.
pub fn lit(cell: &Cell) -> Vec<u16> {
    let (log, outputs) = (cell.log(), cell.options().outputs);
    let on = |number: &u16| {
        let last = log.iter().rev().find_map(|e| match e.event {
            Event::Output { number: n, on } if n == *number => Some(on),
            _ => None,
        });
        last.unwrap_or(false)
    };
    [outputs.line, outputs.pointer].into_iter().filter(on).collect()
}

impl Set {
    pub fn options(&self, recipe: &str, out: &str, sweep_mm: f64) -> JobOptions {
        JobOptions {
            station: self.station.clone(),
            recipe: Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/recipes").join(recipe),
            out: self.dir.path().join(out),
            robot: Convention::Denso,
            place: Where::Cpu,
            speed_mm_s: None,
            sweep_mm: Some(sweep_mm),
            max_tilt_deg: 3.0,
        }
    }

    pub fn guard(&self) -> Guard {
        let mut guard = guarded(&self.station, &self.served.robot_uri()).unwrap();
        guard.arm(true).unwrap();
        guard
    }

    /// Of flange, tip and head from now on.
    pub fn speeds(&self) -> Speeds {
        let tip = self.served.cell.flange_from_tool().translation;
        Speeds::follow(&self.served.cell, vec![Vec3::zeros(), tip, HEAD.into()])
    }

    pub fn run(&self, options: &JobOptions, who: &mut Yes) -> Result<JobReport> {
        let camera = CellCamera::open(&self.served.camera.to_string(), -1.0)?;
        let mut guard = self.guard();
        Job::open(options, &mut guard, Box::new(camera), who)?.run()
    }
}
