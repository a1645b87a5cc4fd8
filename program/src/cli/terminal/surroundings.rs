//! In: a station and a console. Out: the surroundings of a procedure: paths as typed, remarks as lines.
//! Frame and unit: none.

use super::console::Console;
use crate::procedure::{At, Names, Remark};
use sheetlight::fault::Result;
use sheetlight::find::Recipe;
use sheetlight::recording::BoardSpec;
use std::path::{Path, PathBuf};

/// Names as typed: paths.
pub struct Typed;

impl Names for Typed {
    fn path(&self, name: &str) -> Result<PathBuf> {
        Ok(PathBuf::from(name))
    }
    fn scan(&self, name: &str) -> Result<PathBuf> {
        Ok(PathBuf::from(name))
    }
    fn recipe(&self, name: &str) -> Result<Recipe> {
        Recipe::load(Path::new(name))
    }
    fn board(&self, name: &str) -> Result<BoardSpec> {
        BoardSpec::load(Path::new(name))
    }
    fn confined(&self) -> bool {
        false
    }
}

/// Executes a part of a procedure on a station's folder.
pub fn in_folder<T>(station: &Path, console: &Console, part: impl FnOnce(&At) -> Result<T>) -> Result<T> {
    let remark = |remark: Remark| match remark {
        Remark::Assumed(what) => console.say(what),
        Remark::Doubt(what) => console.warn(what),
    };
    part(&At { station, names: &Typed, remark: &remark })
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
