//! In: the camera, a stripe in its pictures. Out: the exposure that suits it, set.
//! Frame and unit: us, shares of full scale.

use super::run::Run;
use crate::arm::Arm;
use crate::capture::tune as tuned;
use crate::fault::{Fault, Result};
use crate::station::Settings;
use crate::web::message::{ExposureSet, Outcome, PictureLook};
use crate::web::motion::Session;

/// Tries at most, as progress shows them.
const TRIES: usize = 20;

/// Where the robot is armed the line laser is lit for it.
pub(super) fn tune(this: &Run) -> Result<Outcome> {
    let desk = &this.jobs.desk;
    let camera = desk.links.camera.as_ref().ok_or_else(|| {
        Fault::refused("no camera: the screen was served without --camera").next("start it with --camera URI")
    })?;
    let mut source = camera.lend_running(&this.stop)?;
    let mut session = if desk.armed() { Some(Session::begin(desk, &this.id, &this.stop)?) } else { None };
    let outputs = Settings::load(&this.jobs.place.station)?.outputs.unwrap_or_default();
    let _lit = session.as_mut().map(|s| Lit::on(s.guard().link(), outputs.line)).transpose()?;
    let mut tried = Vec::new();
    let found = tuned(source.as_mut(), |us, seen| {
        tried.push((us, seen.stripe.as_ref().map(|s| s.peak)));
        this.progress(tried.len(), Some(TRIES));
    })?;
    Ok(Outcome::Tune(Box::new(ExposureSet {
        exposure_us: found.exposure_us,
        tried,
        look: PictureLook::from(&found.look),
        remark: found.remark,
    })))
}

/// The line laser, lit until it is dropped.
struct Lit<'a>(&'a mut dyn Arm, u16);

impl<'a> Lit<'a> {
    fn on(arm: &'a mut dyn Arm, line: u16) -> Result<Lit<'a>> {
        arm.put_output(line, true)?;
        Ok(Lit(arm, line))
    }
}

impl Drop for Lit<'_> {
    fn drop(&mut self) {
        // A controller that does not answer says so to whoever asks it next.
        let _ = self.0.put_output(self.1, false);
    }
}
