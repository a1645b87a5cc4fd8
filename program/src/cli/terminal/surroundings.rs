//! In: a station and a console. Out: the surroundings of a procedure: paths as typed, remarks as lines.
//! Frame and unit: none.

use super::console::Console;
use crate::procedure::{At, Remark};
use sheetlight::fault::Result;
use std::path::{Path, PathBuf};

/// Executes a part of a procedure on a station's folder.
pub fn in_folder<T>(station: &Path, console: &Console, part: impl FnOnce(&At) -> Result<T>) -> Result<T> {
    let remark = |remark: Remark| match remark {
        Remark::Assumed(what) => console.say(what),
        Remark::Doubt(what) => console.warn(what),
    };
    part(&At { station, path: &|name| Ok(PathBuf::from(name)), confined: false, remark: &remark })
}

/// Shows a bar that counts the pictures of a calibration.
pub fn with_bar<T>(console: &Console, solve: impl FnOnce(&(dyn Fn(usize, usize) + Sync)) -> Result<T>) -> Result<T> {
    let bar = console.bar("boards", 0);
    let solved = solve(&|done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    Ok(solved)
}
