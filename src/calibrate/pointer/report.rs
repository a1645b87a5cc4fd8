//! In: the fit of a pointer. Out: the verdict with reasons, figures and the next best picture, and the report page;
//! fit and verification are separate.
//! Frame and unit: camera frame; mm, degrees, px.

use super::beam::BEAM_NAMES;
use super::range::{RigCovariance, range};
use super::solve::{PointerFit, PointerOptions, SpotResidual};
use crate::calibrate::limits::{Judgement, Limits, rms};
use crate::calibrate::report::{Page, bars};
use crate::calibrate::scatter::overrule;
use crate::camera::{Intrinsics, NAMES, PARAMETERS, ParameterMatrix, named};
use crate::rig::{Covariance, Quality, Verdict, Volume};
use nalgebra::Matrix2;
use std::collections::BTreeMap;

/// From this scatter relative to the stated sigmas on, the spots are not good and cannot overrule another.
const LOUD: f64 = 3.0;

/// Covariance of the beam and the camera it was fitted with, under the names of the pointer's file.
pub fn covariance(fit: &PointerFit) -> Covariance {
    let camera: ParameterMatrix = fit.covariance.fixed_view::<PARAMETERS, PARAMETERS>(6, 6).into();
    let kept: Vec<usize> = (0..6).chain(named(&camera).into_iter().map(|i| 6 + i)).collect();
    let names: Vec<&str> = kept.iter().map(|&i| if i < 6 { BEAM_NAMES[i] } else { NAMES[i - 6] }).collect();
    Covariance::new(&names, &fit.covariance.select_rows(&kept).select_columns(&kept))
}

/// Expected error of a distance along the optical axis for a spot with this sigma, mm.
pub fn expected_error(fit: &PointerFit, camera: &Intrinsics, depth: f64, spot_px: f64) -> Option<f64> {
    let s = (depth - fit.beam.origin.z) / fit.beam.direction.z;
    let pixel = camera.pixel_from_point(&fit.beam.at(s))?;
    let joint = RigCovariance::from_fn(|i, j| fit.covariance[(i, j)]);
    let spot = Matrix2::identity() * (spot_px * spot_px);
    Some(range(&pixel, &spot, camera, &fit.beam, &joint).ok()?.along_axis_sigma)
}

/// Judges a fit. `spot_px`: usual sigma of a spot's centre, px.
pub fn judge(fit: &PointerFit, camera: &Intrinsics, spot_px: f64, limits: &Limits) -> Quality {
    let work = &limits.working;
    let (near, far) = (work.near_mm, work.far_mm);
    let at = |z: f64| expected_error(fit, camera, z, spot_px).unwrap_or(f64::INFINITY);
    let expected = at(limits.middle()).max(0.0);
    let farthest = at(far);
    let used: Vec<&SpotResidual> = fit.spots.iter().filter(|s| s.used).collect();
    let mut j = limits.by_error(
        expected,
        format!(
            "a distance of {} mm is measured to {expected:.3} mm, one of {} mm to {farthest:.3} mm (1 sigma)",
            work.depth(limits.middle()),
            work.depth(far)
        ),
    );
    j.at_best(Verdict::BadlyDetermined, !(farthest <= 2.0 * limits.usable_mm()), || {
        format!(
            "at {} mm the expected error is {farthest:.2} mm, {:.2} mm are allowed at the far end",
            work.depth(far),
            2.0 * limits.usable_mm()
        )
    });
    j.ended(fit.end);
    by_spots(fit, &used, work, &mut j);
    let [low, high] = fit.reach;
    let loud = format!("the spots scatter {:.1} times more than their sigmas say", fit.sigma_ratio);
    let overruled = used.len() < fit.spots.len();
    j.at_best(Verdict::Usable, fit.sigma_ratio > LOUD && !overruled, || loud.clone());
    j.at_best(Verdict::BadlyDetermined, fit.sigma_ratio > LOUD && overruled, || {
        format!(
            "{loud}; the limit is {LOUD:.0} if spots are excluded: the remaining spots agree too poorly to exclude any"
        )
    });
    j.advise(low > near + 0.25 * (far - near), || format!("show the board nearer, at about {} mm", work.depth(near)));
    j.advise(high < far - 0.25 * (far - near), || {
        format!("show the board farther away, at about {} mm", work.depth(far))
    });
    j.advise(j.verdict != Verdict::Good && used.len() < 12, || {
        "take more pictures, spread over the whole range".into()
    });
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures: figures(fit, &used, work, [expected, farthest], spot_px),
        per_picture: fit.spots.iter().map(|s| (s.name.clone(), s.px)).collect(),
    }
}

/// Judges the number of spots, their spread, and the spots that contradict the others.
fn by_spots(fit: &PointerFit, used: &[&SpotResidual], work: &Volume, j: &mut Judgement) {
    j.at_best(Verdict::Usable, used.len() < 6, || format!("{} spots, 6 are needed to be good", used.len()));
    j.at_best(Verdict::BadlyDetermined, used.len() < 4, || format!("{} spots leave nothing to check", used.len()));
    let [low, high] = fit.reach;
    j.at_best(Verdict::Usable, high - low < 0.3 * (work.far_mm - work.near_mm), || {
        format!("the spots lie at {} to {} mm, the work is at {work}", work.depth(low), work.depth(high))
    });
    for s in fit.spots.iter().filter(|s| !s.used) {
        j.at_best(Verdict::Usable, true, || {
            format!("{} was excluded: its spot is {:.2} px from the beam of the others", s.name, s.px)
        });
    }
    overrule(used.len(), fit.spots.len() - used.len(), j);
    if let Some([out, within]) = &fit.rivals {
        j.at_best(Verdict::BadlyDetermined, true, || {
            format!("{out} was excluded, but with it the others fit as well without {within}: either may be wrong")
        });
    }
    let gate = PointerOptions::default().gate;
    for s in used.iter().filter(|s| s.beside > gate) {
        j.at_best(Verdict::BadlyDetermined, true, || {
            format!(
                "{}: its spot lies {:.1} sigmas from the beam of the others, {:.1} are allowed; too few pictures \
                 remain to exclude it",
                s.name,
                s.beside.sqrt(),
                gate.sqrt()
            )
        });
    }
}

/// The fit in numbers. `expected`: the errors at the working distance and at the far end, mm.
fn figures(
    fit: &PointerFit,
    used: &[&SpotResidual],
    work: &Volume,
    expected: [f64; 2],
    spot_px: f64,
) -> BTreeMap<String, f64> {
    let [low, high] = fit.reach;
    let sigma = |i: usize| fit.covariance[(i, i)].max(0.0);
    BTreeMap::from([
        ("expected_error_at_working_distance_mm".to_string(), expected[0]),
        ("expected_error_at_far_end_mm".into(), expected[1]),
        ("working_near_mm".into(), work.near_mm),
        ("working_far_mm".into(), work.far_mm),
        ("origin_sigma_mm".into(), (sigma(0) + sigma(1) + sigma(2)).sqrt()),
        ("direction_sigma_deg".into(), (sigma(3) + sigma(4) + sigma(5)).sqrt().to_degrees()),
        ("rms_px".into(), rms(used.iter().map(|s| s.px))),
        ("rms_mm".into(), rms(used.iter().map(|s| s.mm))),
        ("holdout_rms_px".into(), rms(used.iter().map(|s| s.holdout_px))),
        ("holdout_rms_mm".into(), rms(used.iter().map(|s| s.holdout_mm))),
        ("nearest_spot_mm".into(), low),
        ("farthest_spot_mm".into(), high),
        ("spots".into(), fit.spots.len() as f64),
        ("spots_used".into(), used.len() as f64),
        ("spot_sigma_px".into(), spot_px),
        ("residual_over_sigma".into(), fit.sigma_ratio),
    ])
}

/// The report page.
pub fn page(fit: &PointerFit, quality: &Quality) -> Page {
    let mut page = Page::new("Pointer calibration");
    page.verdict(quality);
    let s = |i: usize| fit.covariance[(i, i)].max(0.0).sqrt();
    let (o, d) = (fit.beam.origin, fit.beam.direction);
    let rows: Vec<Vec<String>> = (0..3)
        .map(|i| vec![format!("point {}", ["x", "y", "z"][i]), format!("{:.4} mm", o[i]), format!("{:.4} mm", s(i))])
        .chain((0..3).map(|i| {
            vec![format!("direction {}", ["x", "y", "z"][i]), format!("{:.7}", d[i]), format!("{:.7}", s(3 + i))]
        }))
        .collect();
    page.table("The beam, camera frame", &["", "value", "sigma"], &rows);
    let figures: Vec<Vec<String>> = quality.figures.iter().map(|(k, v)| vec![k.clone(), format!("{v:.5}")]).collect();
    page.table("Figures", &["figure (unit in the name)", "value"], &figures);
    page.paragraph("Fit: distance of each spot from the place where the fitted beam meets its board.");
    let fits: Vec<Vec<String>> = fit
        .spots
        .iter()
        .map(|v| {
            let fate = if v.used { "used" } else { "excluded" };
            vec![v.name.clone(), format!("{:.1}", v.depth), format!("{:.4}", v.px), format!("{:.4}", v.mm), fate.into()]
        })
        .collect();
    page.table("Fit", &["picture", "distance mm", "px", "mm", ""], &fits);
    page.figure(
        "Residual of each spot, px",
        &bars(&fit.spots.iter().map(|v| (v.name.clone(), v.px)).collect::<Vec<_>>(), "px", None),
    );
    page.paragraph("Verification: each spot in turn was excluded from the fit and then predicted.");
    let held: Vec<(String, f64)> =
        fit.spots.iter().filter(|v| v.holdout_px.is_finite()).map(|v| (v.name.clone(), v.holdout_px)).collect();
    page.figure("Distance of each spot from the beam of the others, px", &bars(&held, "px", None));
    page
}
