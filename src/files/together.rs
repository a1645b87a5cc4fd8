//! In: files made in a separate folder. Out: all of them under their names in the folder above, or none of them,
//! whenever the program is stopped.
//! Frame and unit: none.

use super::folder::sync_folder;
use super::{Lock, moment};
use crate::fault::{Fault, Result};
use std::io::Result as Io;
use std::path::{Path, PathBuf};

/// A set of files that belong together, in `folder`. They are made in `NAME.part`. The renaming of that folder to
/// `NAME.whole` makes the new set valid. Then the old files are put away, `NAME.whole` becomes `NAME.moving`, and
/// its files move up. A reader of the folder calls [`Together::settle`] first, which ends what a stopped process
/// has begun.
pub struct Together<'a> {
    folder: &'a Path,
    name: &'a str,
    /// Puts away, in the first folder, what the files in the second folder replace. Called again after a stop.
    clear: fn(&Path, &Path) -> Io<()>,
}

impl<'a> Together<'a> {
    /// Touches no files yet. `clear(folder, new)` puts away in `folder` what the files in `new` replace.
    pub fn new(folder: &'a Path, name: &'a str, clear: fn(&Path, &Path) -> Io<()>) -> Together<'a> {
        Together { folder, name, clear }
    }

    fn at(&self, state: &str) -> PathBuf {
        self.folder.join(format!("{}.{state}", self.name))
    }

    /// The folder in which the files are made.
    pub fn part(&self) -> PathBuf {
        self.at("part")
    }

    /// Creates an empty folder to make the files in; what a stopped process left there is removed.
    pub fn begin(&self) -> Result<PathBuf> {
        let part = self.part();
        let fresh = || {
            moment()?;
            match std::fs::symlink_metadata(&part) {
                Ok(m) if m.is_dir() => std::fs::remove_dir_all(&part)?,
                Ok(_) => return Err(std::io::Error::other("it is a link or a file, and is left alone")),
                Err(_) => {}
            }
            moment()?;
            std::fs::create_dir(&part)
        };
        fresh().map_err(|e| Fault::write(&part, e))?;
        Ok(part)
    }

    /// Gives the files in [`Together::part`] their names. Each file must be on the disk already. The caller holds
    /// the folder's lock.
    pub fn commit(&self) -> Result<()> {
        let done = sync_folder(&self.part())
            .and_then(|()| rename(&self.part(), &self.at("whole")))
            .and_then(|()| sync_folder(self.folder))
            .and_then(|()| self.roll());
        done.map_err(|e| Fault::write(self.folder, e))
    }

    /// Removes what was made in [`Together::part`] if it could not be completed. A commit that has begun stays.
    pub fn abandon(&self) {
        let _ = std::fs::remove_dir_all(self.part());
    }

    /// Ends a commit that a stopped process has begun; does nothing if there is none.
    pub fn settle(&self) -> Result<()> {
        let begun = || self.at("whole").exists() || self.at("moving").exists();
        if !begun() {
            return Ok(());
        }
        let _lock = Lock::wait(self.folder, self.name)?;
        if begun() { self.roll().map_err(|e| Fault::write(self.folder, e)) } else { Ok(()) }
    }

    /// [`Together::settle`] for a caller that already holds the lock.
    pub fn settle_locked(&self) -> Result<()> {
        self.roll().map_err(|e| Fault::write(self.folder, e))
    }

    fn roll(&self) -> Io<()> {
        let (whole, moving) = (self.at("whole"), self.at("moving"));
        if whole.exists() {
            (self.clear)(self.folder, &whole)?;
            rename(&whole, &moving)?;
        }
        if moving.exists() {
            // Listed first, because the list must not change while it is read.
            let names = std::fs::read_dir(&moving)?.map(|e| Ok(e?.file_name())).collect::<Io<Vec<_>>>()?;
            for name in names {
                rename(&moving.join(&name), &self.folder.join(&name))?;
            }
            sync_folder(self.folder)?;
            moment()?;
            std::fs::remove_dir(&moving)?;
        }
        Ok(())
    }
}

fn rename(from: &Path, to: &Path) -> Io<()> {
    moment()?;
    std::fs::rename(from, to)
}

#[cfg(test)]
mod tests {
    use super::super::remove;
    use super::*;

    fn clear(folder: &Path, _: &Path) -> Io<()> {
        remove(&folder.join("a")).and_then(|()| remove(&folder.join("old")))
    }

    #[test]
    fn a_stopped_commit_is_ended_by_the_next_reader() {
        for stopped in 0..4 {
            let dir = tempfile::tempdir().unwrap();
            let at = |name: &str| dir.path().join(name);
            for name in ["a", "old", "theirs"] {
                std::fs::write(at(name), "former").unwrap();
            }
            let set = Together::new(dir.path(), "set", clear);
            let part = set.begin().unwrap();
            for name in ["a", "b"] {
                std::fs::write(part.join(name), "new").unwrap();
            }
            match stopped {
                0 => set.commit().unwrap(),
                1 => std::fs::rename(at("set.part"), at("set.whole")).unwrap(),
                2 => {
                    std::fs::rename(at("set.part"), at("set.whole")).unwrap();
                    remove(&at("a")).unwrap();
                }
                _ => {
                    std::fs::rename(at("set.part"), at("set.moving")).unwrap();
                    remove(&at("old")).unwrap();
                    std::fs::rename(at("set.moving/a"), at("a")).unwrap();
                }
            }
            set.settle().unwrap();
            let read = |name: &str| std::fs::read_to_string(at(name)).ok();
            assert_eq!((read("a").as_deref(), read("b").as_deref()), (Some("new"), Some("new")), "{stopped}");
            assert_eq!((read("old"), read("theirs").as_deref()), (None, Some("former")), "{stopped}");
            assert!(!at("set.part").exists() && !at("set.moving").exists());
        }
    }
}
