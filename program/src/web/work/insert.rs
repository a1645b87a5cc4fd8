//! In: a recipe, an armed robot, a camera. Out: the insertion, each motion shown at the screen and confirmed by a
//! held button.
//! Frame and unit: base frame; mm, s.

use super::find::position;
use super::found::RECIPE;
use super::recipes::load;
use super::resumes::INSERTION;
use super::run::Run;
use crate::web::message::{InsertOrder, Inserted, Outcome};
use crate::web::motion::{Person, Session};
use sheetlight::fault::{Fault, Kind, Result};
use sheetlight::station::Settings;
use sheetlight::station::job::{Job, Outcome as Ended};

/// Steps in their order, as the state machine names them.
const STEPS: [&str; 5] = ["touch", "scan", "approach", "insert", "retract"];

pub(super) fn insert(this: &Run, order: &InsertOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    let (recipe, settings) = (load(place, &order.recipe)?, Settings::load(&place.station)?);
    let desk = &this.jobs.desk;
    let camera = desk.links.camera.as_ref().ok_or_else(|| {
        Fault::refused("no camera: the screen was served without --camera").next("start it with --camera URI")
    })?;
    let path = this.folder.join(RECIPE);
    if !this.again || !path.is_file() {
        sheetlight::files::write(&path, toml::to_string(&recipe).expect("plain data").as_bytes())?;
    }
    let options = order.options(&place.station, &settings, path, this.folder.join(INSERTION));
    let robot = options.robot;
    let mut session = Session::begin(desk, &this.id, &this.stop)?;
    let within_s = session.guard().limits().map_or(0.0, |l| l.max_shown_s);
    let step = |name: &str| {
        let done = STEPS.iter().position(|s| *s == name).unwrap_or(0);
        this.progress(done, Some(STEPS.len()));
    };
    let mut person = Person { desk, job: &this.id, stop: &this.stop, robot, within_s, step: &step, late: false };
    let pictures = camera.lend().map_err(|fault| Fault { kind: Kind::Device, ..fault })?;
    let job = Job::open(&options, session.guard(), pictures, &mut person)?;
    let report = if order.back_out { job.back_out() } else { job.run() }?;
    if report.outcome == Ended::Stopped {
        let next = report.next();
        let kind = report.kind.unwrap_or(Kind::Refused);
        return Err(Fault::new(kind, report.why).cause("the job was stopped; the arm stands still").next(next));
    }
    this.progress(STEPS.len(), Some(STEPS.len()));
    Ok(Outcome::Insert(Box::new(Inserted {
        time_to_position_s: report.time_to_position_s,
        confirmations_to_position: report.confirmations_to_position,
        seconds: report.seconds,
        confirmations: report.confirmations,
        found: report.found.as_ref().map(|r| position(r, &recipe, robot)),
    })))
}
