//! In: a simulated cell. Out: a station folder for it: the sensor's true calibration, a workspace, the tool.
//! Frame and unit: base frame, mm.

use crate::cell::Cell;
use sheetlight::arm::rules::{Limits, Space};
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::fault::Result;
use sheetlight::robot::Convention;
use sheetlight::station::{Settings, ToolSpec};
use std::path::Path;

/// Workspace of a VS-060 on its table, mm.
const WORKSPACE: Space = Space { from_mm: [150.0, -350.0, 200.0], to_mm: [650.0, 350.0, 750.0] };

/// Writes calibrations and station.toml of a cell into `folder`. `silence_ms` is how long its link may be silent
/// and its reported pose may stay unchanged; `None`: the default limits.
///
/// # Errors
/// A file cannot be written.
pub fn station_for(cell: &Cell, folder: &Path, name: &str, silence_ms: Option<f64>) -> Result<()> {
    sheetlight::files::make_folder(folder)?;
    cell.station().calibrations(cell.base_from_camera()).store_all(folder)?;
    let usual = Limits::within(WORKSPACE);
    let (max_silence_ms, max_still_ms) = silence_ms.map_or((usual.max_silence_ms, usual.max_still_ms), |ms| (ms, ms));
    let motion = Limits { max_silence_ms, max_still_ms, ..usual };
    let tool = Some(ToolSpec { flange_from_tool: cell.flange_from_tool() });
    let mount = Some(if cell.options().eye_to_hand { Mount::EyeToHand } else { Mount::EyeInHand });
    let (name, robot, motion) = (name.into(), Some(Convention::Denso), Some(motion));
    Settings { name, robot, mount, motion, tool, ..Settings::default() }.store(folder)
}
