//! Calibrations from recordings.

use crate::calibration::{Any, Beside, Calibration};
use crate::fault::{OrRaise, raised, word};
use crate::progress::Progress;
use crate::recording::Recording;
use crate::station::{Station, path, with_station};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use sheetlight::calibrate::camera::intrinsics::{Boards, SolveOptions};
use sheetlight::calibrate::camera::lens::Lens;
use sheetlight::calibrate::camera::procedure::{CameraOptions, CameraResult, calibrate};
use sheetlight::calibrate::camera::report::page;
use sheetlight::calibrate::hand_eye::options::{HandEyeOptions, Mount};
use sheetlight::calibrate::laser_plane::options::LaserPlaneOptions;
use sheetlight::calibrate::limits::Asked;
use sheetlight::fault::{Fault, Result};
use sheetlight::recording;
use sheetlight::rig::Volume;
use sheetlight::scan::Where;
use sheetlight::station::volume::asked;
use sheetlight::station::{
    Calibrated, HandEyeResult, HandEyeRun, LaserPlaneRun, calibrate_hand_eye as from_poses,
    calibrate_laser_plane as from_stripes, mount_of,
};

/// A Recording, or the folder of one.
fn recorded(object: &Bound<'_, PyAny>) -> PyResult<Recording> {
    match object.cast::<Recording>() {
        Ok(recording) => Ok(recording.get().copy()),
        Err(_) => Recording::load(&path(object, "recording", "a Recording or a recording's folder")?).or_raise(),
    }
}

/// Calibrates a camera from pictures of a board: one recording or a list of recordings of the same camera, all solved
/// together.
///
/// `lens` is evidence (what the pictures determine), none, one, four, five, rational, prism, scheimpflug or all;
/// `board` is evidence, drawn or shaped. The expected error is stated at the distance `working_mm`.
/// `progress(done, all)` is called with the number of pictures. Ctrl-C takes effect when the calibration has ended.
/// Raises SheetlightError for recordings without boards and for pictures of two sizes.
#[pyfunction]
#[pyo3(signature = (recordings, *, lens = "evidence", skew = false, board = "evidence", working_mm = None,
    progress = None))]
pub fn calibrate_camera(
    py: Python<'_>,
    recordings: &Bound<'_, PyAny>,
    lens: &str,
    skew: bool,
    board: &str,
    working_mm: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Calibration> {
    let several = recordings.is_instance_of::<PyList>() || recordings.is_instance_of::<PyTuple>();
    let recordings: Vec<Recording> = if several {
        recordings.try_iter()?.map(|r| recorded(&r?)).collect::<PyResult<_>>()?
    } else {
        vec![recorded(recordings)?]
    };
    if recordings.is_empty() {
        return Err(raised(Fault::usage("no recording is given").next("give a recording of a board")));
    }
    let solve =
        SolveOptions { lens: word::<Lens>(lens)?, skew, boards: word::<Boards>(board)?, ..SolveOptions::default() };
    let working = working_mm.map(|mm| Volume::new(mm, mm, "stated"));
    let asked = Asked { working, tolerance_mm: None };
    let options = CameraOptions { solve, asked, ..CameraOptions::default() };
    let progress = Progress::new(progress);
    let opened: Vec<recording::Recording> = recordings.iter().map(|r| r.inner.clone()).collect();
    let result = progress.run(py, || calibrate(&opened, &options, &|done, all| progress.tell(done, Some(all))))?;
    let residuals = residuals(&result);
    let page = page(&result, "Camera calibration").html();
    let beside = Beside { page: Some(page), left_out: result.left_out, residuals };
    Ok(Calibration::new(Any::Camera(result.calibration), beside))
}

/// u, v and residual of every feature, by picture.
fn residuals(result: &CameraResult) -> Vec<(String, Vec<[f64; 4]>)> {
    let pictures = result.used.iter().zip(&result.solved.residuals);
    let of = |(seen, residuals): (&_, &Vec<_>)| {
        let seen: &sheetlight::calibrate::camera::intrinsics::Observation = seen;
        let both = seen.view.points.iter().zip(residuals);
        (
            seen.name.clone(),
            both.map(|(p, (r, _)): (_, &(sheetlight::geometry::Vec2, f64))| [p.pixel.x, p.pixel.y, r.x, r.y]).collect(),
        )
    };
    pictures.map(of).collect()
}

/// What is kept of a calibration of the station's.
fn kept<T>(found: Calibrated<T>, any: impl FnOnce(sheetlight::rig::Calibration<T>) -> Any) -> Calibration {
    let beside = Beside { page: Some(found.page.html()), left_out: found.missing, ..Beside::default() };
    Calibration::new(any(found.calibration), beside)
}

/// Calibrates the laser plane from pictures of the stripe on boards, with the station's camera. It is judged at the
/// depths `near_mm` to `far_mm`, without them in the station's working volume. `on` is auto, gpu or cpu. Raises
/// SheetlightError for too few boards with a stripe.
#[pyfunction]
#[pyo3(signature = (recording, station, *, near_mm = None, far_mm = None, on = "auto", progress = None))]
pub fn calibrate_laser_plane(
    py: Python<'_>,
    recording: &Bound<'_, PyAny>,
    station: &Bound<'_, PyAny>,
    near_mm: Option<f64>,
    far_mm: Option<f64>,
    on: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Calibration> {
    let (recording, place) = (recorded(recording)?, word::<Where>(on)?);
    if near_mm.is_some() != far_mm.is_some() {
        return Err(raised(Fault::usage("one of near_mm and far_mm is given").next("give both, or neither")));
    }
    let depths = near_mm.zip(far_mm).map(<[f64; 2]>::from);
    let progress = Progress::new(progress);
    with_station(station, |s: &Station| {
        let run = LaserPlaneRun {
            solver: LaserPlaneOptions::default(),
            asked: asked(&s.settings, depths),
            extraction: s.settings.extraction.clone(),
            place,
        };
        let tell = |done, all| progress.tell(done, Some(all));
        let found = progress.run(py, || from_stripes(&recording.inner, &s.rig, &run, &tell))?;
        Ok(kept(found, Any::LaserPlane))
    })
}

/// Calibrates where the camera is on the flange (or in the base) from pictures of a board that stands still and the
/// robot's poses. `poses` names the recording's pose file; `mount` is eye-in-hand or eye-to-hand, without it as the
/// station says; the robot's standard deviations are estimated unless given. Raises SheetlightError for poses that do
/// not tell.
#[pyfunction]
#[pyo3(signature = (recording, station, *, poses = None, mount = None, robot_sigma_mm = None, robot_sigma_deg = None,
    working_mm = None, progress = None))]
pub fn calibrate_hand_eye(
    py: Python<'_>,
    recording: &Bound<'_, PyAny>,
    station: &Bound<'_, PyAny>,
    poses: Option<String>,
    mount: Option<&str>,
    robot_sigma_mm: Option<f64>,
    robot_sigma_deg: Option<f64>,
    working_mm: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Calibration> {
    let recording = recorded(recording)?;
    let stated = mount.map(word::<Mount>).transpose()?;
    let progress = Progress::new(progress);
    with_station(station, |s: &Station| {
        let run = HandEyeRun {
            poses: poses.or(recording.poses.clone()),
            mount: mounted(s, stated).or_raise()?,
            solver: HandEyeOptions { robot_sigma_mm, robot_sigma_deg, ..HandEyeOptions::default() },
            asked: asked(&s.settings, working_mm.map(|mm| [mm, mm])),
        };
        let tell = |done, all| progress.tell(done, Some(all));
        let found = progress.run(py, || from_poses(&recording.inner, &s.rig, &run, &tell))?;
        Ok(match found {
            HandEyeResult::OnFlange(found) => kept(found, Any::HandEye),
            HandEyeResult::InBase(found) => kept(found, Any::BaseCamera),
        })
    })
}

/// As the station's folder says, else as stated; a station in memory is on the flange unless stated.
fn mounted(station: &Station, stated: Option<Mount>) -> Result<Mount> {
    match &station.folder {
        Some(folder) => Ok(mount_of(folder, &station.settings, stated)?.mount),
        None => Ok(stated.unwrap_or(Mount::EyeInHand)),
    }
}
