//! In: a folder. Out: the right to write into it. One process at a time holds it, and it is released however that
//! process ends.
//! Frame and unit: none.

use crate::fault::{Fault, Result};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A lock of the operating system on the file `NAME.lock`. The file is never removed: if it were removed while
/// another process waits for it, two processes could get the lock.
pub struct Lock {
    _file: File,
}

/// How long the lock is retried. A child process that is just being started holds copies of this process's open
/// files, and so of its locks, until it runs its own program.
const PATIENCE: Duration = Duration::from_millis(400);

impl Lock {
    /// Returns an error if another process holds the lock; `who` says what that process does here.
    pub fn take(folder: &Path, name: &str, who: &str) -> Result<Lock> {
        let (path, file) = open(folder, name)?;
        let mut tried = file.try_lock();
        let begun = Instant::now();
        while matches!(tried, Err(TryLockError::WouldBlock)) && begun.elapsed() < PATIENCE {
            std::thread::sleep(PATIENCE / 20);
            tried = file.try_lock();
        }
        match tried {
            Ok(()) => Ok(Lock { _file: file }),
            Err(TryLockError::Error(e)) => Err(Fault::write(&path, e)),
            Err(TryLockError::WouldBlock) => {
                Err(Fault::output(format!("{}: another {who} writes here", folder.display()))
                    .cause(format!(
                        "two were started into one folder: {} is locked by a running process",
                        path.display()
                    ))
                    .next("wait for it, or choose another folder"))
            }
        }
    }

    /// Waits for the lock.
    pub fn wait(folder: &Path, name: &str) -> Result<Lock> {
        let (path, file) = open(folder, name)?;
        file.lock().map_err(|e| Fault::write(&path, e))?;
        Ok(Lock { _file: file })
    }

    /// Whether a process holds the lock now.
    pub fn is_held(folder: &Path, name: &str) -> bool {
        let path = folder.join(format!("{name}.lock"));
        // Opening a pipe would wait for its other end.
        if !std::fs::symlink_metadata(&path).is_ok_and(|m| m.is_file()) {
            return false;
        }
        // A shared lock for a moment: who takes the lock just then tries again.
        File::open(path).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

fn open(folder: &Path, name: &str) -> Result<(PathBuf, File)> {
    let path = folder.join(format!("{name}.lock"));
    if std::fs::symlink_metadata(&path).is_ok_and(|m| !m.is_file()) {
        return Err(Fault::output(format!("{}: is a link or a folder where a lock is to be", path.display()))
            .cause("it was not made by this program; its target is not touched")
            .next("take it away, or choose another folder"));
    }
    let file = File::options().create(true).truncate(false).write(true).open(&path);
    file.map(|f| (path.clone(), f)).map_err(|e| Fault::write(&path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_holds_it_until_it_goes() {
        let dir = tempfile::tempdir().unwrap();
        let first = Lock::take(dir.path(), "scan", "scan").unwrap();
        let said = Lock::take(dir.path(), "scan", "scan").err().unwrap();
        assert!(said.what.contains("another scan") && !said.next.is_empty(), "{said}");
        assert!(Lock::is_held(dir.path(), "scan") && !Lock::is_held(dir.path(), "other"));
        drop(first);
        assert!(!Lock::is_held(dir.path(), "scan"));
        // Neither the content of the file nor its owner makes it a held lock.
        std::fs::write(dir.path().join("scan.lock"), "1").unwrap();
        Lock::take(dir.path(), "scan", "scan").unwrap();
    }
}
