//! In: a job that found a part, finished or running. Out: the part's pose, and its recipe as it was then.
//! Frame and unit: the scan's frame, mm.

use super::jobs::Jobs;
use super::recipes::load;
use super::resumes::INSERTION;
use crate::web::message::{Job, Order};
use sheetlight::fault::{Fault, Result};
use sheetlight::find::Recipe;
use sheetlight::station::Lies;
use std::path::PathBuf;

/// The job's copy of its recipe; later edits of the recipe do not change it.
pub(super) const RECIPE: &str = "recipe.toml";
/// The report of the found part.
pub(super) const FOUND: &str = "found.json";

/// The file with the pose that a job found.
///
/// # Errors
/// The job does not find parts.
pub fn report_of(jobs: &Jobs, job: &Job) -> Result<PathBuf> {
    let folder = jobs.folder(job);
    match job.order {
        Order::Find(_) | Order::Teach(_) => Ok(folder.join(FOUND)),
        Order::Insert(_) => Ok(folder.join(INSERTION).join(FOUND)),
        _ => Err(Fault::usage(format!("{}: looks for no part", job.id)).next("choose a job that finds or inserts one")),
    }
}

/// The folder of an insertion's state.
///
/// # Errors
/// No such job, or another procedure.
pub fn insertion_of(jobs: &Jobs, id: &str) -> Result<PathBuf> {
    let job = jobs.get(id)?;
    match job.order {
        Order::Insert(_) => Ok(jobs.folder(&job).join(INSERTION)),
        _ => Err(Fault::usage(format!("{id}: inserts nothing")).next("choose an insertion")),
    }
}

/// The part's pose, and its recipe.
///
/// # Errors
/// Nothing was found yet; a job of an earlier version whose recipe is missing.
pub fn lies(jobs: &Jobs, job: &Job) -> Result<(Lies, Recipe)> {
    let path = report_of(jobs, job)?;
    if !path.is_file() {
        return Err(Fault::refused(format!("{}: has found no part yet", job.id))
            .cause("it still scans, or the part was not there")
            .next("wait until the part is found, or look at why it was not"));
    }
    let (lies, own) = (Lies::load(&path)?, jobs.folder(job).join(RECIPE));
    let recipe = if own.is_file() { Recipe::load(&own)? } else { load(&jobs.place, &lies.recipe)? };
    Ok((lies, recipe))
}
