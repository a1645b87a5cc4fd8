//! In: a job taken by the worker. Out: what a procedure needs to run it.
//! Frame and unit: none.

use super::jobs::Jobs;
use super::recipes::load;
use super::store::scan_of;
use crate::procedure::{At, Names, Remark};
use crate::web::guard::resolve;
use sheetlight::fault::Result;
use sheetlight::find::Recipe;
use sheetlight::recording::BoardSpec;
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
        let remarks = RefCell::new(Vec::new());
        let remark = |remark: Remark| remarks.borrow_mut().push(remark.words());
        let result = part(&At { station: &self.jobs.place.station, names: self, remark: &remark })?;
        Ok((result, remarks.into_inner()))
    }
    /// Whether the run must end.
    pub fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }
}

/// Recordings by their path below the recordings' folder, scans by their job, recipes and boards by their name.
impl Names for Run {
    fn path(&self, name: &str) -> Result<PathBuf> {
        resolve(&self.jobs.place.recordings, name)
    }
    fn scan(&self, name: &str) -> Result<PathBuf> {
        scan_of(&self.jobs.place.jobs(), &self.jobs.get(name)?)
    }
    fn recipe(&self, name: &str) -> Result<Recipe> {
        load(&self.jobs.place, name)
    }
    fn board(&self, name: &str) -> Result<BoardSpec> {
        self.jobs.place.board(name)
    }
    fn confined(&self) -> bool {
        true
    }
}
