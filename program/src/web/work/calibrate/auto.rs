//! In: a board below an armed robot. Out: calibrations of the whole rig, from motions that the program chooses.
//! Each motion is shown at the screen and confirmed; the result is stored until it is accepted.
//! Frame and unit: mm.

use super::super::place::Place;
use super::super::run::Run;
use super::together::keep;
use crate::web::guard::plain;
use crate::web::message::{AutoOrder, Outcome};
use crate::web::motion::{Person, Session};
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::BoardSpec;
use sheetlight::rig::Rig;
use sheetlight::robot::Convention;
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{ArmCell, AutoRun, JointRun, Settings, calibrate_auto, mount_of};
use std::path::PathBuf;

/// Most stops if the order states none.
const MOST: usize = 40;

/// Names of the boards described in the station's folder.
pub fn boards(place: &Place) -> Result<Vec<String>> {
    let entries = std::fs::read_dir(place.boards()).into_iter().flatten().flatten();
    let name = |e: std::fs::DirEntry| {
        let path = e.path();
        let name = path.file_stem()?.to_string_lossy().into_owned();
        (path.extension()? == "json" && plain(&name)).then_some(name)
    };
    let mut names: Vec<String> = entries.filter_map(name).collect();
    names.sort_by_key(|n| sheetlight::files::natural(n));
    Ok(names)
}

fn board(place: &Place, name: &str) -> Result<BoardSpec> {
    if !boards(place)?.iter().any(|b| b == name) {
        return Err(Fault::input(format!("{name:?}: is not a board of this station"))
            .cause("its folder boards has no such description")
            .next("write one with sheetlight board, and put its .json into STATION/boards"));
    }
    BoardSpec::load(&place.boards().join(format!("{name}.json")))
}

pub(in crate::web::work) fn auto(this: &Run, order: &AutoOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    let (settings, rig) = (Settings::load(&place.station)?, Rig::load_camera(&place.station)?);
    let desk = &this.jobs.desk;
    let camera = desk.links.camera.as_ref().ok_or_else(|| {
        Fault::refused("no camera: the screen was served without --camera").next("start it with --camera URI")
    })?;
    let mounted = mount_of(&place.station, &settings, None)?;
    let run = AutoRun {
        joint: JointRun::new(mounted.mount, asked(&settings, None), &settings.extraction, Where::default()),
        board: board(place, &order.board)?,
        out: folder(this),
        target_mm: order.target_mm,
        most: order.most.unwrap_or(MOST),
        working: settings.volume().map(|v| [v.near_mm, v.far_mm]),
        candidates: 150,
        seed: 1,
    };
    run.check()?;
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
    Ok(Outcome::Auto(Box::new(keep(this, &result.joint, mounted.assumed.into_iter().collect())?)))
}

/// Folder for this attempt's pictures. An interrupted attempt keeps its pictures, and the next one uses another
/// folder beside it.
fn folder(this: &Run) -> PathBuf {
    let name = |k: usize| this.folder.join(if k == 0 { "pictures".into() } else { format!("pictures-{k}") });
    (0..).map(name).find(|f| !f.exists()).expect("some name is free")
}
