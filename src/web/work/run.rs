//! In: a job that was taken up. Out: what a procedure needs of it.
//! Frame and unit: none.

use super::jobs::Jobs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// One run of a procedure.
pub(super) struct Run {
    /// Of its station.
    pub jobs: Arc<Jobs>,
    /// Its name.
    pub id: String,
    /// Its number.
    pub number: u32,
    /// Its folder, made.
    pub folder: PathBuf,
    /// It was begun before.
    pub again: bool,
    /// Set when it is to end.
    pub stop: Arc<AtomicBool>,
}

impl Run {
    /// Says how far it is.
    pub fn progress(&self, done: usize, of: Option<usize>) {
        self.jobs.progress(done, of);
    }
    /// Whether it is to end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
