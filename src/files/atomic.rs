//! In: bytes and a path. Out: a file that gets its name only when all its bytes are on the disk. All results are
//! written this way.
//! Frame and unit: none.

use super::folder::{remove, sync_folder};
use super::leftover::temporary;
use super::moment;
use crate::fault::{Fault, Result};
use std::io::{Result as Io, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tempfile::NamedTempFile;

/// Writes to a temporary file in the same folder, syncs it, and renames it to `path`. A symbolic link of that name
/// is replaced, not followed.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    write_aside(path, bytes)?.keep()
}

/// [`write()`] without waiting for the disk, for hundreds of pictures that can be made again. A half-written file
/// never gets its name, but a power cut may lose whole files.
pub fn write_unsynced(path: &Path, bytes: &[u8]) -> Result<()> {
    let aside = write_aside(path, bytes)?;
    rename(aside.file, path).map_err(|e| Fault::write(path, e))
}

/// [`write()`] for a result and the files that accompany it (its picture, its page). Whenever the program stops or
/// the disk is full, the result is entirely the old one or entirely the new one. The accompanying files then belong
/// to that result or are missing.
pub fn write_beside(result: (&Path, &[u8]), beside: &[(&Path, &[u8])]) -> Result<()> {
    let aside = |(path, bytes): (&Path, &[u8])| {
        let aside = write_aside(path, bytes)?;
        aside.sync().map(|()| aside)
    };
    let first = aside(result)?;
    let others = beside.iter().map(|b| aside(*b)).collect::<Result<Vec<_>>>()?;
    beside.iter().try_for_each(|(path, _)| remove(path).map_err(|e| Fault::write(path, e)))?;
    std::iter::once(first).chain(others).try_for_each(Aside::keep)
}

/// [`Aside::keep`] for many files. Each file gets a thread, as far as threads can be started, because files that
/// are synced at the same time reach the disk together.
pub fn keep_all(files: Vec<Aside>) -> Result<()> {
    let threads = files.len();
    let left = Mutex::new(files);
    let work = || {
        let next = || left.lock().unwrap_or_else(PoisonError::into_inner).pop();
        std::iter::from_fn(next).try_for_each(Aside::keep)
    };
    std::thread::scope(|scope| {
        let started = (1..threads).map_while(|_| std::thread::Builder::new().spawn_scoped(scope, work).ok());
        let others: Vec<_> = started.collect();
        let mine = work();
        others.into_iter().fold(mine, |all, one| all.and(one.join().expect("a file is kept without a panic")))
    })
}

/// A file that is written under a temporary name and may not have reached the disk.
pub struct Aside {
    file: NamedTempFile,
    path: PathBuf,
}

/// The first half of [`write()`]. Without the second half, [`Aside::keep`], the file is removed.
pub fn write_aside(path: &Path, bytes: &[u8]) -> Result<Aside> {
    let mut aside = Aside::create(path)?;
    moment().and_then(|()| aside.file.write_all(bytes)).map_err(|e| Fault::write(path, e))?;
    Ok(aside)
}

impl Aside {
    /// Creates an empty file, to be filled through [`Aside::file`].
    pub fn create(path: &Path) -> Result<Aside> {
        let file = moment().and_then(|()| temporary(folder_of(path))).map_err(|e| Fault::write(path, e))?;
        Ok(Aside { file, path: path.to_owned() })
    }
    /// The open file to write to; it still has its temporary name.
    pub fn file(&self) -> &std::fs::File {
        self.file.as_file()
    }
    /// Waits until the file is on the disk.
    fn sync(&self) -> Result<()> {
        moment().and_then(|()| self.file.as_file().sync_all()).map_err(|e| Fault::write(&self.path, e))
    }
    /// Waits until the file is on the disk, gives it its name, and waits until the name is on the disk too.
    pub fn keep(self) -> Result<()> {
        self.sync()?;
        let kept = rename(self.file, &self.path).and_then(|()| sync_folder(folder_of(&self.path)));
        kept.map_err(|e| Fault::write(&self.path, e))
    }
}

fn rename(file: NamedTempFile, path: &Path) -> Io<()> {
    moment()?;
    file.persist(path).map(|_| ()).map_err(|e| e.error)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_a_link_is_not_followed() {
        let dir = tempfile::tempdir().unwrap();
        let (path, other) = (dir.path().join("a"), dir.path().join("b"));
        std::fs::write(&other, "kept").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(&other, &path).unwrap();
        write(&path, b"new").unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::read(&other).unwrap(), b"kept");
        drop(write_aside(&path, b"never kept").unwrap());
        assert_eq!(std::fs::read(&path).unwrap(), b"new");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2, "nothing else is left");
        assert!(write(&dir.path().join("none/a"), b"").is_err());
    }
}
