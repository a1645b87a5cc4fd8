//! In: the camera, a stripe in its pictures. Out: the exposure that suits the stripe; it is set.
//! Frame and unit: us, fractions of full scale.

use super::run::Run;
use crate::web::message::{ExposureSet, Outcome, PictureLook};
use crate::web::motion::Session;
use sheetlight::arm::Switchboard;
use sheetlight::capture::tune as tuned;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::Beam;
use sheetlight::station::Settings;

/// Most tries, for the progress display.
const TRIES: usize = 20;

/// Sets the exposure. If the robot is armed, the line laser is switched on for it.
pub(super) fn tune(this: &Run) -> Result<Outcome> {
    let desk = &this.jobs.desk;
    let camera = desk.links.camera.as_ref().ok_or_else(|| {
        Fault::refused("no camera: the screen was served without --camera").next("start it with --camera URI")
    })?;
    let mut source = camera.lend_running(&this.stop)?;
    let mut session = if desk.armed() { Some(Session::begin(desk, &this.id, &this.stop)?) } else { None };
    let outputs = Settings::load(&this.jobs.place.station)?.outputs.unwrap_or_default();
    let lights = session.as_mut().map(|s| Switchboard::of(s.guard().link(), outputs)).transpose()?;
    let mut tried = Vec::new();
    let mut work = || {
        tuned(source.as_mut(), |us, seen| {
            tried.push((us, seen.stripe.as_ref().map(|s| s.peak)));
            this.progress(tried.len(), Some(TRIES));
        })
    };
    let found = match lights {
        Some(mut lights) => lights.lit(Beam::Line, work),
        None => work(),
    }?;
    Ok(Outcome::Tune(Box::new(ExposureSet {
        exposure_us: found.exposure_us,
        tried,
        look: PictureLook::from(&found.look),
        remark: found.remark,
    })))
}
