//! STOP's own way to whatever has the robot: it waits for nobody who holds the desk.

use crate::arm::rules::StopButton;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What STOP ends. Under this lock values are exchanged and nothing else: no controller is asked, no disk is read, no
/// viewer is told. Whoever takes it while he holds the desk takes the desk first.
#[derive(Default)]
pub(super) struct Brake(Mutex<Ends>);

#[derive(Default)]
struct Ends {
    /// Halts the armed arm.
    button: Option<StopButton>,
    has: Option<Has>,
    /// Why somebody has to look at the robot before it moves again.
    look: Option<String>,
}

/// Who has the robot now.
struct Has {
    /// None: a request that tries an output, or says that somebody has looked.
    job: Option<String>,
    /// Ends it. Each time that the robot is lent has a flag of its own, so that no late STOP ends the next one.
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

    /// The arm that this button halts was taken (`None`: was given back).
    pub fn arm(&self, button: Option<StopButton>) {
        self.ends().button = button;
    }

    /// What halts the armed arm.
    pub fn button(&self) -> Option<StopButton> {
        self.ends().button.clone()
    }

    /// A job, or a request, has the robot; the flag ends it.
    pub fn lend(&self, job: Option<&str>, stop: Arc<AtomicBool>) {
        self.ends().has = Some(Has { job: job.map(str::to_owned), stop });
    }

    /// Nobody has the robot any more; `unknown`: why nobody knows where the arm is.
    pub fn back(&self, unknown: Option<&str>) {
        let mut ends = self.ends();
        ends.has = None;
        if let Some(why) = unknown {
            ends.look.get_or_insert_with(|| why.to_owned());
        }
    }

    /// Ends whatever has the robot, and halts the arm. False: nobody has it.
    pub fn pull(&self, why: &str) -> bool {
        self.pull_if(why, |_| true)
    }

    /// The same where this job has it.
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

    /// Halts the arm; whatever has the robot hears of it by its motion.
    pub fn halt(&self, why: &str) {
        self.ends().halt(why);
    }

    /// Why somebody has to look at the robot.
    pub fn look(&self) -> Option<String> {
        self.ends().look.clone()
    }

    /// Somebody has looked. False: STOP was pressed meanwhile, which stands.
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
