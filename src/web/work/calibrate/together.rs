//! In: recordings of boards. Out: the whole rig from one solve beside the station's present one; stored together when it is accepted.
//! Frame and unit: mm, degrees.

use super::super::run::Run;
use crate::calibrate::hand_eye::options::Mount;
use crate::fault::{Fault, Result};
use crate::recording::Recording;
use crate::rig::{Quality, Rig, Verdict};
use crate::scan::Where;
use crate::station::volume::asked;
use crate::station::{JointResult, JointRun, Settings, calibrate_joint, store_joint};
use crate::web::guard::resolve;
use crate::web::message::{CalibrationFigures, JointOrder, Outcome};
use std::path::Path;

/// The result that waits to be accepted, in the job's folder: laid out as a station's.
const RESULT: &str = "result";
/// Files of a joint calibration beside the records.
const BESIDE: [&str; 2] = ["joint.json", "joint.html"];

pub(in crate::web::work) fn joint(this: &Run, order: &JointOrder) -> Result<Outcome> {
    let place = &this.jobs.place;
    if order.recordings.is_empty() {
        return Err(Fault::usage("no recording was chosen").next("choose recordings of boards"));
    }
    let open = |name: &String| Recording::open(&resolve(&place.recordings, name)?);
    let recordings = order.recordings.iter().map(open).collect::<Result<Vec<_>>>()?;
    let (settings, rig) = (Settings::load(&place.station)?, Rig::load_camera(&place.station)?);
    let run = run(&settings);
    let result = calibrate_joint(&recordings, &rig, &run, &|done, of| this.progress(done, Some(of)))?;
    Ok(Outcome::Joint(Box::new(keep(this, &result)?)))
}

/// As the station's settings have it.
pub(super) fn run(settings: &Settings) -> JointRun {
    JointRun::new(Mount::EyeInHand, asked(settings, None), &settings.extraction, Where::default())
}

/// Keeps a result in the job's folder; its figures.
pub(super) fn keep(this: &Run, result: &JointResult) -> Result<CalibrationFigures> {
    let folder = this.folder.join(RESULT);
    crate::files::make_folder(&folder)?;
    store_joint(&folder, result)?;
    let q: &Quality = &result.quality;
    let former = Rig::load(&this.jobs.place.station).ok().and_then(|r| r.laser_plane.map(|c| c.quality.figures));
    Ok(CalibrationFigures {
        kind: "joint".into(),
        verdict: q.verdict.words().into(),
        reasons: q.reasons.clone(),
        advice: q.advice.clone(),
        figures: q.figures.clone(),
        former: former.unwrap_or_default(),
        per_picture: Vec::new(),
        left_out: Vec::new(),
        accepted: false,
    })
}

/// Stores a kept result in the station.
pub(super) fn store(folder: &Path, station: &Path) -> Result<()> {
    let kept = folder.join(RESULT);
    let rig = Rig::load(&kept)?;
    let quality = rig
        .camera
        .as_ref()
        .map(|c| &c.quality)
        .ok_or_else(|| Fault::input(format!("{}: holds no calibration", kept.display())).next("calibrate again"))?;
    if quality.verdict >= Verdict::BadlyDetermined {
        return Err(Fault::refused(format!("the calibration is {}", quality.verdict.words()))
            .cause(quality.reasons.join("; "))
            .next(quality.advice.first().map_or("take more pictures", String::as_str)));
    }
    rig.store_all(station)?;
    let read = |name: &str| crate::files::read_text(&kept.join("calibration").join(name));
    let [json, html] = BESIDE.map(read);
    let to = station.join("calibration");
    crate::files::write_beside((&to.join(BESIDE[0]), json?.as_bytes()), &[(&to.join(BESIDE[1]), html?.as_bytes())])
}
