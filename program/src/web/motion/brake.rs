//! Direct path of STOP to the current user of the robot: it never waits for the desk's lock.

use sheetlight::arm::rules::StopButton;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What STOP ends. Under this lock values are only exchanged: no controller is asked, no disk is read, no viewer is
/// notified. Code that needs both locks takes the desk's lock first.
#[derive(Default)]
pub(super) struct Brake(Mutex<Ends>);

#[derive(Default)]
struct Ends {
    /// Halts the armed robot.
    button: Option<StopButton>,
    has: Option<Has>,
    /// Why a person must look at the robot before it moves again.
    look: Option<String>,
}

/// The current user of the robot.
struct Has {
    /// `None`: a request that tries an output, or that reports that a person has looked.
    job: Option<String>,
    /// Ends the use. Each use has a separate flag, so that a late STOP does not end the next one.
    stop: Arc<AtomicBool>,
}

impl Ends {
    fn halt(&mut self, why: &str) {
        if let Some(button) = &self.button {
            button.press_for(why);
        }
        self.look.get_or_insert_with(|| why.to_owned());
    }
}

impl Brake {
    fn ends(&self) -> MutexGuard<'_, Ends> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The robot that this button halts was armed; `None`: it was disarmed.
    pub fn arm(&self, button: Option<StopButton>) {
        self.ends().button = button;
    }

    /// The button that halts the armed robot.
    pub fn button(&self) -> Option<StopButton> {
        self.ends().button.clone()
    }

    /// A job or a request has the robot; the flag ends it.
    pub fn lend(&self, job: Option<&str>, stop: Arc<AtomicBool>) {
        self.ends().has = Some(Has { job: job.map(str::to_owned), stop });
    }

    /// The robot is free again; `unknown`: why the arm's pose is unknown.
    pub fn back(&self, unknown: Option<&str>) {
        let mut ends = self.ends();
        ends.has = None;
        if let Some(why) = unknown {
            ends.look.get_or_insert_with(|| why.to_owned());
        }
    }

    /// Ends the current use of the robot and halts the arm. Returns false if nothing uses the robot.
    pub fn pull(&self, why: &str) -> bool {
        self.pull_if(why, |_| true)
    }

    /// The same, if this job has the robot.
    pub fn pull_job(&self, id: &str, why: &str) -> bool {
        self.pull_if(why, |has| has.job.as_deref() == Some(id))
    }

    fn pull_if(&self, why: &str, meant: impl FnOnce(&Has) -> bool) -> bool {
        let mut ends = self.ends();
        let Some(has) = ends.has.as_ref().filter(|has| meant(has)) else { return false };
        has.stop.store(true, Ordering::SeqCst);
        ends.halt(why);
        true
    }

    /// Halts the arm; the current user learns it from its motion.
    pub fn halt(&self, why: &str) {
        self.ends().halt(why);
    }

    /// Why a person must look at the robot.
    pub fn look(&self) -> Option<String> {
        self.ends().look.clone()
    }

    /// A person has looked. Returns false if STOP was pressed meanwhile; that STOP stays in effect.
    pub fn looked(&self, stop: &AtomicBool) -> bool {
        let mut ends = self.ends();
        if stop.load(Ordering::SeqCst) {
            return false;
        }
        ends.button.iter().for_each(StopButton::release);
        ends.look = None;
        true
    }
}
