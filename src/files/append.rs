//! In: bytes that arrive one after another for hours. Out: a file that holds all of them up to the moment when the
//! program or the machine stopped.
//! Frame and unit: bytes.

use super::moment;
use crate::fault::{Fault, Result};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A file that is only appended to.
pub struct Append {
    file: File,
    path: PathBuf,
}

impl Append {
    /// Creates a new, empty file. Returns an error if a file of that name exists, because it may hold somebody's
    /// work.
    pub fn create(path: &Path) -> Result<Append> {
        let made = moment().and_then(|()| File::options().write(true).create_new(true).open(path));
        let file = made.map_err(|e| Fault::write(path, e))?;
        Ok(Append { file, path: path.to_owned() })
    }

    /// Appends bytes; other programs see them at once.
    pub fn add(&mut self, bytes: &[u8]) -> Result<()> {
        moment().and_then(|()| self.file.write_all(bytes)).map_err(|e| Fault::write(&self.path, e))
    }

    /// Waits until all bytes are on the disk.
    pub fn sync(&self) -> Result<()> {
        moment().and_then(|()| self.file.sync_data()).map_err(|e| Fault::write(&self.path, e))
    }
}
