//! What asks the controller on behalf of a screen: arming, trying an output, reading the pose after a person has
//! looked. The desk's lock is not held meanwhile.

use super::desk::Desk;
use super::session::Session;
use super::state::Robot;
use crate::web::guard::Tab;
use crate::web::message::MotionState;
use sheetlight::arm::Switchboard;
use sheetlight::arm::rules::Guard;
use sheetlight::fault::{Fault, Result};
use sheetlight::station::{Output, Settings, guarded, try_output};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

impl Desk {
    /// Arms the robot for motions from this tab.
    pub fn arm(&self, tab: &Tab) -> Result<MotionState> {
        let made = if self.armed() { None } else { Some(self.guarded()?) };
        let mut at = self.at();
        // If two tabs arm at once, the second guard is dropped after the desk's lock, because dropping it asks the
        // controller.
        let late = match made {
            Some(guard) if !at.armed() => {
                self.brake.arm(Some(guard.stop_button()));
                at.robot = Robot::Rests(Box::new(guard));
                None
            }
            other => other,
        };
        if !at.armed() {
            return Err(Fault::refused("the robot was given back meanwhile").next("press Arm again"));
        }
        at.by = Some(tab.clone());
        self.tell(&at);
        let state = self.seen(&at);
        drop(at);
        drop(late);
        Ok(state)
    }

    /// An armed guard. Outputs that a killed program left on are switched off before anybody goes near.
    fn guarded(&self) -> Result<Guard> {
        let Some(uri) = &self.links.robot else {
            return Err(Fault::refused("no robot: the screen was served without --robot")
                .next("start it with --robot URI, or with --simulate"));
        };
        let mut guard = guarded(&self.links.station, uri)?;
        guard.stop_button().listen(self.links.stop.clone());
        guard.arm(self.links.may_move)?;
        let outputs = Settings::load(&self.links.station)?.outputs;
        outputs.map(|o| Switchboard::of(guard.link(), o)).transpose()?;
        Ok(guard)
    }

    /// Tries an output of the controller, from the tab that armed it, while no job has the robot; returns the
    /// output's number. STOP ends it.
    pub fn try_output(&self, tab: &Tab, what: Output) -> Result<u16> {
        let stop = Arc::new(AtomicBool::new(false));
        let mut at = self.at();
        if at.by.as_ref() != Some(tab) {
            return Err(Fault::refused("the robot is not armed from this screen")
                .cause("outputs are switched by who stands beside the cell")
                .next("press Arm first"));
        }
        let mut session = Session::request(self, &mut at, &stop)?;
        drop(at);
        let outputs = Settings::load(&self.links.station)?.outputs.unwrap_or_default();
        try_output(session.guard().link(), &outputs, what, &stop)
    }

    /// A person has looked at the robot after a stopped motion: motions may be proposed again.
    pub fn looked(&self) -> Result<MotionState> {
        let stop = Arc::new(AtomicBool::new(false));
        let mut at = self.at();
        if at.armed() {
            let mut session = Session::request(self, &mut at, &stop)?;
            drop(at);
            session.guard().looked()?;
        } else {
            drop(at);
        }
        if !self.brake.looked(&stop) {
            return Err(Fault::refused("STOP was pressed meanwhile").next("look at the robot again"));
        }
        Ok(self.told())
    }
}
