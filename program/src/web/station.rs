//! In: a station's folder. Out: the data that pages show of it: settings, calibrations with their age and the
//! expected error.
//! Frame and unit: mm, days.

use super::message::{CalibrationAge, CalibrationState, FrameInfo, Problem, StationInfo};
use super::work::Place;
use jiff::{Timestamp, Unit};
use serde_json::Value;
use sheetlight::rig::{Kind, Record, Rig, Verdict};
use sheetlight::robot::Convention;
use sheetlight::station::Settings;
use std::collections::BTreeMap;

/// Figures in which calibrations state the error expected at the working distance, mm.
const EXPECTED: [&str; 2] = ["expected_error_at_working_distance_mm", "expected_point_error_mm"];

/// Name in the bar of the joint covariance of all records.
const JOINT: &str = "joint covariance";

fn days_since(created: &str) -> f64 {
    let since = created.parse::<Timestamp>().ok().and_then(|t| Timestamp::now().since(t).ok());
    since.and_then(|s| s.total(Unit::Hour).ok()).map_or(f64::NAN, |hours| (hours / 24.0).max(0.0))
}

fn state(record: &dyn Record) -> CalibrationState {
    let q = record.quality();
    CalibrationState {
        kind: record.kind().name().into(),
        words: record.kind().words(),
        verdict: q.verdict.words().into(),
        created: record.created().to_owned(),
        days: days_since(record.created()),
        expected_mm: EXPECTED.iter().find_map(|k| q.figures.get(*k).copied()),
    }
}

/// All existing calibrations.
pub fn calibrations(rig: &Rig) -> Vec<CalibrationState> {
    rig.records().into_iter().map(state).collect()
}

/// The bar's summary of the calibrations; `None` without a camera, a laser plane and the calibration of the motion
/// that carries them. The worst record decides. If joint.json does not match the station's records, the verdict is
/// usable at best, because the common errors are unknown.
pub fn age(rig: &Rig) -> Option<CalibrationAge> {
    let carried =
        rig.hand_eye.is_some() || rig.base_camera.is_some() || rig.linear_axis.is_some() || rig.turntable.is_some();
    rig.camera.as_ref().zip(rig.laser_plane.as_ref()).filter(|_| carried)?;
    let verdicts = rig.records().into_iter().map(|r| (r.quality().verdict, r.kind().words()));
    let joint = rig.joint().and_then(std::result::Result::err).map(|_| (Verdict::Usable, JOINT.to_owned()));
    let (verdict, worst) = verdicts.chain(joint).reduce(|a, b| if b.0 > a.0 { b } else { a })?;
    let all = calibrations(rig);
    let scanning: Vec<_> = all
        .iter()
        .filter(|c| c.kind != Kind::Pointer.name() && c.kind != Kind::ProfileHandEye.name())
        .map(|c| c.expected_mm)
        .collect();
    let known: Option<Vec<f64>> = scanning.into_iter().collect();
    let expected = known.map(|mm| mm.iter().map(|v| v * v).sum::<f64>().sqrt());
    let days = all.iter().map(|c| c.days).fold(0.0, f64::max);
    Some(CalibrationAge { days, verdict: verdict.words().into(), worst, expected_mm: expected })
}

/// The station as stored on the disk now.
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
        mount: settings.mount.map(|m| m.name().to_owned()),
        tolerance_mm: settings.tolerance_mm,
        volume_mm: settings.working_volume.map(|v| [v.near_mm, v.far_mm]),
        work_frame: rig.as_ref().map_or("base", work_frame).into(),
        frames,
        calibrations: rig.as_ref().map(calibrations).unwrap_or_default(),
        problem,
        extraction,
    }
}

/// Frame of scans.
fn work_frame(rig: &Rig) -> &'static str {
    if rig.hand_eye.is_some() || rig.base_camera.is_some() {
        "base"
    } else if rig.linear_axis.is_some() || rig.turntable.is_some() {
        "axis"
    } else {
        "camera"
    }
}

/// Poses of tool and camera where they are fixed.
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

/// Flattens groups of settings into dotted names.
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

#[cfg(test)]
mod tests {
    use super::*;
    use sheetlight::geometry::{Axis, AxisKind, Base, Camera, CountUnit, Flange, Rigid, Sensor};
    use sheetlight::rig::{Calibration, Covariance, Joint, JointCovariance, Quality};
    use sheetlight::simulate::Station;
    use std::collections::BTreeMap;

    fn quality(verdict: Verdict) -> Quality {
        Quality { verdict, ..Station::random(1).calibrations(None).camera.unwrap().quality }
    }

    /// A rig of good records, and one rig for each kind whose record has this verdict.
    fn rig(verdict: Verdict) -> Vec<(Kind, Rig)> {
        let whole = || Station::random(1).calibrations(None);
        let camera = whole().camera;
        let mut all: Vec<(Kind, Rig)> = Vec::new();
        let mut add = |kind, change: &dyn Fn(&mut Rig)| {
            let mut rig = whole();
            change(&mut rig);
            all.push((kind, rig));
        };
        add(Kind::Camera, &|r| r.camera.as_mut().unwrap().quality = quality(verdict));
        add(Kind::LaserPlane, &|r| r.laser_plane.as_mut().unwrap().quality = quality(verdict));
        add(Kind::HandEye, &|r| r.hand_eye.as_mut().unwrap().quality = quality(verdict));
        add(Kind::Pointer, &|r| r.pointer.as_mut().unwrap().quality = quality(verdict));
        let standing = Rigid::<Base, Camera>::identity();
        let place =
            Calibration::new(Kind::BaseCamera, standing, camera.as_ref(), Covariance::default(), quality(verdict));
        add(Kind::BaseCamera, &|r| r.base_camera = Some(place.clone()));
        for (kind, of) in [(Kind::LinearAxis, AxisKind::Linear), (Kind::Turntable, AxisKind::Turntable)] {
            let value = Axis { kind: of, unit: CountUnit::Count, pitch: 0.01, camera_from_axis: Rigid::identity() };
            let record = Calibration::new(kind, value, camera.as_ref(), Covariance::default(), quality(verdict));
            add(kind, &|r| match of {
                AxisKind::Linear => r.linear_axis = Some(record.clone()),
                AxisKind::Turntable => r.turntable = Some(record.clone()),
            });
        }
        let at = Rigid::<Flange, Sensor>::identity();
        let sensor = Calibration::new(Kind::ProfileHandEye, at, None, Covariance::default(), quality(verdict));
        add(Kind::ProfileHandEye, &|r| r.profile_hand_eye = Some(sensor.clone()));
        all
    }

    #[test]
    fn the_worst_of_all_records_decides_what_the_bar_says() {
        for verdict in [Verdict::Good, Verdict::Usable, Verdict::BadlyDetermined] {
            let all = rig(verdict);
            assert_eq!(all.len(), Kind::OF_A_RIG.len());
            for (kind, rig) in all {
                let said = age(&rig).unwrap();
                assert_eq!(said.verdict, verdict.words(), "{kind:?}");
                assert!(verdict == Verdict::Good || said.worst == kind.words(), "{kind:?}: {}", said.worst);
            }
        }
    }

    #[test]
    fn a_covariance_of_other_records_is_not_good() {
        let mut rig = Station::random(1).calibrations(None);
        let of = |rig: &Rig| {
            BTreeMap::from([
                (Kind::Camera, rig.camera.as_ref().unwrap().content()),
                (Kind::LaserPlane, rig.laser_plane.as_ref().unwrap().content()),
                (Kind::HandEye, rig.hand_eye.as_ref().unwrap().content()),
            ])
        };
        let stated = |of| Joint::Stated(JointCovariance { format: 1, of, parameters: vec![], matrix: vec![] });
        rig.joint = stated(of(&rig));
        assert_eq!(age(&rig).unwrap().verdict, "good");
        rig.joint = stated(of(&Station::random(2).calibrations(None)));
        let said = age(&rig).unwrap();
        assert_eq!((&*said.verdict, &*said.worst), ("usable", JOINT));
        rig.joint = Joint::Spoilt("cut off".into());
        assert_eq!(age(&rig).unwrap().verdict, "usable");
    }
}
