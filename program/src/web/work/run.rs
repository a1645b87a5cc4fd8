//! In: a job taken by the worker. Out: what a procedure needs to run it.
//! Frame and unit: none.

use super::jobs::Jobs;
use crate::procedure::At;
use crate::web::guard::resolve;
use sheetlight::fault::Result;
use std::cell::RefCell;
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
    /// Executes a part of the procedure on the station and the recordings of the job; returns its remarks, too.
    pub fn remarked<T>(&self, part: impl FnOnce(&At) -> Result<T>) -> Result<(T, Vec<String>)> {
        let place = &self.jobs.place;
        let remarks = RefCell::new(Vec::new());
        let result = part(&At {
            station: &place.station,
            path: &|name| resolve(&place.recordings, name),
            confined: true,
            remark: &|remark| remarks.borrow_mut().push(remark.words()),
        })?;
        Ok((result, remarks.into_inner()))
    }
    /// Whether the run must end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}
