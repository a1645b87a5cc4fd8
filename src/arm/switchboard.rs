//! The outputs of a cell with one owner: the owner switches the lasers, and they go off when it is dropped.

use super::{Arm, Outputs, Switch};
use crate::fault::{Fault, Kind, Result};
use crate::recording::Beam;
use std::io::Write;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// Interval at which the controller is asked for an answer while work is done with a laser on.
const ASKED: Duration = Duration::from_millis(100);

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

    /// Switches both lasers off without changing the lamp.
    ///
    /// # Errors
    /// A laser may still be on: the controller was not reached, or refused.
    pub fn dark(&mut self) -> Result<()> {
        if !self.burns {
            return Ok(());
        }
        self.off().map_err(|e| {
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
    use super::ASKED;

    #[test]
    fn the_document_states_how_often_the_controller_is_asked() {
        let says = format!("is asked every {} ms", ASKED.as_millis());
        assert!(include_str!("../../docs/robots.md").contains(&says), "{says}");
    }
}
