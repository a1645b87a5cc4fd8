//! In: a board below an armed robot. Out: calibrations of the whole rig, from motions that the program chooses.
//! Each motion is shown at the screen and confirmed; the result is stored until it is accepted.
//! Frame and unit: mm.

use super::super::run::Run;
use super::together::keep;
use crate::web::message::{AutoOrder, Outcome};
use crate::web::motion::{Person, Session};
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::Rig;
use sheetlight::robot::Convention;
use sheetlight::station::{ArmCell, Settings, calibrate_auto};
use std::path::PathBuf;

pub(in crate::web::work) fn auto(this: &Run, order: &AutoOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    let (settings, rig) = (Settings::load(&place.station)?, Rig::load_camera(&place.station)?);
    let desk = &this.jobs.desk;
    let camera = desk.links.camera.as_ref().ok_or_else(|| {
        Fault::refused("no camera: the screen was served without --camera").next("start it with --camera URI")
    })?;
    let (run, remarks) = this.remarked(|at| order.run(at, &settings, folder(this)))?;
    let mut session = Session::begin(desk, &this.id, &this.stop)?;
    let within_s = session.guard().limits().map_or(0.0, |l| l.max_shown_s);
    let robot = settings.robot.unwrap_or(Convention::Denso);
    let mut person = Person { desk, job: &this.id, stop: &this.stop, robot, within_s, step: &|_| {}, late: false };
    let mut cell =
        ArmCell::new(session.guard(), camera.lend()?, settings.outputs.unwrap_or_default(), &mut person, None)?;
    let most = run.most;
    let told = |stops: usize, mm: f64| {
        this.progress(stops, Some(most));
        desk.expects(stops, mm);
    };
    let result = calibrate_auto(&mut cell, &rig, &run, &told)?;
    drop(cell);
    drop(session);
    Ok(Outcome::Auto(Box::new(keep(this, &result.joint, remarks)?)))
}

/// Folder for this attempt's pictures. An interrupted attempt keeps its pictures, and the next one uses another
/// folder beside it.
fn folder(this: &Run) -> PathBuf {
    let name = |k: usize| this.folder.join(if k == 0 { "pictures".into() } else { format!("pictures-{k}") });
    (0..).map(name).find(|f| !f.exists()).expect("some name is free")
}
