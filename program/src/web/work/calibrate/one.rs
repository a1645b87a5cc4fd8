//! In: a recording of boards, frames to exclude. Out: a calibration with its figures beside those of the station's
//! present one; stored in the station when it is accepted.
//! Frame and unit: as the calibrations; px, mm, degrees.

use super::super::jobs::Jobs;
use super::super::run::Run;
use crate::web::guard::resolve;
use crate::web::message::{CalibrationFigures, Job, JobState, Order, Outcome, Target};
use serde::Serialize;
use sheetlight::calibrate::camera::procedure::{CameraOptions, calibrate as camera};
use sheetlight::calibrate::camera::report::page;
use sheetlight::calibrate::laser_plane::options::LaserPlaneOptions;
use sheetlight::calibrate::report::Page;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording::Recording;
use sheetlight::rig::{Calibration, Kind, Quality, Rig, Verdict};
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{
    AxisRun, HandEyeResult, HandEyeRun, LaserPlaneRun, PointerRun, Settings, back_up_here, calibrate_axis,
    calibrate_hand_eye, calibrate_laser_plane, calibrate_pointer, mount_of,
};
use std::collections::BTreeMap;
use std::path::Path;

/// The result that waits for acceptance, in the job's folder.
const RESULT: &str = "calibration.json";
const PAGE: &str = "calibration.html";

pub(in crate::web::work) fn calibrate(this: &Run, target: Target, name: &str, leave_out: &[usize]) -> Result<Outcome> {
    let place = &this.jobs.place;
    let recording = without(Recording::open(&resolve(&place.recordings, name)?)?, leave_out)?;
    let settings = Settings::load(&place.station)?;
    let progress = |done: usize, of: usize| this.progress(done, Some(of));
    if target == Target::Camera {
        let options = CameraOptions { asked: asked(&settings, None), ..CameraOptions::default() };
        let result = camera(&[recording], &options, &|done, of| this.progress(done, Some(of)))?;
        let page = page(&result, &format!("Camera calibration of {}", settings.name));
        return keep(this, &result.calibration, &page, result.left_out);
    }
    let rig = Rig::load_to_calibrate(&place.station)?;
    match target {
        Target::LaserPlane => {
            let run = LaserPlaneRun {
                solver: LaserPlaneOptions::default(),
                asked: asked(&settings, None),
                extraction: settings.extraction.clone(),
                place: Where::default(),
            };
            let c = calibrate_laser_plane(&recording, &rig, &run, &progress)?;
            keep(this, &c.calibration, &c.page, c.missing)
        }
        Target::Pointer => {
            let run =
                PointerRun { spots: Default::default(), solver: Default::default(), asked: asked(&settings, None) };
            let c = calibrate_pointer(&recording, &rig, &run, &progress)?;
            keep(this, &c.calibration, &c.page, c.missing)
        }
        Target::Axis => {
            let run = AxisRun { asked: asked(&settings, None), ..AxisRun::default() };
            let c = calibrate_axis(&recording, &rig, &run, &progress)?;
            keep(this, &c.calibration, &c.page, c.missing)
        }
        Target::Camera | Target::HandEye => {
            let mounted = mount_of(&place.station, &settings, None)?;
            let (mount, asked) = (mounted.mount, asked(&settings, None));
            let run = HandEyeRun { poses: None, mount, solver: Default::default(), asked };
            let kept = match calibrate_hand_eye(&recording, &rig, &run, &progress)? {
                HandEyeResult::OnFlange(c) => keep(this, &c.calibration, &c.page, c.missing),
                HandEyeResult::InBase(c) => keep(this, &c.calibration, &c.page, c.missing),
            };
            kept.map(|outcome| saying(outcome, mounted.assumed))
        }
    }
}

/// An outcome that also states what was assumed.
fn saying(mut outcome: Outcome, assumed: Option<String>) -> Outcome {
    if let Outcome::Calibrate(figures) = &mut outcome {
        figures.reasons.extend(assumed);
    }
    outcome
}

/// The recording without some of its frames; the others keep their poses.
fn without(mut recording: Recording, leave_out: &[usize]) -> Result<Recording> {
    let all = recording.meta.frames.len();
    if let Some(strange) = leave_out.iter().find(|i| **i >= all) {
        return Err(
            Fault::usage(format!("frame {strange} shall be excluded, but there are {all}")).next("choose one of them")
        );
    }
    for (i, frame) in recording.meta.frames.iter_mut().enumerate() {
        frame.pose.get_or_insert(i);
    }
    let mut index = 0;
    recording.meta.frames.retain(|_| {
        index += 1;
        !leave_out.contains(&(index - 1))
    });
    Ok(recording)
}

fn keep<T: Serialize>(this: &Run, c: &Calibration<T>, page: &Page, left_out: Vec<(String, String)>) -> Result<Outcome> {
    let text = serde_json::to_string_pretty(c).expect("plain data");
    let (result, html) = (this.folder.join(RESULT), this.folder.join(PAGE));
    sheetlight::files::write_beside((&result, text.as_bytes()), &[(&html, page.html().as_bytes())])?;
    let q = &c.quality;
    Ok(Outcome::Calibrate(Box::new(CalibrationFigures {
        kind: c.kind.name().into(),
        verdict: q.verdict.words().into(),
        reasons: q.reasons.clone(),
        advice: q.advice.clone(),
        figures: q.figures.clone(),
        former: former(&this.jobs.place.station, c.kind),
        per_picture: q.per_picture.clone(),
        left_out,
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
