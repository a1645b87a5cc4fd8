//! A camera and a person that let something go wrong at a chosen moment of a procedure.

use super::workplace::lit;
use sheetlight::arm::rules::{Confirmation, StopButton};
use sheetlight::camera::Readout;
use sheetlight::capture::source::cell::CellCamera;
use sheetlight::capture::{Event, Feature, Format, PictureSource, RoundTrip};
use sheetlight::fault::{Fault, Result};
use sheetlight::station::job::{Ask, Operator};
use sheetlight_program::cell::{Cell, Faults, Served};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering::SeqCst};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The folder of the results takes no file any more.
    DiskFull,
    /// A bug.
    Panic,
    /// Every connection to the controller ends; new ones can be had again a third of a second later.
    LinkCut,
    /// The controller is not there any more.
    Gone,
    /// A signal asks the program to end.
    Killed,
    /// The camera's cable is out.
    CameraLost,
    /// STOP is pressed.
    Stop,
}

/// When it goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum When {
    /// At the third picture with a laser on after the yes to a step.
    Pictures(&'static str),
    /// When a step is asked for.
    Asked(&'static str),
    /// When the motion that was asked for is under way.
    Moving(&'static str),
    /// When a line with these words is told.
    Told(&'static str),
    /// After so many pictures with a laser on; below 0: never.
    From(i64),
}

struct Inside {
    what: What,
    when: When,
    /// Folder of the results.
    out: PathBuf,
    faults: Arc<Faults>,
    cell: Cell,
    /// What a signal sets.
    signal: Arc<AtomicBool>,
    stop: OnceLock<StopButton>,
    /// Pictures with a laser on until it goes wrong; below 0: none is counted.
    left: AtomicI64,
    /// When it went wrong, and which lasers were on then.
    fired: OnceLock<(Instant, Vec<u16>)>,
}

/// Both hold the same trap.
#[derive(Clone)]
pub struct Trap(Arc<Inside>);

impl Trap {
    pub fn new(what: What, when: When, served: &Served, out: &Path) -> Trap {
        Trap(Arc::new(Inside {
            what,
            when,
            out: out.to_owned(),
            faults: served.faults.clone(),
            cell: served.cell.clone(),
            signal: Arc::new(AtomicBool::new(false)),
            stop: OnceLock::new(),
            left: AtomicI64::new(if let When::From(n) = when { n } else { -1 }),
            fired: OnceLock::new(),
        }))
    }

    /// The button of the robot that the procedure has: the signal stops it as Ctrl-C does.
    pub fn may_stop(&self, button: &StopButton) {
        button.listen(self.0.signal.clone());
        let _ = self.0.stop.set(button.clone());
    }

    pub fn signal(&self) -> Arc<AtomicBool> {
        self.0.signal.clone()
    }

    /// When it went wrong, and which lasers were on then.
    pub fn fired(&self) -> Option<&(Instant, Vec<u16>)> {
        self.0.fired.get()
    }

    pub fn fire(&self) {
        let all = &self.0;
        if all.fired.set((Instant::now(), lit(&all.cell))).is_err() {
            return;
        }
        match all.what {
            What::DiskFull => {
                let _ = std::fs::rename(&all.out, all.out.with_extension("away"));
                std::fs::write(&all.out, "no folder").unwrap();
            }
            What::Panic => panic!("a bug that a test wants"),
            What::LinkCut => {
                all.faults.gone.store(true, SeqCst);
                std::thread::sleep(Duration::from_millis(300));
                all.faults.gone.store(false, SeqCst);
            }
            What::Gone => all.faults.gone.store(true, SeqCst),
            What::Killed => all.signal.store(true, SeqCst),
            What::CameraLost => {}
            What::Stop => all.stop.get().expect("given").press(),
        }
    }

    fn picture(&self) {
        let left = &self.0.left;
        // What matters is a laser that is on: pictures in the room's light are not counted.
        if !lit(&self.0.cell).is_empty() && left.load(SeqCst) >= 0 && left.fetch_sub(1, SeqCst) == 0 {
            self.fire();
        }
    }

    fn asked(&self, step: &str) {
        match self.0.when {
            When::Pictures(s) if s == step => self.0.left.store(2, SeqCst),
            When::Asked(s) if s == step => self.fire(),
            When::Moving(s) if s == step => {
                let (trap, before) = (self.clone(), self.0.cell.moves());
                std::thread::spawn(move || {
                    while trap.0.cell.moves() == before {
                        std::thread::sleep(Duration::from_micros(500));
                    }
                    trap.fire();
                });
            }
            _ => {}
        }
    }
}

/// The cell's camera, with a trap.
pub struct TrapCamera(pub CellCamera, pub Trap);

impl PictureSource for TrapCamera {
    fn format(&self) -> Format {
        self.0.format()
    }
    fn readout(&self) -> Option<Readout> {
        self.0.readout()
    }
    fn next(&mut self, within: Duration) -> Event {
        if self.1.signal().load(SeqCst) {
            // As a camera that a job has borrowed does it.
            return Event::Ended;
        }
        let event = self.0.next(within);
        if matches!(event, Event::Picture(_)) {
            self.1.picture();
        }
        if self.1.0.what == What::CameraLost && self.1.fired().is_some() {
            return Event::Lost(Fault::device("the camera is gone").next("look at its cable"));
        }
        event
    }
    fn trigger(&mut self) -> Result<bool> {
        self.0.trigger()
    }
    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        self.0.clock()
    }
    fn features(&mut self) -> Result<Vec<Feature>> {
        self.0.features()
    }
    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        self.0.set(name, value)
    }
    fn name(&self) -> String {
        self.0.name()
    }
}

/// A person who says yes to everything, with a trap.
pub struct TrapPerson {
    pub trap: Trap,
    pub asked: Vec<&'static str>,
    pub told: Vec<String>,
}

impl TrapPerson {
    pub fn new(trap: &Trap) -> TrapPerson {
        TrapPerson { trap: trap.clone(), asked: vec![], told: vec![] }
    }
}

impl Operator for TrapPerson {
    fn confirm(&mut self, ask: &Ask) -> Result<Option<Confirmation>> {
        self.asked.push(ask.step);
        self.trap.asked(ask.step);
        Ok(Some(Confirmation::of(&*ask.proposal.hash)))
    }
    fn looked(&mut self, _why: &str) -> Result<bool> {
        Ok(true)
    }
    fn tell(&mut self, line: &str) {
        self.told.push(line.to_owned());
        if matches!(self.trap.0.when, When::Told(words) if line.contains(words)) {
            self.trap.fire();
        }
    }
}
