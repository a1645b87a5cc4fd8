//! In: folders that results are written into. Out: files under temporary names, locked as long as their writer
//! lives. Temporary files that a killed process left behind are removed.
//! Frame and unit: none.

use super::remove;
use std::collections::BTreeSet;
use std::fs::{File, TryLockError};
use std::io::Result as Io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tempfile::NamedTempFile;

/// Prefix of Sheetlight's temporary names; no other program uses it.
const PREFIX: &str = ".sheetlight.";
/// Another process that sweeps may remove a new file before it is locked. That this happens twice in a row is very
/// unlikely.
const TRIES: usize = 8;

/// Creates a temporary file that others may read like any other result: temporary files are private by default, and
/// stay private when they are renamed. The first call for a folder sweeps it.
pub(super) fn temporary(folder: &Path) -> Io<NamedTempFile> {
    if first_in(folder) {
        // A file that cannot be removed does no harm.
        let _ = sweep(folder);
    }
    for _ in 0..TRIES {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX);
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder)?;
        match file.as_file().try_lock() {
            Err(TryLockError::WouldBlock) => {}
            // On a file system without locks nothing is swept either.
            Ok(()) | Err(TryLockError::Error(_)) if file.path().exists() => return Ok(file),
            _ => {}
        }
    }
    Err(std::io::Error::other("temporary files are taken away as soon as they are made"))
}

/// Removes the temporary files in a folder that no process writes any more.
pub fn sweep(folder: &Path) -> Io<()> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Ok(()) };
    let ours = |path: &PathBuf| {
        let name = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with(PREFIX));
        // Locking would follow a symbolic link.
        name && std::fs::symlink_metadata(path).is_ok_and(|m| m.is_file())
    };
    for path in entries.flatten().map(|e| e.path()).filter(ours) {
        let Ok(file) = File::options().write(true).open(&path) else { continue };
        if file.try_lock().is_ok() {
            remove(&path)?;
        }
    }
    Ok(())
}

/// Whether this process writes into a folder for the first time. A folder of thousands of pictures is then listed
/// once, not for each picture.
fn first_in(folder: &Path) -> bool {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let name = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    SWEPT.lock().unwrap_or_else(PoisonError::into_inner).insert(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_left_goes_and_what_one_writes_stays() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for name in [".sheetlight.left", ".tmpTheirs", "sheetlight.theirs"] {
            std::fs::write(at(name), "half").unwrap();
        }
        #[cfg(unix)]
        std::os::unix::fs::symlink(at(".tmpTheirs"), at(".sheetlight.link")).unwrap();
        let mine = temporary(dir.path()).unwrap();
        assert!(!at(".sheetlight.left").exists());
        sweep(dir.path()).unwrap();
        assert!(mine.path().exists(), "it is being written");
        assert!(at(".tmpTheirs").exists() && at("sheetlight.theirs").exists());
        assert!(!cfg!(unix) || at(".sheetlight.link").is_symlink());
        drop(mine.persist(at("result")).unwrap());
        sweep(dir.path()).unwrap();
        assert!(at("result").exists());
    }
}
