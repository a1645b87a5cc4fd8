//! In: an arm that stands over the board, a camera, the line laser's output. Out: whether one picture shows the
//! line, before a sweep is made with it.
//! Frame and unit: points of one shot, counted.

use super::eye::Eye;
use super::record::Record;
use super::shoot::shoot;
use crate::arm::Arm;
use crate::fault::{Fault, Result};
use crate::recording::Beam;
use crate::rig::Rig;
use crate::scan::Where;
use crate::station::scan::options::ScanOptions;
use crate::station::scan::recorded::scan_recording;
use crate::station::settings::Settings;
use std::path::Path;

/// Fewest points of a stripe over the board, as a share of the picture's short side.
pub(super) const LEAST_SHARE: f64 = 0.1;

/// Refuses if a picture with the line on has no stripe at a possible depth.
pub fn line_is_seen(eye: &mut Eye, arm: &mut dyn Arm, rig: &Rig, settings: &Settings, folder: &Path) -> Result<()> {
    let mut record = Record::begin(folder, "is the line seen", Beam::Line, eye.pictures())?;
    let shot = shoot(eye, arm, &mut record, Some(Beam::Line));
    eye.lights.after(shot)?;
    let run = ScanOptions { place: Where::Cpu, ..ScanOptions::for_station(settings, rig, &folder.join("scan")) };
    let format = eye.pictures().format;
    let least = (LEAST_SHARE * f64::from(format.width.min(format.height))).ceil() as u64;
    let seen = scan_recording(&record.end()?, None, rig, &run, |_, _| {});
    let (points, why) = match seen {
        Ok(scanned) if scanned.points >= least => return Ok(()),
        Ok(scanned) => (scanned.points, String::new()),
        Err(e) if e.kind == crate::fault::Kind::Refused => (0, format!(" ({})", e.what)),
        Err(e) => return Err(e),
    };
    Err(Fault::refused(format!(
        "the line is not seen with its laser on: {points} points, at least {least} are asked for{why}"
    ))
    .cause("the laser is not switched by its output, its shutter is closed, or the board is out of its reach")
    .next("check that the line is on and lies on the board, then begin again"))
}
