//! A station's robot behind its motion rules. Limits, tool and sensor head come from the station's folder, so that
//! no caller can omit them.

use super::carried::carried;
use crate::arm::rules::{Guard, MotionLog};
use crate::fault::Result;
use crate::rig::Rig;
use crate::station::settings::Settings;
use std::path::Path;

/// Opens the robot of a URI, read-only until it is armed. The station's motions.jsonl logs all requests and
/// motions.
///
/// # Errors
/// station.toml cannot be read, or no controller answers.
pub fn guarded(station: &Path, robot: &str) -> Result<Guard> {
    let settings = Settings::load(station)?;
    let carried = carried(&settings, &Rig::load(station));
    let log = MotionLog::file(&station.join("motions.jsonl"));
    Ok(Guard::new(crate::arm::open(robot)?, settings.motion, carried, log))
}
