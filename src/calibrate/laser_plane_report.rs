//! In: a laser-plane fit. Out: the verdict with reasons, figures and the next best picture, and the
//! page a person reads; fit and verification apart.
//! Frame and unit: camera frame; mm, degrees, px.

use super::laser_plane::{LaserPlaneFit, PeakUse, StripeView, expected_error};
use super::limits::{Limits, rms};
use super::report::{Page, axis_sphere, bars, coverage_map};
use crate::geometry::Vec2;
use crate::rig::{Covariance, Quality, Verdict};
use std::collections::BTreeMap;

/// Names of the plane's covariance parameters.
pub const PLANE_NAMES: [&str; 4] = ["nx", "ny", "nz", "offset_mm"];

pub fn covariance(fit: &LaserPlaneFit) -> Covariance {
    Covariance::new(&PLANE_NAMES, &fit.covariance)
}

/// Judges a fit.
pub fn judge(fit: &LaserPlaneFit, limits: &Limits) -> Quality {
    let work = &limits.working;
    let (near, far) = (work.near_mm, work.far_mm);
    let expected = expected_error(&fit.plane, &fit.covariance, near, far);
    let exact = expected_error(&fit.plane, &fit.covariance_camera_exact, near, far);
    let camera_part = (expected * expected - exact * exact).max(0.0).sqrt();
    let used: Vec<_> = fit.views.iter().filter(|v| v.used).collect();
    let spread = fit.board_spread.to_degrees();
    let [low, high] = fit.reach;
    let tilt = (0..3).map(|i| fit.covariance[(i, i)].max(0.0)).sum::<f64>().sqrt();
    let mut j = limits.by_error(
        expected,
        format!(
            "the plane is known to {expected:.4} mm (1 sigma) at {work}, its tilt to {:.4} degrees",
            tilt.to_degrees()
        ),
    );
    j.at_best(Verdict::BadlyDetermined, spread < 5.0, || {
        format!(
            "all boards are parallel to {spread:.1} degrees: an error that they share would stay unseen; 5 are needed"
        )
    });
    j.at_best(Verdict::Usable, (5.0..15.0).contains(&spread), || {
        format!("the boards' tilts spread over {spread:.1} degrees, 15 are needed to be good")
    });
    j.at_best(Verdict::BadlyDetermined, fit.depth_spread < 3.0, || {
        format!("the stripes spread by {:.1} mm across their own direction: they are nearly one line", fit.depth_spread)
    });
    j.at_best(Verdict::BadlyDetermined, used.len() < 3, || "two pictures leave nothing to check".into());
    j.at_best(Verdict::Usable, (3..5).contains(&used.len()), || {
        format!("{} pictures, 5 are needed to be good", used.len())
    });
    j.at_best(Verdict::Usable, low > near + 0.25 * (far - near) || high < far - 0.25 * (far - near), || {
        format!("the boards were lit at {} to {} mm, the work is at {work}", work.depth(low), work.depth(high))
    });
    for v in fit.views.iter().filter(|v| !v.used) {
        j.at_best(Verdict::Usable, true, || {
            format!(
                "{} was left out: {:.3} px from the plane of the others (a board that moved, or too few peaks)",
                v.name, v.px
            )
        });
    }
    if camera_part > 0.0 {
        j.reasons.push(format!("the camera's own uncertainty makes {camera_part:.4} mm of the error"));
    }
    j.advise(spread < 15.0, || "tilt the board by 20 degrees or more, once to each side".into());
    j.advise(low > near + 0.15 * (far - near), || {
        format!("show a board nearer, at {} to {} mm", work.depth(near), work.depth(near + 0.15 * (far - near)))
    });
    j.advise(high < far - 0.15 * (far - near), || {
        format!("show a board farther away, at {} to {} mm", work.depth(far - 0.15 * (far - near)), work.depth(far))
    });
    j.advise(j.verdict != Verdict::Good && camera_part > 0.7 * expected, || {
        "calibrate the camera with more pictures first: most of the error comes from it".into()
    });
    let count = |u: PeakUse| fit.uses.iter().flatten().filter(|x| **x == u).count() as f64;
    let figures = BTreeMap::from([
        ("expected_error_at_working_distance_mm".to_string(), expected),
        ("expected_error_from_camera_mm".into(), camera_part),
        ("working_near_mm".into(), near),
        ("working_far_mm".into(), far),
        ("tilt_sigma_deg".into(), tilt.to_degrees()),
        ("offset_sigma_mm".into(), fit.covariance[(3, 3)].max(0.0).sqrt()),
        ("rms_px".into(), rms(used.iter().map(|v| v.px))),
        ("rms_mm".into(), rms(used.iter().map(|v| v.mm))),
        ("holdout_rms_px".into(), rms(used.iter().map(|v| v.holdout_px))),
        ("holdout_rms_mm".into(), rms(used.iter().map(|v| v.holdout_mm))),
        ("board_spread_deg".into(), spread),
        ("stripe_spread_mm".into(), fit.depth_spread),
        ("nearest_board_mm".into(), low),
        ("farthest_board_mm".into(), high),
        ("peaks_used".into(), count(PeakUse::Used)),
        ("peaks_off_board".into(), count(PeakUse::OffBoard)),
        ("peaks_at_print_edges".into(), count(PeakUse::AtEdge)),
        ("peaks_disagreeing".into(), count(PeakUse::Disagrees)),
        ("residual_over_sigma".into(), fit.sigma_ratio),
        ("neighbour_factor".into(), fit.neighbour_factor),
    ]);
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures,
        per_picture: fit.views.iter().map(|v| (v.name.clone(), v.px)).collect(),
    }
}

/// The report.
pub fn page(fit: &LaserPlaneFit, views: &[StripeView], quality: &Quality, size: (u32, u32)) -> Page {
    let mut page = Page::new("Laser plane calibration");
    page.verdict(quality);
    let (n, s) = (fit.plane.normal, |i: usize| fit.covariance[(i, i)].max(0.0).sqrt());
    let rows: Vec<Vec<String>> = [("normal x", n.x, 0), ("normal y", n.y, 1), ("normal z", n.z, 2)]
        .iter()
        .map(|(name, v, i)| vec![name.to_string(), format!("{v:.7}"), format!("{:.7}", s(*i))])
        .chain([vec!["offset".into(), format!("{:.4} mm", fit.plane.offset), format!("{:.4} mm", s(3))]])
        .collect();
    page.table("normal · X = offset, camera frame", &["", "value", "sigma"], &rows);
    let figures: Vec<Vec<String>> = quality.figures.iter().map(|(k, v)| vec![k.clone(), format!("{v:.5}")]).collect();
    page.table("Figures", &["figure (unit in the name)", "value"], &figures);
    page.paragraph("Fit: distance of the peaks from the fitted plane's stripe, by picture.");
    let fits: Vec<Vec<String>> = fit
        .views
        .iter()
        .map(|v| {
            let fate = if v.used { "used" } else { "left out" };
            vec![
                v.name.clone(),
                format!("{} of {}", v.peaks_used, v.peaks),
                format!("{:.4}", v.px),
                format!("{:.4}", v.mm),
                format!("{:.1}", v.strain),
                fate.into(),
            ]
        })
        .collect();
    page.table("Fit", &["picture", "peaks", "px", "mm", "strain of the board", ""], &fits);
    page.figure(
        "Residual of each picture in the fit, px",
        &bars(&fit.views.iter().map(|v| (v.name.clone(), v.px)).collect::<Vec<_>>(), "px", None),
    );
    page.paragraph("Verification: each picture in turn was left out of the fit and then predicted.");
    let held: Vec<(String, f64)> =
        fit.views.iter().filter(|v| v.holdout_mm.is_finite()).map(|v| (v.name.clone(), v.holdout_mm)).collect();
    page.figure("Distance of each picture's stripe from the plane of the others, mm", &bars(&held, "mm", None));
    let seen: Vec<Vec2> = views
        .iter()
        .zip(&fit.uses)
        .flat_map(|(v, u)| v.peaks.iter().zip(u).filter(|(_, u)| **u == PeakUse::Used).map(|(p, _)| p.pixel))
        .collect();
    page.figure("Where the stripe was seen", &coverage_map(size.0, size.1, &seen));
    let normals: Vec<_> = views
        .iter()
        .enumerate()
        .map(|(i, v)| (v.pose.camera_from_board.rotation.column(2).into_owned(), i.to_string()))
        .collect();
    page.figure("The boards' normals: a good set is spread around the centre", &axis_sphere(&normals));
    page
}
