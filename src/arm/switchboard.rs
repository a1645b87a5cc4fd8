//! The outputs of a cell in one hand: whoever holds them lights the lasers, and the lasers go off when they are let go.

use super::{Arm, Outputs, Switch};
use crate::fault::{Fault, Kind, Result};
use crate::recording::Beam;
use std::io::Write;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// While something is done with a laser on, the controller is asked this often whether it is still there.
const ASKED: Duration = Duration::from_millis(100);

/// Lasers, lamp and gripper. Dropped, on whatever way, it switches the lasers off. The gripper stays as it is: what it
/// holds would
/// fall; so does the lamp.
pub struct Switchboard {
    switch: Box<dyn Switch>,
    outputs: Outputs,
    /// What pictures are lit by; none where the lamp may be anyhow.
    light: Option<Option<Beam>>,
    /// A laser may be on.
    burns: bool,
    /// Whoever holds it was told that a laser may still be on.
    told: bool,
}

impl Switchboard {
    /// Takes the outputs of an arm's controller. What a program that was killed left lit goes off first.
    ///
    /// # Errors
    /// A link that switches nothing; the controller is not reached, or refuses.
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

    /// Does something with one laser on, the lamp as it is; the laser is off when this returns, whatever came of it.
    /// Where the controller is not reached meanwhile, the laser goes off as soon as it is reached again.
    ///
    /// # Errors
    /// Those of the work, and of [`Switchboard::after`]; the controller was not reached meanwhile.
    pub fn lit<T>(&mut self, beam: Beam, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let done = self.burn(beam).and_then(|()| self.watched(work));
        self.after(done)
    }

    /// Does the work while another thread asks the controller again and again.
    fn watched<T>(&mut self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let (goes_on, over) = channel();
        std::thread::scope(|threads| {
            let watch = std::thread::Builder::new().name("laser".into());
            let watch = watch.spawn_scoped(threads, move || self.watch(&over));
            let watch = watch.map_err(|e| Fault::threads(&e))?;
            // Dropped where the work panics, too: then the watch ends.
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

    /// Until the work is over; why the controller was not reached meanwhile.
    fn watch(&mut self, over: &Receiver<()>) -> Option<Fault> {
        let mut lost = None;
        while over.recv_timeout(ASKED) == Err(RecvTimeoutError::Timeout) {
            lost = lost.or_else(|| self.switch.is_on(self.outputs.line).err());
            if lost.is_some() && self.burns {
                // Tried again until it succeeds; the hand that lets go says it where it never does.
                let _ = self.off();
            }
        }
        lost
    }

    /// Both lasers off, the lamp as it is.
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

    /// Both lasers off after some work; where that fails too, the work's fault says both.
    ///
    /// # Errors
    /// The work's, and those of [`Switchboard::dark`].
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

    /// The room's lamp.
    pub fn lamp(&mut self, on: bool) -> Result<()> {
        self.light = None;
        self.switch.put(self.outputs.room, on)
    }

    /// Closes the gripper, or opens it, which drops its component.
    pub fn grip(&mut self, closed: bool) -> Result<()> {
        self.switch.put(self.outputs.gripper, closed)
    }

    /// One laser on and the other off, the lamp as it is.
    fn burn(&mut self, beam: Beam) -> Result<()> {
        (self.light, self.burns) = (None, true);
        self.switch.put(self.outputs.line, beam == Beam::Line)?;
        self.switch.put(self.outputs.pointer, beam == Beam::Pointer)
    }

    /// Tells both lasers, also where the controller refuses the first; where it is not reached the second would wait
    /// in vain.
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
            // The output may be closed: a destructor must not panic for that.
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
