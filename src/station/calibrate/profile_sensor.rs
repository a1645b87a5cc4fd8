//! In: files of profiles of a ball or a plate, robot poses. Out: the calibration of a line-profile sensor on the flange
//! with its report, or the agreement with a given transform.
//! Frame and unit: flange_from_sensor; mm, rad.

use super::hand_eye::Calibrated;
use super::profile_report::{Told, of_ball, of_plane};
use crate::calibrate::hand_eye::report::HAND_EYE_NAMES;
use crate::calibrate::limits::Asked;
use crate::calibrate::profile_sensor::ball;
use crate::calibrate::profile_sensor::ball::evaluate::Evaluation;
use crate::calibrate::profile_sensor::ball::options::BallOptions;
use crate::calibrate::profile_sensor::missing::{Cleaned, Heights, cleaned};
use crate::calibrate::profile_sensor::plane;
use crate::calibrate::profile_sensor::plane::evaluate::PlaneEvaluation;
use crate::calibrate::profile_sensor::plane::options::PlaneOptions;
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Sensor};
use crate::recording::load_poses;
use crate::recording::profiles::{files_of, load};
use crate::rig::{Calibration, Covariance, Kind, Volume};
use crate::robot::fanuc_tp;
use std::path::Path;

/// What stands still before the sensor.
#[derive(Clone, Debug)]
pub enum ProfileTarget {
    /// A ball of known diameter.
    Ball(BallOptions),
    /// A flat plate.
    Plane(PlaneOptions),
}

impl ProfileTarget {
    fn heights(&self) -> Heights {
        match self {
            ProfileTarget::Ball(o) => o.heights,
            ProfileTarget::Plane(o) => o.heights,
        }
    }
}

/// Agreement of profiles and poses with a given transform.
#[derive(Clone, Debug, serde::Serialize)]
#[serde(untagged)]
pub enum ProfileEvaluation {
    /// On one ball.
    Ball(Evaluation),
    /// On one plane.
    Plane(PlaneEvaluation),
}

/// Calibrates a line-profile sensor from profiles of a ball or a plate. Also returns warnings in words.
pub fn calibrate_profile_hand_eye(
    profiles: &Path,
    poses: &Path,
    target: &ProfileTarget,
    asked: &Asked,
) -> Result<(Calibrated<Rigid<Flange, Sensor>>, Vec<String>)> {
    asked.check()?;
    let Cleaned { profiles: all, suspects, warnings: strange } = cleaned(load(profiles)?, target.heights());
    let (read, mut warnings) = poses_of(poses)?;
    warnings.extend(strange);
    let told = match target {
        ProfileTarget::Ball(o) => of_ball(ball::solve::solve(&all, &read, o)?),
        ProfileTarget::Plane(o) => of_plane(plane::solve::solve(&all, &read, o)?),
    };
    let measured = |p: &&[f64; 2]| !suspects.contains(&p[1]);
    let points = || all.iter().flat_map(|p| &p.points).filter(measured);
    let span = |axis: usize| Volume::spanned(points().map(|p| p[axis]), "where the profiles' points lie");
    let (seen, width) = (span(1).expect("profiles with points"), span(0).expect("profiles with points").length());
    let Told { fit, quality, page } = told.judged(&asked.limits(&seen, |_| width));
    let c = fit.covariance.view((0, 0), (6, 6)).into_owned();
    let mut calibration = Calibration::new(
        Kind::ProfileHandEye,
        fit.flange_from_sensor,
        None,
        Covariance::new(&HAND_EYE_NAMES, &c),
        quality,
    )
    .with_input(poses)?;
    for path in files_of(profiles)? {
        calibration = calibration.with_input(&path)?;
    }
    Ok((Calibrated { calibration, page, missing: Vec::new() }, warnings))
}

/// The agreement of profiles and poses with a given transform. Also returns warnings in words.
pub fn evaluate_profile_hand_eye(
    profiles: &Path,
    poses: &Path,
    transform: &Path,
    target: &ProfileTarget,
) -> Result<(ProfileEvaluation, Vec<String>)> {
    let sensor = sensor_of(transform)?;
    let (read, mut warnings) = poses_of(poses)?;
    let cleaned = cleaned(load(profiles)?, target.heights());
    warnings.extend(cleaned.warnings);
    let all = &cleaned.profiles;
    let found = match target {
        ProfileTarget::Ball(o) => ProfileEvaluation::Ball(ball::evaluate::evaluate(all, &read, &sensor, o)?),
        ProfileTarget::Plane(o) => ProfileEvaluation::Plane(plane::evaluate::evaluate(all, &read, &sensor, o)?),
    };
    Ok((found, warnings))
}

/// `flange_T_sensor` of a JSON file: a calibration's record, or an object with that key.
fn sensor_of(path: &Path) -> Result<Rigid<Flange, Sensor>> {
    let text = crate::files::read_text(path)?;
    let refuse = |what: String| {
        Fault::input(format!("{}: {what}", path.display()))
            .cause("another file, or another transform")
            .next("give calibration/profile_hand_eye.json, or {\"flange_T_sensor\": [16 numbers, row by row, mm]}")
    };
    let file: serde_json::Value = serde_json::from_str(&text).map_err(|e| refuse(format!("is not JSON: {e}")))?;
    let frame = file.get("frame").and_then(|f| f.as_str());
    let rows = match (file.get("flange_T_sensor"), frame) {
        (Some(rows), _) => rows,
        (None, Some("flange_T_sensor")) => file.get("value").unwrap_or(&serde_json::Value::Null),
        (None, Some(other)) => return Err(refuse(format!("holds {other}, flange_T_sensor is wanted"))),
        (None, None) => return Err(refuse("holds no flange_T_sensor".into())),
    };
    let rows: [f64; 16] = serde_json::from_value(rows.clone())
        .map_err(|e| refuse(format!("flange_T_sensor is not a list of 16 numbers: {e}")))?;
    Rigid::from_rows(&rows).map(|(pose, _)| pose).map_err(|e| e.at(path.display()))
}

/// Poses of a recording's file or of a FANUC listing. Also returns warnings in words.
fn poses_of(path: &Path) -> Result<(Vec<Rigid<Base, Flange>>, Vec<String>)> {
    let (poses, _, warnings) = listed_poses(path)?;
    Ok((poses, warnings))
}

/// Poses of a recording's file or of a FANUC listing; the number of the listing's user frame, 0 for the base. Also
/// returns warnings in words.
pub(in crate::station) fn listed_poses(path: &Path) -> Result<(Vec<Rigid<Base, Flange>>, u32, Vec<String>)> {
    let listing = path.extension().is_some_and(|e| ["ls", "tp"].iter().any(|k| e.eq_ignore_ascii_case(k)));
    if !listing {
        return load_poses(path).map(|f| (f.poses, 0, f.warnings));
    }
    let text = crate::files::read_text(path)?;
    let read = fanuc_tp::read::<Base, Flange>(&text).map_err(|e| e.at(path.display()))?;
    let mut warnings = Vec::new();
    let (uf, ut) = (read[0].user_frame, read[0].tool_frame);
    if uf != 0 || ut != 0 {
        warnings.push(format!(
            "the listing's poses are those of tool frame {ut} in user frame {uf}: the result is the sensor in that \
             tool frame; it is the flange's only if UT {ut} is zero"
        ));
    }
    Ok((read.into_iter().map(|p| p.pose).collect(), uf, warnings))
}
