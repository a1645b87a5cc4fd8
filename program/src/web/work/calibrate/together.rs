//! In: recordings of boards. Out: calibrations of the whole rig from one solve, beside the station's present ones;
//! stored together when they are accepted.
//! Frame and unit: mm, degrees.

use super::super::run::Run;
use crate::procedure::calibrate::JointOrder;
use crate::web::message::{CalibrationFigures, Outcome};
use sheetlight::fault::Result;
use sheetlight::rig::{Quality, Rig};
use sheetlight::station::{JointResult, accept_joint, store_joint};
use std::path::Path;

/// The result that waits for acceptance, in the job's folder; it has the layout of a station's folder.
const RESULT: &str = "result";

pub(in crate::web::work) fn joint(this: &Run, order: &JointOrder) -> Result<Outcome> {
    let (result, remarks) = this.remarked(|at| order.solve(at, &|done, of| this.progress(done, Some(of))))?;
    Ok(Outcome::Joint(Box::new(keep(this, &result, remarks)?)))
}

/// Stores a result in the job's folder; returns its figures, with remarks among the reasons.
pub(super) fn keep(this: &Run, result: &JointResult, remarks: Vec<String>) -> Result<CalibrationFigures> {
    let folder = this.folder.join(RESULT);
    sheetlight::files::make_folder(&folder)?;
    store_joint(&folder, result)?;
    let q: &Quality = &result.quality;
    let former = Rig::load(&this.jobs.place.station).ok().and_then(|r| r.laser_plane.map(|c| c.quality.figures));
    Ok(CalibrationFigures {
        kind: "joint".into(),
        verdict: q.verdict.words().into(),
        reasons: q.reasons.iter().cloned().chain(remarks).collect(),
        advice: q.advice.clone(),
        figures: q.figures.clone(),
        former: former.unwrap_or_default(),
        per_picture: Vec::new(),
        left_out: Vec::new(),
        accepted: false,
    })
}

/// Stores a result in the station, all of it or nothing.
pub(super) fn store(folder: &Path, station: &Path) -> Result<()> {
    accept_joint(&folder.join(RESULT), station).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::rig::{JointCovariance, Kind, sealed};
    use sheetlight::simulate::Station;
    use std::path::PathBuf;
    use std::process::Command;

    /// Variable that names the folder of job and station to the process that is stopped.
    const FOLDER: &str = "SHEETLIGHT_TEST_ACCEPTS_IN";

    /// A set of records whose covariance and page identify its seed.
    fn made(folder: &Path, seed: u64) {
        let rig = Station::random(seed).calibrations(None);
        let beside = |stored: &Rig| {
            let camera = (Kind::Camera, stored.camera.as_ref().unwrap().content());
            let plane = (Kind::LaserPlane, stored.laser_plane.as_ref().unwrap().content());
            let hand_eye = (Kind::HandEye, stored.hand_eye.as_ref().unwrap().content());
            let of = [camera, plane, hand_eye].into();
            let (parameters, matrix) = (vec!["camera.fx_px".into()], vec![vec![seed as f64]]);
            let together = JointCovariance { format: 1, of, parameters, matrix };
            vec![("joint.json", sealed(&together)), ("joint.html", format!("page of {seed}"))]
        };
        rig.store_all_with(folder, beside).unwrap();
    }

    /// The seed of the set that a station contains; fails if it contains parts of two sets. `sets`: the folders of
    /// seeds 1 and 2.
    fn held(station: &Path, sets: [&Path; 2]) -> u64 {
        let rig = Rig::load(station).unwrap();
        rig.belong_together().unwrap();
        let joint = rig.joint().expect("a covariance").expect("a covariance of these records");
        let seed = joint.matrix[0][0] as u64;
        // Read from files, as the station is.
        let made = Rig::load(sets[seed as usize - 1]).unwrap();
        let values = |rig: &Rig| {
            let camera = rig.camera.as_ref().unwrap().value;
            (camera, rig.laser_plane.as_ref().unwrap().value, rig.hand_eye.as_ref().unwrap().value)
        };
        assert_eq!(format!("{:?}", values(&rig)), format!("{:?}", values(&made)), "records of another set than {seed}");
        let page = std::fs::read_to_string(station.join("calibration/joint.html"));
        assert!(page.is_ok_and(|p| p == format!("page of {seed}")), "the page is of another set");
        seed
    }

    #[test]
    #[cfg_attr(not(debug_assertions), ignore = "only debug builds can be stopped at a file operation")]
    fn an_acceptance_that_is_stopped_anywhere_leaves_the_old_set_or_the_new_one() {
        if let Some(folder) = std::env::var_os(FOLDER).map(PathBuf::from) {
            std::process::exit(i32::from(store(&folder.join("job"), &folder.join("station")).is_err()));
        }
        let dir = tempfile::tempdir().unwrap();
        let (station, name) = (dir.path().join("station"), std::thread::current().name().unwrap().to_owned());
        let (old, new) = (dir.path().join("old"), dir.path().join("job").join(RESULT));
        made(&old, 1);
        made(&new, 2);
        for variable in ["SHEETLIGHT_DIE_AT", "SHEETLIGHT_FULL_AT"] {
            let mut seen = [0, 0];
            for at in 1.. {
                made(&station, 1);
                let mut child = Command::new(std::env::current_exe().unwrap());
                child
                    .args([&*name, "--exact", "--test-threads=1"])
                    .env(FOLDER, dir.path())
                    .env(variable, at.to_string());
                let done = child.output().unwrap().status.success();
                let seed = held(&station, [&old, &new]);
                assert!(!done || seed == 2, "{variable}={at}");
                if done {
                    break;
                }
                seen[seed as usize - 1] += 1;
            }
            assert!(seen[0] > 5 && seen[1] > 2, "{variable}: {} old, {} new", seen[0], seen[1]);
        }
    }
}
