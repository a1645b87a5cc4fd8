//! In: a recording of boards, frames to exclude. Out: a calibration with its figures beside those of the station's
//! present one; stored in the station when it is accepted.
//! Frame and unit: as the calibrations; px, mm, degrees.

use super::super::jobs::Jobs;
use super::super::run::Run;
use crate::procedure::calibrate::{CalibrateOrder, Calibration, Solved};
use crate::web::message::{CalibrationFigures, Job, JobState, Order, Outcome};
use sheetlight::fault::{Fault, Result};
use sheetlight::rig::{Kind, Quality, Rig, Verdict};
use sheetlight::station::back_up_here;
use std::collections::BTreeMap;
use std::path::Path;

/// The result that waits for acceptance, in the job's folder.
const RESULT: &str = "calibration.json";
const PAGE: &str = "calibration.html";

pub(in crate::web::work) fn calibrate(this: &Run, order: &CalibrateOrder) -> Result<Outcome> {
    let (Solved { record, page, excluded, .. }, remarks) =
        this.remarked(|at| order.solve(at, &|done, of| this.progress(done, Some(of))))?;
    let text = serde_json::to_string_pretty(&record.json()).expect("plain data");
    let (result, html) = (this.folder.join(RESULT), this.folder.join(PAGE));
    sheetlight::files::write_beside((&result, text.as_bytes()), &[(&html, page.html().as_bytes())])?;
    let (q, kind) = (record.quality(), record.kind());
    Ok(Outcome::Calibrate(Box::new(CalibrationFigures {
        kind: kind.name().into(),
        verdict: q.verdict.words().into(),
        reasons: q.reasons.iter().cloned().chain(remarks).collect(),
        advice: q.advice.clone(),
        figures: q.figures.clone(),
        former: former(&this.jobs.place.station, kind),
        per_picture: q.per_picture.clone(),
        left_out: excluded,
        accepted: false,
    })))
}

/// Figures of the station's present calibration; empty if there is none that can be read.
fn former(station: &Path, kind: Kind) -> BTreeMap<String, f64> {
    #[derive(serde::Deserialize)]
    struct Told {
        quality: Quality,
    }
    let path = station.join("calibration").join(format!("{}.json", kind.name()));
    let text = sheetlight::files::read_text(&path).ok();
    let told = text.and_then(|t| serde_json::from_str::<Told>(&t).ok());
    told.map(|t| t.quality.figures).unwrap_or_default()
}

/// Stores a finished calibration in the station. Returns an error for another kind of job, a verdict that is not
/// good enough, or a calibration that was accepted before.
pub fn accept(jobs: &Jobs, job: &Job) -> Result<Job> {
    let refuse = |what: String| Err(Fault::usage(what).next("calibrate again"));
    let joint = match (&job.order, job.state) {
        (Order::Calibrate(_), JobState::Done) => false,
        (Order::Joint(_) | Order::Auto(_), JobState::Done) => true,
        _ => return refuse(format!("{}: is not a finished calibration", job.id)),
    };
    let mut job = job.clone();
    match &mut job.outcome {
        Some(Outcome::Calibrate(f) | Outcome::Joint(f) | Outcome::Auto(f)) if !f.accepted => f.accepted = true,
        _ => return refuse(format!("{}: was accepted already", job.id)),
    }
    let (folder, station) = (jobs.folder(&job), &jobs.place.station);
    back_up_here(station, "before-calibration")?;
    if joint {
        super::together::store(&folder, station)?
    } else {
        store(&folder, station)?
    }
    jobs.put(&job)?;
    Ok(job)
}

fn store(folder: &Path, station: &Path) -> Result<()> {
    let path = folder.join(RESULT);
    let record = Rig::record(&sheetlight::files::read_text(&path)?)
        .map_err(|e| Fault::input(format!("{}: {e}", path.display())).next("calibrate again"))?;
    let q = record.quality();
    if q.verdict >= Verdict::BadlyDetermined {
        return Err(Fault::refused(format!("the {} is {}", record.kind().words(), q.verdict.words()))
            .cause(q.reasons.join("; "))
            .next(q.advice.first().map_or("take more pictures", String::as_str)));
    }
    let page = sheetlight::files::read_text(&folder.join(PAGE))?;
    Rig::store(station, record.as_ref(), Some(&page)).map(|_| ())
}
