//! In: paths of folders and of what lies in them. Out: folders that are there, names that are on the disk, things
//! taken away.
//! Frame and unit: none.

use super::moment;
use crate::fault::{Fault, Result};
use std::io::{ErrorKind, Result as Io};
use std::path::Path;

/// Makes a folder and those above it; one that is there is no error.
pub fn make_folder(folder: &Path) -> Result<()> {
    moment().and_then(|()| std::fs::create_dir_all(folder)).map_err(|e| Fault::write(folder, e))
}

/// Puts a folder's list of names on the disk; only Unix can.
pub(super) fn sync_folder(folder: &Path) -> Io<()> {
    if cfg!(unix) { std::fs::File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Takes a file, a link or a folder away; one that is not there is no error.
pub fn remove(path: &Path) -> Io<()> {
    moment()?;
    let gone = match std::fs::symlink_metadata(path) {
        Ok(m) if m.is_dir() => std::fs::remove_dir_all(path),
        Ok(_) => std::fs::remove_file(path),
        Err(e) => Err(e),
    };
    gone.or_else(|e| if e.kind() == ErrorKind::NotFound { Ok(()) } else { Err(e) })
}
