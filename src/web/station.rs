//! In: a station's folder. Out: what pages say of it: settings, calibrations with their age and what they make expect.
//! Frame and unit: mm, days.

use super::message::{CalibrationAge, CalibrationState, FrameInfo, Problem, StationInfo};
use super::work::Place;
use crate::rig::{Calibration, Quality, Rig, Verdict};
use crate::robot::Convention;
use crate::station::Settings;
use jiff::{Timestamp, Unit};
use serde_json::Value;
use std::collections::BTreeMap;

/// Figures in which calibrations state what they make expect at the working distance, mm.
const EXPECTED: [&str; 2] = ["expected_error_at_working_distance_mm", "expected_point_error_mm"];

fn days_since(created: &str) -> f64 {
    let since = created.parse::<Timestamp>().ok().and_then(|t| Timestamp::now().since(t).ok());
    since.and_then(|s| s.total(Unit::Hour).ok()).map_or(f64::NAN, |hours| (hours / 24.0).max(0.0))
}

fn state<T>(c: &Calibration<T>) -> CalibrationState {
    let q: &Quality = &c.quality;
    CalibrationState {
        kind: c.kind.name().into(),
        words: c.kind.words(),
        verdict: q.verdict.words().into(),
        created: c.created.clone(),
        days: days_since(&c.created),
        expected_mm: EXPECTED.iter().find_map(|k| q.figures.get(*k).copied()),
    }
}

/// Every calibration that there is.
pub fn calibrations(rig: &Rig) -> Vec<CalibrationState> {
    let all = [
        rig.camera.as_ref().map(state),
        rig.laser_plane.as_ref().map(state),
        rig.hand_eye.as_ref().map(state),
        rig.pointer.as_ref().map(state),
        rig.base_camera.as_ref().map(state),
        rig.linear_axis.as_ref().map(state),
        rig.turntable.as_ref().map(state),
    ];
    all.into_iter().flatten().collect()
}

/// What the bar says of them; none without camera, laser plane and what carries them.
pub fn age(rig: &Rig) -> Option<CalibrationAge> {
    let carried =
        rig.hand_eye.is_some() || rig.base_camera.is_some() || rig.linear_axis.is_some() || rig.turntable.is_some();
    rig.camera.as_ref().zip(rig.laser_plane.as_ref()).filter(|_| carried)?;
    let all = calibrations(rig);
    let verdicts = [
        rig.camera.as_ref().map(|c| c.quality.verdict),
        rig.laser_plane.as_ref().map(|c| c.quality.verdict),
        rig.hand_eye.as_ref().map(|c| c.quality.verdict),
    ];
    let worst = verdicts.into_iter().flatten().max().unwrap_or(Verdict::Refused);
    let known: Vec<f64> = all.iter().filter_map(|c| c.expected_mm).collect();
    let scanning = all.iter().filter(|c| c.kind != "pointer").count();
    let expected = (known.len() >= scanning).then(|| known.iter().map(|v| v * v).sum::<f64>().sqrt());
    let days = all.iter().map(|c| c.days).fold(0.0, f64::max);
    Some(CalibrationAge { days, verdict: worst.words().into(), expected_mm: expected })
}

/// The station as it stands on the disk now.
pub fn info(place: &Place) -> StationInfo {
    let settings = Settings::load(&place.station);
    let rig = Rig::load(&place.station);
    let problem = settings.as_ref().err().or(rig.as_ref().err()).map(Problem::from);
    let problem =
        problem.or_else(|| rig.as_ref().ok().and_then(|r| r.belong_together().err()).as_ref().map(Problem::from));
    let settings = settings.unwrap_or_default();
    let frames = rig.as_ref().map(|rig| frames(&settings, rig)).unwrap_or_default();
    let mut extraction = BTreeMap::new();
    flatten("", &serde_json::to_value(&settings.extraction).expect("plain data"), &mut extraction);
    StationInfo {
        name: settings.name.clone(),
        mode: place.mode,
        program: format!("sheetlight {}", env!("CARGO_PKG_VERSION")),
        robot: settings.robot.map(|r| r.name().to_owned()),
        tolerance_mm: settings.tolerance_mm,
        volume_mm: settings.working_volume.map(|v| [v.near_mm, v.far_mm]),
        work_frame: rig.as_ref().map_or("base", work_frame).into(),
        frames,
        calibrations: rig.as_ref().map(calibrations).unwrap_or_default(),
        problem,
        extraction,
    }
}

/// Frame of what is scanned.
fn work_frame(rig: &Rig) -> &'static str {
    if rig.hand_eye.is_some() || rig.base_camera.is_some() {
        "base"
    } else if rig.linear_axis.is_some() || rig.turntable.is_some() {
        "axis"
    } else {
        "camera"
    }
}

/// Tool and camera where they are fixed.
fn frames(settings: &Settings, rig: &Rig) -> Vec<FrameInfo> {
    let robot = settings.robot.unwrap_or(Convention::Matrix);
    let info = |name: &str, on: &str, numbers: Vec<f64>| FrameInfo {
        name: name.into(),
        on: on.into(),
        labels: robot.labels().iter().map(|l| (*l).to_owned()).collect(),
        numbers,
    };
    let tool = settings.tool.map(|t| info("tool", "flange", robot.write(&t.flange_from_tool)));
    let riding = rig.hand_eye.as_ref().map(|h| info("camera", "flange", robot.write(&h.value)));
    let standing = rig.base_camera.as_ref().map(|c| info("camera", "base", robot.write(&c.value)));
    [tool, riding, standing].into_iter().flatten().collect()
}

/// Groups of settings as names with dots.
pub(super) fn flatten(before: &str, value: &Value, out: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                let name = if before.is_empty() { key.clone() } else { format!("{before}.{key}") };
                flatten(&name, value, out);
            }
        }
        value => {
            out.insert(before.to_owned(), value.clone());
        }
    }
}
