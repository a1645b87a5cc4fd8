//! In: a job that found a part, a station's folder. Out: the part's pose, its drawing and the rig, cached for a
//! while.
//! Frame and unit: base frame, mm.

use super::work::{Jobs, lies, report_of};
use sheetlight::fault::Result;
use sheetlight::find::Drawing;
use sheetlight::rig::Rig;
use sheetlight::station::Lies;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant, SystemTime};

/// Time after which rig and part are read from the disk again.
const READ_AGAIN: Duration = Duration::from_secs(5);

/// Cache of the last part: pages ask for it at every picture.
#[derive(Default)]
pub struct FoundParts(Mutex<Option<Read>>);

#[derive(Clone)]
struct Read {
    at: Instant,
    job: String,
    written: Option<SystemTime>,
    what: Arc<(Lies, Drawing, Rig)>,
}

impl FoundParts {
    /// A part by its job's name, with the present rig.
    pub fn read(&self, jobs: &Jobs, station: &Path, id: &str) -> Result<Arc<(Lies, Drawing, Rig)>> {
        let job = jobs.get(id)?;
        let written = report_of(jobs, &job)?.metadata().and_then(|m| m.modified()).ok();
        let mut held = self.0.lock().unwrap_or_else(|e| e.into_inner());
        let fits = |r: &&Read| r.job == id && r.written == written && r.at.elapsed() < READ_AGAIN;
        if let Some(read) = held.as_ref().filter(fits) {
            return Ok(read.what.clone());
        }
        let (lies, recipe) = lies(jobs, &job)?;
        let what = Arc::new((lies, recipe.drawing(), Rig::load(station)?));
        *held = Some(Read { at: Instant::now(), job: id.to_owned(), written, what: what.clone() });
        Ok(what)
    }
}
