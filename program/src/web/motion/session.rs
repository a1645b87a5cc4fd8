//! The time for which a job or a request uses the robot; however it ends, the guard returns to the desk.

use super::desk::Desk;
use super::state::At;
use sheetlight::arm::rules::Guard;
use sheetlight::fault::Result;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Use of the robot; ends when this is dropped.
pub struct Session<'a> {
    desk: &'a Desk,
    guard: Option<Box<Guard>>,
}

impl Session<'_> {
    /// Takes the robot for a job.
    ///
    /// # Errors
    /// The robot is not armed or in use, or `stop` is already set.
    pub fn begin<'a>(desk: &'a Desk, job: &str, stop: &Arc<AtomicBool>) -> Result<Session<'a>> {
        let mut at = desk.at();
        let guard = desk.lend(&mut at, Some(job), stop)?;
        at.told.job = Some(job.to_owned());
        (at.told.said, at.told.expected) = (Vec::new(), Vec::new());
        desk.tell(&at);
        Ok(Session { desk, guard: Some(guard) })
    }

    /// Takes the robot for a request.
    ///
    /// # Errors
    /// As for [`Session::begin`].
    pub(super) fn request<'a>(desk: &'a Desk, at: &mut At, stop: &Arc<AtomicBool>) -> Result<Session<'a>> {
        Ok(Session { desk, guard: Some(desk.lend(at, None, stop)?) })
    }

    /// The robot, accessed through its guard.
    pub fn guard(&mut self) -> &mut Guard {
        self.guard.as_mut().expect("until it is dropped")
    }
}

impl Drop for Session<'_> {
    fn drop(&mut self) {
        if let Some(guard) = self.guard.take() {
            self.desk.back(guard);
        }
    }
}
