//! The outputs of a cell with one owner: the owner switches the lasers, and they go off when it is dropped.

use super::{Arm, Outputs, Switch};
use crate::fault::{Fault, Kind, Result};
use crate::recording::Beam;
use std::io::Write;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Interval at which the controller is asked for an answer while work is done with a laser on.
const ASKED: Duration = Duration::from_millis(100);
/// Time for which a controller that is not reached is asked again to switch the lasers off.
const REPEATED: Duration = Duration::from_secs(1);

/// Lasers, lamp and gripper. Dropping it, on whatever path, switches the lasers off. The gripper is not changed,
/// because what it holds would fall; the lamp is not changed either.
pub struct Switchboard {
    switch: Box<dyn Switch>,
    outputs: Outputs,
    /// Light of the pictures; `None` if the lamp may be in any state.
    light: Option<Option<Beam>>,
    /// A laser may be on.
    burns: bool,
    /// The owner was informed that a laser may still be on.
    told: bool,
}

impl Switchboard {
    /// Takes the outputs of an arm's controller. First it switches off what a killed program left on.
    ///
    /// # Errors
    /// The link switches nothing, or the controller is not reached, or it refuses.
    pub fn of(arm: &dyn Arm, outputs: Outputs) -> Result<Switchboard> {
        let mut taken = Switchboard { switch: arm.switch()?, outputs, light: None, burns: true, told: false };
        taken.dark()?;
        Ok(taken)
    }

    /// Switches one laser on, or the room's lamp (`None`), and everything else off.
    pub fn light(&mut self, light: Option<Beam>) -> Result<()> {
        if self.light != Some(light) {
            match light {
                Some(beam) => self.burn(beam)?,
                None => self.dark()?,
            }
            self.lamp(light.is_none())?;
            self.light = Some(light);
        }
        Ok(())
    }

    /// Does something with one laser on, without changing the lamp. The laser is off when this returns, whatever
    /// the outcome. If the controller is not reached meanwhile, the laser goes off as soon as it is reached again.
    ///
    /// # Errors
    /// Those of the work and of [`Switchboard::after`]; the controller was not reached meanwhile.
    pub fn lit<T>(&mut self, beam: Beam, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let done = self.burn(beam).and_then(|()| self.watched(work));
        self.after(done)
    }

    /// Does the work while another thread asks the controller at intervals.
    fn watched<T>(&mut self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let (goes_on, over) = channel();
        std::thread::scope(|threads| {
            let watch = std::thread::Builder::new().name("laser".into());
            let watch = watch.spawn_scoped(threads, move || self.watch(&over));
            let watch = watch.map_err(|e| Fault::threads(&e))?;
            // Also dropped if the work panics: then the watch ends.
            let goes_on = goes_on;
            let done = work();
            drop(goes_on);
            match watch.join() {
                Ok(None) => done,
                Ok(Some(lost)) => Err(Fault::device(format!("while a laser was on, the link was lost: {}", lost.what))
                    .cause(lost.cause)
                    .next("look at the link and at the laser, then begin again")),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        })
    }

    /// Watches until the work is over; returns the reason if the controller was not reached meanwhile.
    fn watch(&mut self, over: &Receiver<()>) -> Option<Fault> {
        let mut lost = None;
        while over.recv_timeout(ASKED) == Err(RecvTimeoutError::Timeout) {
            lost = lost.or_else(|| self.switch.is_on(self.outputs.line).err());
            if lost.is_some() && self.burns {
                // Repeated until it succeeds; if it never does, [`Switchboard::after`] reports it.
                let _ = self.off();
            }
        }
        lost
    }

    /// Switches both lasers off without changing the lamp. A controller that is not reached is asked again for a
    /// second: a link that was cut for a moment must not leave a laser on.
    ///
    /// # Errors
    /// A laser may still be on: the controller was not reached, or refused.
    pub fn dark(&mut self) -> Result<()> {
        if !self.burns {
            return Ok(());
        }
        let begun = Instant::now();
        let mut off = self.off();
        // Once the owner knows, it is not kept waiting again.
        while !self.told && off.as_ref().is_err_and(|e| e.kind != Kind::Refused) && begun.elapsed() < REPEATED {
            std::thread::sleep(ASKED);
            off = self.off();
        }
        off.map_err(|e| {
            self.told = true;
            let why = if e.kind == Kind::Refused { "refused" } else { "was not reached" };
            Fault::device(format!("the laser may still be on: the controller {why} ({})", e.what))
                .cause(e.cause)
                .next("switch the laser off at the cell before anybody goes near, then look at the link")
        })
    }

    /// Switches both lasers off after some work; if that fails too, the work's fault reports both.
    ///
    /// # Errors
    /// Those of the work, and those of [`Switchboard::dark`].
    pub fn after<T>(&mut self, done: Result<T>) -> Result<T> {
        match (done, self.dark()) {
            (done, Ok(())) => done,
            (Ok(_), Err(lit)) => Err(lit),
            (Err(mut fault), Err(lit)) => {
                fault.what = format!("{}; {}", fault.what, lit.what);
                fault.next = format!("{}; {}", lit.next, fault.next);
                Err(fault)
            }
        }
    }

    /// Switches the room's lamp.
    pub fn lamp(&mut self, on: bool) -> Result<()> {
        self.light = None;
        self.switch.put(self.outputs.room, on)
    }

    /// Closes the gripper, or opens it, which drops the component.
    pub fn grip(&mut self, closed: bool) -> Result<()> {
        self.switch.put(self.outputs.gripper, closed)
    }

    /// Switches one laser on and the other off without changing the lamp.
    fn burn(&mut self, beam: Beam) -> Result<()> {
        (self.light, self.burns) = (None, true);
        self.switch.put(self.outputs.line, beam == Beam::Line)?;
        self.switch.put(self.outputs.pointer, beam == Beam::Pointer)
    }

    /// Switches off both lasers, also if the controller refuses the first. If it is not reached, the second is not
    /// tried: it would only wait.
    fn off(&mut self) -> Result<()> {
        self.light = None;
        let line = self.switch.put(self.outputs.line, false);
        if line.as_ref().is_err_and(|e| e.kind != Kind::Refused) {
            return line;
        }
        line.and(self.switch.put(self.outputs.pointer, false))?;
        self.burns = false;
        Ok(())
    }
}

impl Drop for Switchboard {
    fn drop(&mut self) {
        let told = self.told;
        if let Err(fault) = self.dark()
            && !told
        {
            // Standard error may be closed: a destructor must not panic for that.
            let _ = writeln!(std::io::stderr(), "{fault}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    /// Outputs of a controller whose link is cut for some time as soon as the line laser is on.
    #[derive(Clone)]
    struct Cut {
        lasts: Duration,
        at: Arc<Mutex<Option<Instant>>>,
        on: Arc<Mutex<Vec<u16>>>,
    }

    impl Cut {
        fn reached(&self) -> Result<()> {
            match *self.at.lock().unwrap() {
                Some(at) if at.elapsed() < self.lasts => Err(Fault::device("the link is cut")),
                _ => Ok(()),
            }
        }
    }

    impl Switch for Cut {
        fn put(&mut self, number: u16, on: bool) -> Result<()> {
            self.reached()?;
            let mut all = self.on.lock().unwrap();
            all.retain(|n| *n != number);
            if on {
                all.push(number);
                self.at.lock().unwrap().get_or_insert_with(Instant::now);
            }
            Ok(())
        }

        fn is_on(&mut self, number: u16) -> Result<bool> {
            self.reached().map(|()| self.on.lock().unwrap().contains(&number))
        }
    }

    /// The line laser's link is cut between the order that switches it on and the next one.
    fn tried(lasts: Duration) -> (Result<()>, Vec<u16>) {
        let cut = Cut { lasts, at: Arc::default(), on: Arc::default() };
        let outputs = Outputs::default();
        let mut all = Switchboard { switch: Box::new(cut.clone()), outputs, light: None, burns: true, told: false };
        let done = all.lit(Beam::Line, || Ok(()));
        drop(all);
        let on = cut.on.lock().unwrap().clone();
        (done, on)
    }

    #[test]
    fn a_link_that_is_cut_for_a_moment_leaves_no_laser_on() {
        let (done, on) = tried(Duration::from_millis(300));
        assert!(done.unwrap_err().what.contains("the link is cut"));
        assert_eq!(on, Vec::<u16>::new());
    }

    #[test]
    fn a_link_that_stays_cut_is_reported() {
        let (done, on) = tried(Duration::from_secs(3600));
        assert!(done.unwrap_err().what.contains("the laser may still be on: the controller was not reached"));
        assert_eq!(on, [Outputs::default().line]);
    }

    #[test]
    fn the_document_states_how_often_the_controller_is_asked() {
        let says = format!("is asked every {} ms", ASKED.as_millis());
        let text = include_str!("../../docs/robots.md");
        assert!(text.contains(&says), "{says}");
        assert!(text.contains("repeated for a second") && REPEATED.as_secs() == 1);
    }
}
