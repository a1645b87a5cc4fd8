//! In: a folder and the name of another one. Out: a folder that is made aside and gets its name when everything in it
//! is on the disk; what killed processes have left of such folders is taken away.
//! Frame and unit: none.

use super::folder::sync_folder;
use super::leftover::{sweep, temporary};
use super::{make_folder, moment, remove};
use crate::fault::{Fault, Result};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Ends the name of a folder under way; a file of the same name without it, locked, shows that somebody works there.
const ENDING: &str = ".work";

/// A folder under way. It is gone when this is dropped without [`Workplace::keep`].
pub struct Workplace {
    folder: PathBuf,
    _alive: NamedTempFile,
}

impl Workplace {
    /// An empty folder within `parent`, under a name that no other process has.
    pub fn make(parent: &Path) -> Result<Workplace> {
        make_folder(parent)?;
        let alive = moment().and_then(|()| temporary(parent)).map_err(|e| Fault::write(parent, e))?;
        let mut name = alive.path().file_name().unwrap_or_default().to_owned();
        name.push(ENDING);
        let folder = parent.join(name);
        moment().and_then(|()| std::fs::create_dir(&folder)).map_err(|e| Fault::write(&folder, e))?;
        Ok(Workplace { folder, _alive: alive })
    }

    /// Where files are made, each of them on the disk when it is whole.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Gives the folder its name. False where a folder of that name is there already: it stays, this one goes.
    pub fn keep(self, path: &Path) -> Result<bool> {
        let above = path.parent().unwrap_or(Path::new("."));
        make_folder(above)?;
        if path.exists() {
            return Ok(false);
        }
        let renamed = sync_folder(&self.folder).and_then(|()| moment()).and_then(|()| {
            std::fs::rename(&self.folder, path)?;
            sync_folder(above)
        });
        match renamed {
            Ok(()) => Ok(true),
            // Another process was faster by a moment.
            Err(_) if path.is_dir() => Ok(false),
            Err(e) => Err(Fault::write(path, e)),
        }
    }

    /// Takes away the folders within `parent` that nobody works in any more.
    pub fn sweep(parent: &Path) -> Result<()> {
        let left = || {
            sweep(parent)?;
            let Ok(entries) = std::fs::read_dir(parent) else { return Ok(()) };
            for path in entries.flatten().map(|e| e.path()) {
                let ours = path.extension() == Some(OsStr::new(&ENDING[1..]));
                if ours && !path.with_extension("").exists() {
                    remove(&path)?;
                }
            }
            Ok(())
        };
        left().map_err(|e| Fault::write(parent, e))
    }
}

impl Drop for Workplace {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_its_name_only_when_it_is_kept() {
        let dir = tempfile::tempdir().unwrap();
        let (parent, path) = (dir.path().join("work"), dir.path().join("results/ab"));
        let make = |text: &str| {
            let place = Workplace::make(&parent).unwrap();
            std::fs::write(place.folder().join("a"), text).unwrap();
            place
        };
        let count = || std::fs::read_dir(&parent).unwrap().count();
        drop(make("dropped"));
        assert_eq!((count(), path.exists()), (0, false));
        let (first, second) = (make("first"), make("second"));
        assert!(first.keep(&path).unwrap() && !second.keep(&path).unwrap());
        assert_eq!((std::fs::read_to_string(path.join("a")).unwrap().as_str(), count()), ("first", 0));
        // A killed process leaves a folder whose file nobody locks; one at work stays.
        std::fs::create_dir(parent.join(".sheetlight.dead.work")).unwrap();
        std::fs::write(parent.join(".sheetlight.dead"), "").unwrap();
        let alive = make("at work");
        Workplace::sweep(&parent).unwrap();
        assert!(alive.folder().exists() && !parent.join(".sheetlight.dead.work").exists());
        assert_eq!(count(), 2, "the folder at work and its file");
    }
}
