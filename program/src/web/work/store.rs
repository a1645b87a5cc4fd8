//! In: the folder of jobs. Out: each job's record, read and written whole; a job that ran when the program ended is
//! marked as cut off.
//! Frame and unit: none.

use crate::web::guard::resolve;
use crate::web::message::{Job, JobState, Order};
use sheetlight::fault::{Fault, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Version of job.json.
pub(super) const FORMAT: u32 = 1;

/// The number at the start of a job's id.
pub fn number_of(id: &str) -> Option<u32> {
    let (number, word) = id.split_once('-')?;
    let known =
        number.len() >= 4 && number.bytes().all(|b| b.is_ascii_digit()) && word.bytes().all(|b| b.is_ascii_lowercase());
    number.parse().ok().filter(|_| known)
}

/// Reads all jobs. A folder whose record cannot be read is skipped: it may belong to another program.
pub(super) fn load(jobs: &Path) -> Result<BTreeMap<u32, Job>> {
    sheetlight::files::make_folder(jobs)?;
    let mut all = BTreeMap::new();
    let entries = std::fs::read_dir(jobs).map_err(|e| Fault::read(jobs, e))?;
    for name in entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()) {
        let Some(number) = number_of(&name) else { continue };
        let text = sheetlight::files::read_text(&jobs.join(&name).join("job.json"));
        let Some(mut job) = text.ok().and_then(|t| serde_json::from_str::<Job>(&t).ok()) else { continue };
        if job.format != FORMAT || job.id != name {
            continue;
        }
        if matches!(job.state, JobState::Running | JobState::Queued) {
            job.state = JobState::CutOff;
            // The procedure itself finds out which of its steps are stored.
            job.resumable = true;
            save(jobs, &job)?;
        }
        all.insert(number, job);
    }
    Ok(all)
}

/// Writes a job's record; its folder is created if missing.
pub(super) fn save(jobs: &Path, job: &Job) -> Result<()> {
    let folder = jobs.join(&job.id);
    sheetlight::files::make_folder(&folder)?;
    let text = serde_json::to_string_pretty(job).expect("plain data");
    sheetlight::files::write(&folder.join("job.json"), text.as_bytes())
}

/// The scan folder of a job. Returns an error if the job is not a finished scan.
pub fn scan_of(jobs: &Path, job: &Job) -> Result<PathBuf> {
    if !matches!((&job.order, job.state), (Order::Scan(_) | Order::Filter(_), JobState::Done)) {
        return Err(Fault::usage(format!("{}: is not a finished scan", job.id))
            .cause("it failed, still runs, or is another procedure")
            .next("choose a scan that is done"));
    }
    resolve(jobs, &job.id).map(|folder| folder.join("scan"))
}
