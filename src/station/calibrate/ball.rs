//! In: files of ball profiles and robot poses. Out: the calibration of a line-profile sensor on the
//! flange with its report.
//! Frame and unit: flange_from_sensor; mm, rad.

use super::hand_eye::Calibrated;
use crate::calibrate::ball::evaluate::{Evaluation, evaluate};
use crate::calibrate::ball::missing::{Cleaned, cleaned};
use crate::calibrate::ball::options::BallOptions;
use crate::calibrate::ball::solve::{BallFit, solve};
use crate::calibrate::hand_eye::report::HAND_EYE_NAMES;
use crate::calibrate::limits::{Asked, Limits, rms};
use crate::calibrate::report::{Page, bars};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid, Sensor, Vec3, skew};
use crate::recording::load_poses;
use crate::recording::profiles::{files_of, load};
use crate::rig::{Calibration, Covariance, Kind, Quality, Verdict, Volume};
use crate::robot::fanuc_tp;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use std::path::Path;

/// Calibrates a line-profile sensor from profiles of a ball. Also returns warnings in words.
pub fn calibrate_profile_hand_eye(
    profiles: &Path,
    poses: &Path,
    options: &BallOptions,
    asked: &Asked,
) -> Result<(Calibrated<Rigid<Flange, Sensor>>, Vec<String>)> {
    asked.check()?;
    let Cleaned { profiles: all, suspects, warnings: strange } = cleaned(load(profiles)?, options.heights);
    let (read, mut warnings) = poses_of(poses)?;
    warnings.extend(strange);
    let fit = solve(&all, &read, options)?;
    let measured = |p: &&[f64; 2]| !suspects.contains(&p[1]);
    let points = || all.iter().flat_map(|p| &p.points).filter(measured);
    let span = |axis: usize| Volume::spanned(points().map(|p| p[axis]), "where the profiles' points lie");
    let (seen, width) = (span(1).expect("profiles with points"), span(0).expect("profiles with points").length());
    let quality = judge(&fit, &asked.limits(&seen, |_| width));
    let page = page(&fit, &quality);
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
    options: &BallOptions,
) -> Result<(Evaluation, Vec<String>)> {
    let sensor = sensor_of(transform)?;
    let (read, mut warnings) = poses_of(poses)?;
    let cleaned = cleaned(load(profiles)?, options.heights);
    warnings.extend(cleaned.warnings);
    Ok((evaluate(&cleaned.profiles, &read, &sensor, options)?, warnings))
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

fn expected(fit: &BallFit, distance: f64) -> f64 {
    let p = fit.flange_from_sensor.rotation * Vec3::new(0.0, 0.0, distance);
    let mut j = DMatrix::zeros(3, 6);
    j.view_mut((0, 0), (3, 3)).fill_with_identity();
    j.view_mut((0, 3), (3, 3)).copy_from(&-skew(&p));
    (&j * fit.covariance.view((0, 0), (6, 6)) * j.transpose()).trace().max(0.0).sqrt()
}

fn judge(fit: &BallFit, limits: &Limits) -> Quality {
    let expected = expected(fit, limits.middle());
    let used: Vec<_> = fit.profiles.iter().filter(|p| p.used).collect();
    let mut j = limits.by_error(
        expected,
        format!(
            "a point at {} mm is placed in the flange frame to {expected:.3} mm (1 sigma); depths: {}",
            limits.working.depth(limits.middle()),
            limits.working.from
        ),
    );
    j.reasons.push(format!(
        "the ball's centre lies on the {} side of the profile plane in most profiles; the other side fits worse by \
         {:.0}",
        if fit.side == crate::calibrate::ball::options::Side::Plus { "plus" } else { "minus" },
        fit.side_margin
    ));
    j.ended(fit.end);
    j.at_best(Verdict::Usable, used.len() < 12, || format!("{} profiles, 12 are needed to be good", used.len()));
    for p in fit.profiles.iter().filter(|p| !p.used) {
        j.at_best(Verdict::Usable, true, || {
            format!("{} was excluded: {:.2} mm from what the others predict", p.name, p.mm)
        });
    }
    let high = fit.profiles.iter().map(|p| p.height).fold(f64::NEG_INFINITY, f64::max);
    let low = fit.profiles.iter().map(|p| p.height).fold(f64::INFINITY, f64::min);
    j.advise(j.verdict != Verdict::Good, || {
        format!(
            "take more profiles with the flange tilted by 20 degrees and more, the ball's centre {low:.0} to \
                 {high:.0} mm over the profile plane so far"
        )
    });
    let figures = BTreeMap::from([
        ("expected_error_at_working_distance_mm".to_string(), expected),
        ("working_distance_mm".into(), limits.middle()),
        ("translation_sigma_mm".into(), (0..3).map(|i| fit.covariance[(i, i)]).sum::<f64>().max(0.0).sqrt()),
        ("rotation_sigma_deg".into(), (3..6).map(|i| fit.covariance[(i, i)]).sum::<f64>().max(0.0).sqrt().to_degrees()),
        ("rms_mm".into(), rms(used.iter().map(|p| p.mm))),
        ("holdout_rms_mm".into(), rms(used.iter().map(|p| p.holdout_mm))),
        ("point_sigma_mm".into(), fit.point_sigma),
        ("robot_sigma_mm".into(), fit.robot_sigma),
        ("ball_x_mm".into(), fit.ball.x),
        ("ball_y_mm".into(), fit.ball.y),
        ("ball_z_mm".into(), fit.ball.z),
        ("profiles_used".into(), used.len() as f64),
        ("chi2_per_freedom".into(), fit.chi2),
    ]);
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures,
        per_picture: fit.profiles.iter().map(|p| (p.name.clone(), p.mm)).collect(),
    }
}

fn page(fit: &BallFit, quality: &Quality) -> Page {
    let mut page = Page::new("Line-profile sensor: hand-eye calibration on a ball");
    page.verdict(quality);
    let s = |i: usize| fit.covariance[(i, i)].max(0.0).sqrt();
    let t = fit.flange_from_sensor.translation;
    let [rz, ry, rx] = crate::robot::zyx_of(&fit.flange_from_sensor.rotation);
    let rows: Vec<Vec<String>> = (0..3)
        .map(|i| vec![["x", "y", "z"][i].to_string(), format!("{:.4} mm", t[i]), format!("{:.4} mm", s(i))])
        .chain([("RX", rx, 3), ("RY", ry, 4), ("RZ", rz, 5)].map(|(n, v, i)| {
            vec![
                format!("{n} (R = Rz·Ry·Rx)"),
                format!("{v:.4}°"),
                format!("{:.4}° about the flange's axis", s(i).to_degrees()),
            ]
        }))
        .collect();
    page.table("The sensor on the flange", &["", "value", "sigma"], &rows);
    let figures: Vec<Vec<String>> = quality.figures.iter().map(|(k, v)| vec![k.clone(), format!("{v:.5}")]).collect();
    page.table("Figures", &["figure (unit in the name)", "value"], &figures);
    let fits: Vec<Vec<String>> = fit
        .profiles
        .iter()
        .map(|p| {
            let fate = if p.used { "used" } else { "excluded" };
            vec![
                p.name.clone(),
                format!("{} of {}", p.points[0], p.points[1]),
                format!("{:.4}", p.mm),
                format!("{:+.2}", p.height),
                fate.into(),
            ]
        })
        .collect();
    page.paragraph("Fit: the circle of each profile against the fitted ball.");
    page.table("Fit", &["profile", "points on the ball", "mm", "ball over the plane, mm", ""], &fits);
    page.paragraph("Verification: each profile in turn was excluded from the fit and then predicted.");
    let held: Vec<(String, f64)> =
        fit.profiles.iter().filter(|p| p.holdout_mm.is_finite()).map(|p| (p.name.clone(), p.holdout_mm)).collect();
    page.figure("Error of each profile predicted by the others, mm", &bars(&held, "mm", None));
    page
}
