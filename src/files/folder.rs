//! In: paths of folders and of their content. Out: folders that exist, names that are on the disk, paths that are
//! removed.
//! Frame and unit: none.

use super::moment;
use crate::fault::{Fault, Result};
use std::io::{ErrorKind, Result as Io};
use std::path::Path;

/// Creates a folder and its parents; an existing folder is no error.
pub fn make_folder(folder: &Path) -> Result<()> {
    moment().and_then(|()| std::fs::create_dir_all(folder)).map_err(|e| Fault::write(folder, e))
}

/// Syncs a folder's list of names to the disk; only Unix can do this.
pub(super) fn sync_folder(folder: &Path) -> Io<()> {
    if cfg!(unix) { std::fs::File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Removes a file, a link or a folder; a missing one is no error.
pub fn remove(path: &Path) -> Io<()> {
    moment()?;
    let gone = match std::fs::symlink_metadata(path) {
        Ok(m) if m.is_dir() => std::fs::remove_dir_all(path),
        Ok(_) => std::fs::remove_file(path),
        Err(e) => Err(e),
    };
    gone.or_else(|e| if e.kind() == ErrorKind::NotFound { Ok(()) } else { Err(e) })
}
