//! In: bytes that come one after another for hours. Out: a file that holds all of them up to the moment in which the
//! program or the machine was stopped.
//! Frame and unit: bytes.

use super::moment;
use crate::fault::{Fault, Result};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that is only ever added to.
pub struct Append {
    file: File,
    path: PathBuf,
}

impl Append {
    /// A new, empty one. Refused where one of that name is there: somebody's work is in it.
    pub fn create(path: &Path) -> Result<Append> {
        let made = moment().and_then(|()| File::options().write(true).create_new(true).open(path));
        let file = made.map_err(|e| Fault::write(path, e))?;
        Ok(Append { file, path: path.to_owned() })
    }

    /// Adds bytes; other programs see them at once.
    pub fn add(&mut self, bytes: &[u8]) -> Result<()> {
        moment().and_then(|()| self.file.write_all(bytes)).map_err(|e| Fault::write(&self.path, e))
    }

    /// Waits until all of it is on the disk.
    pub fn sync(&self) -> Result<()> {
        moment().and_then(|()| self.file.sync_data()).map_err(|e| Fault::write(&self.path, e))
    }
}
