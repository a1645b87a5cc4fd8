//! In: a folder and the rate at which it fills. Out: how long the disk space will last.
//! Frame and unit: bytes, seconds.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Interval of checks of the disk.
const LOOK: Duration = Duration::from_secs(5);
/// Remaining time, s, from which a warning is given: enough to make room.
const SOON: f64 = 600.0;

/// Watches the free space of a disk.
pub struct Space {
    free: Option<u64>,
    looked: Instant,
    /// Bytes written at the last check, for computing the rate.
    then: u64,
    rate: f64,
    said: f64,
}

impl Space {
    /// Checks the disk that a folder is on.
    pub fn of(folder: &Path) -> Space {
        Space { free: free(folder), looked: Instant::now(), then: 0, rate: 0.0, said: f64::INFINITY }
    }

    /// A warning before the disk is full: once, and again when half of the remaining time has passed. `bytes` is the
    /// number written so far.
    pub fn warn(&mut self, folder: &Path, bytes: u64) -> Option<String> {
        let since = self.looked.elapsed();
        if since < LOOK {
            return None;
        }
        self.rate = bytes.saturating_sub(self.then) as f64 / since.as_secs_f64();
        (self.looked, self.then, self.free) = (Instant::now(), bytes, free(folder));
        let (free, rate) = (self.free? as f64, self.rate);
        let left = free / rate.max(1.0);
        (left < SOON && left < 0.5 * self.said).then(|| {
            self.said = left;
            format!(
                "the disk of {} has {:.0} MB left: {:.1} minutes at {:.1} MB/s",
                folder.display(),
                free * 1e-6,
                left / 60.0,
                rate * 1e-6
            )
        })
    }
}

/// Free bytes as POSIX `df` reports them; none if there is no such program.
fn free(folder: &Path) -> Option<u64> {
    let mut df = Command::new("df");
    let output = df.args(["-Pk"]).arg(folder).stderr(Stdio::null()).stdin(Stdio::null()).output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let kib: u64 = text.lines().nth(1)?.split_whitespace().nth(3)?.parse().ok()?;
    Some(kib * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(unix)]
    fn the_disk_is_said_to_fill_before_it_is_full() {
        let dir = tempfile::tempdir().unwrap();
        let mut space = Space::of(dir.path());
        let free = space.free.expect("df is there");
        assert!(space.warn(dir.path(), 1000).is_none(), "too early to say");
        space.looked -= 2 * LOOK;
        let bytes = free / 30;
        let said = space.warn(dir.path(), bytes).expect("full in 5 minutes");
        assert!(said.contains("minutes"), "{said}");
    }
}
