//! In: a job taken by the worker. Out: what a procedure needs to run it.
//! Frame and unit: none.

use super::jobs::Jobs;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// One run of a procedure.
pub(super) struct Run {
    /// The jobs of its station.
    pub jobs: Arc<Jobs>,
    /// Name of the job.
    pub id: String,
    /// Number of the job.
    pub number: u32,
    /// Folder of the job; it exists.
    pub folder: PathBuf,
    /// The job was started before.
    pub again: bool,
    /// Set when the run must end.
    pub stop: Arc<AtomicBool>,
}

impl Run {
    /// Reports the progress.
    pub fn progress(&self, done: usize, of: Option<usize>) {
        self.jobs.progress(done, of);
    }
    /// Whether the run must end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
