//! In: an armed robot. Out: the same for one job; whatever ends the job, it comes back to the desk with what has to
//! be looked at.
//! Frame and unit: none.

use super::desk::Desk;
use crate::arm::rules::Guard;
use crate::fault::{Fault, Result};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// A job's time with the robot; ends when it is dropped.
pub struct Session {
    desk: Arc<Desk>,
    guard: Option<Guard>,
}

impl Session {
    /// Takes the robot for a job. Errors: it is not armed.
    pub fn begin(desk: &Arc<Desk>, job: &str, stop: &Arc<AtomicBool>) -> Result<Session> {
        let mut at = desk.at();
        let Some(guard) = at.guard.take() else {
            return Err(Fault::refused("the robot is not armed")
                .cause("only the person beside the robot begins a job that moves it")
                .next("press Arm, then begin it again"));
        };
        at.stop = Some(stop.clone());
        at.shown.job = Some(job.to_owned());
        (at.shown.said, at.shown.expected) = (Vec::new(), Vec::new());
        desk.tell(&at);
        Ok(Session { desk: desk.clone(), guard: Some(guard) })
    }

    /// The robot behind its rules.
    pub fn guard(&mut self) -> &mut Guard {
        self.guard.as_mut().expect("until it is dropped")
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        let guard = self.guard.take();
        let mut at = self.desk.at();
        if let Some(why) = guard.as_ref().and_then(Guard::unknown) {
            at.shown.look.get_or_insert_with(|| why.to_owned());
        }
        (at.guard, at.stop) = (guard, None);
        (at.shown.asked, at.shown.moving) = (None, false);
        self.desk.tell(&at);
    }
}
