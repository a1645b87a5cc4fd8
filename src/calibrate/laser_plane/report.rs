//! In: the fit of a laser plane. Out: the verdict with reasons, figures and the next best picture, and the report
//! page; fit and verification are separate.
//! Frame and unit: camera frame; mm, degrees, px.

use super::checks::{expected_error, places_in_view};
use super::options::LaserPlaneOptions;
use super::solve::{LaserPlaneFit, PeakUse, ViewResidual};
use super::views::StripeView;
use crate::calibrate::limits::{Judgement, Limits, rms};
use crate::calibrate::measured_pose::MISFIT;
use crate::calibrate::report::{Page, axis_sphere, bars, coverage_map};
use crate::calibrate::scatter::{ENOUGH, overrule};
use crate::camera::Intrinsics;
use crate::geometry::Vec2;
use crate::rig::{Covariance, Quality, Verdict, Volume};
use std::collections::BTreeMap;

/// Names of the plane's covariance parameters.
pub const PLANE_NAMES: [&str; 4] = ["nx", "ny", "nz", "offset_mm"];

/// The covariance under [`PLANE_NAMES`]; includes the camera's uncertainty.
pub fn covariance(fit: &LaserPlaneFit) -> Covariance {
    Covariance::new(&PLANE_NAMES, &fit.covariance)
}

/// Beyond this multiple of their own sigmas, the pictures' scatter is not explained by the pixels.
const SCATTER: f64 = 3.0;
/// Smallest spread of the stripes perpendicular to their own direction, as a share of the view's width.
const LEAST_SPREAD: f64 = 0.02;

/// What a verdict rests on.
struct Evidence<'a> {
    fit: &'a LaserPlaneFit,
    used: Vec<&'a ViewResidual>,
    work: &'a Volume,
    /// Expected error at the working depths, and the camera's share of it, mm.
    expected: f64,
    camera_part: f64,
    /// Sigma of the plane's tilt, rad.
    tilt: f64,
    /// Largest angle between two boards' normals, degrees.
    spread: f64,
}

/// Judges a fit.
pub fn judge(fit: &LaserPlaneFit, views: &[StripeView], camera: &Intrinsics, limits: &Limits) -> Quality {
    let work = &limits.working;
    let places = places_in_view(&fit.plane, camera, work);
    let expected = expected_error(&fit.covariance, &places);
    let exact = expected_error(&fit.covariance_camera_exact, &places);
    let evidence = Evidence {
        fit,
        used: fit.views.iter().filter(|v| v.used).collect(),
        work,
        expected,
        camera_part: (expected * expected - exact * exact).max(0.0).sqrt(),
        tilt: (0..3).map(|i| fit.covariance[(i, i)].max(0.0)).sum::<f64>().sqrt(),
        spread: fit.board_spread.to_degrees(),
    };
    let mut j = limits.by_error(
        expected,
        format!(
            "the plane is known to {expected:.4} mm (1 sigma) at {work}, its tilt to {:.4} degrees",
            evidence.tilt.to_degrees()
        ),
    );
    j.at_best(Verdict::BadlyDetermined, places.is_empty(), || format!("the camera does not see the sheet at {work}"));
    j.ended(fit.end);
    contradictions(fit, views, &mut j);
    evidence.determined(camera.view_mm(limits.middle()), &mut j);
    evidence.advise(&mut j);
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures: evidence.figures(),
        per_picture: fit.views.iter().map(|v| (v.name.clone(), v.px)).collect(),
    }
}

impl Evidence<'_> {
    /// Checks that tilts, stripes and pictures suffice and cover the working depths. `view_mm`: width of the camera's
    /// view there, mm.
    fn determined(&self, view_mm: f64, j: &mut Judgement) {
        let Evidence { fit, work, spread, .. } = *self;
        let used = self.used.len();
        j.at_best(Verdict::BadlyDetermined, spread < 5.0, || {
            format!(
                "all boards are parallel within {spread:.1} degrees, 5 are needed: a common error would stay \
                 undetected"
            )
        });
        j.at_best(Verdict::Usable, (5.0..15.0).contains(&spread), || {
            format!("the boards' tilts spread over {spread:.1} degrees, 15 are needed to be good")
        });
        let least = LEAST_SPREAD * view_mm;
        j.at_best(Verdict::BadlyDetermined, fit.depth_spread < least, || {
            format!(
                "the stripes spread by {:.2} mm across their own direction, {least:.2} mm ({:.0} % of the view) are \
                 needed: they \
                 are nearly one line",
                fit.depth_spread,
                100.0 * LEAST_SPREAD
            )
        });
        j.at_best(Verdict::BadlyDetermined, used < 3, || "two pictures leave nothing to check".into());
        j.at_best(Verdict::Usable, (3..ENOUGH).contains(&used), || {
            format!("{used} pictures, {ENOUGH} are needed to be good")
        });
        let [low, high] = fit.reach;
        let quarter = 0.25 * (work.far_mm - work.near_mm);
        j.at_best(Verdict::Usable, low > work.near_mm + quarter || high < work.far_mm - quarter, || {
            format!("the boards were lit at {} to {} mm, the work is at {work}", work.depth(low), work.depth(high))
        });
    }

    /// Reasons for the error, and the next best picture.
    fn advise(&self, j: &mut Judgement) {
        let Evidence { work, camera_part, .. } = *self;
        if camera_part > 0.0 {
            j.reasons.push(format!("the camera's own uncertainty makes {camera_part:.4} mm of the error"));
        }
        j.advise(self.spread < 15.0, || "tilt the board by 20 degrees or more, once to each side".into());
        let ([low, high], (near, far)) = (self.fit.reach, (work.near_mm, work.far_mm));
        let edge = 0.15 * (far - near);
        j.advise(low > near + edge, || {
            format!("show a board nearer, at {} to {} mm", work.depth(near), work.depth(near + edge))
        });
        j.advise(high < far - edge, || {
            format!("show a board farther away, at {} to {} mm", work.depth(far - edge), work.depth(far))
        });
        j.advise(j.verdict != Verdict::Good && camera_part > 0.7 * self.expected, || {
            "calibrate the camera with more pictures first: most of the error comes from it".into()
        });
    }

    fn figures(&self) -> BTreeMap<String, f64> {
        let (fit, used) = (self.fit, &self.used);
        let count = |u: PeakUse| fit.uses.iter().flatten().filter(|x| **x == u).count() as f64;
        BTreeMap::from([
            ("expected_error_at_working_distance_mm".to_string(), self.expected),
            ("expected_error_from_camera_mm".into(), self.camera_part),
            ("working_near_mm".into(), self.work.near_mm),
            ("working_far_mm".into(), self.work.far_mm),
            ("tilt_sigma_deg".into(), self.tilt.to_degrees()),
            ("offset_sigma_mm".into(), fit.covariance[(3, 3)].max(0.0).sqrt()),
            ("rms_px".into(), rms(used.iter().map(|v| v.px))),
            ("rms_mm".into(), rms(used.iter().map(|v| v.mm))),
            ("holdout_rms_px".into(), rms(used.iter().map(|v| v.holdout_px))),
            ("holdout_rms_mm".into(), rms(used.iter().map(|v| v.holdout_mm))),
            ("board_spread_deg".into(), self.spread),
            ("stripe_spread_mm".into(), fit.depth_spread),
            ("nearest_board_mm".into(), fit.reach[0]),
            ("farthest_board_mm".into(), fit.reach[1]),
            ("peaks_used".into(), count(PeakUse::Used)),
            ("peaks_off_board".into(), count(PeakUse::OffBoard)),
            ("peaks_at_print_edges".into(), count(PeakUse::AtEdge)),
            ("peaks_disagreeing".into(), count(PeakUse::Disagrees)),
            ("residual_over_sigma".into(), fit.sigma_ratio),
            ("neighbour_factor".into(), fit.neighbour_factor),
            ("scatter_over_sigma".into(), fit.scatter),
            ("variance_factor".into(), fit.inflation),
            ("pictures_contradicting".into(), fit.views.iter().filter(|v| v.contradicts).count() as f64),
        ])
    }
}

/// The pictures that contradict the others, and the number that they contradict.
fn contradictions(fit: &LaserPlaneFit, views: &[StripeView], j: &mut Judgement) {
    for v in fit.views.iter().filter(|v| !v.used) {
        j.at_best(Verdict::Usable, true, || {
            let why = if v.contradicts { "a board that moved, a reflection, another rig" } else { "too little light" };
            format!("{} was excluded: {:.3} px from the plane of the others ({why})", v.name, v.px)
        });
    }
    let against = fit.views.iter().filter(|v| v.contradicts).count();
    overrule(fit.views.iter().filter(|v| v.used).count(), against, j);
    if let Some(s) = &fit.second {
        j.at_best(Verdict::BadlyDetermined, true, || {
            format!(
                "{} pictures show light on a second plane, {:.3} mm from this one, and it is not known which is the \
                 sheet: {}",
                s.views.len(),
                s.mm,
                s.views.join(", ")
            )
        });
    }
    for v in fit.views.iter().filter(|v| v.used && v.board_misfit > MISFIT) {
        j.at_best(Verdict::Usable, true, || {
            format!(
                "{}: its features fit the board {:.1} times worse than those of the others (another camera, or \
                 blurred)",
                v.name, v.board_misfit
            )
        });
    }
    // The plane's stripe must lie within the light of pictures that it was not fitted to.
    let mut widths: Vec<f64> = views.iter().flat_map(|v| v.peaks.iter().map(|p| p.width_px)).collect();
    widths.sort_by(f64::total_cmp);
    let width = widths.get(widths.len() / 2).copied().unwrap_or(0.0);
    let off = rms(fit.views.iter().filter(|v| v.used).map(|v| v.holdout_px));
    j.at_best(Verdict::BadlyDetermined, off > width, || {
        format!(
            "the stripe predicted from the other pictures is {off:.2} px (rms) off the seen stripe, which is \
             {width:.2} px wide (sigma)"
        )
    });
    j.at_best(Verdict::Usable, fit.scatter > SCATTER, || {
        format!(
            "the pictures scatter {:.1} times more than their pixels explain, {SCATTER} times are allowed for good; \
             the stated \
             error contains it",
            fit.scatter
        )
    });
    let gate = LaserPlaneOptions::default().gate_surprise;
    for v in fit.views.iter().filter(|v| v.used && v.beside > gate) {
        j.at_best(Verdict::BadlyDetermined, true, || {
            format!(
                "{}: its stripe lies {:.1} sigmas from where the others predict it, {:.0} are allowed; too few \
                 pictures remain to exclude it",
                v.name,
                v.beside.sqrt(),
                gate.sqrt()
            )
        });
    }
}

/// The report page.
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
            let fate = if v.used { "used" } else { "excluded" };
            vec![
                v.name.clone(),
                format!("{} of {}", v.peaks_used, v.peaks),
                format!("{:.4}", v.px),
                format!("{:.4}", v.mm),
                format!("{:.1}", v.surprise.sqrt()),
                fate.into(),
            ]
        })
        .collect();
    page.table("Fit", &["picture", "peaks", "px", "mm", "sigmas from the others' prediction", ""], &fits);
    page.figure(
        "Residual of each picture in the fit, px",
        &bars(&fit.views.iter().map(|v| (v.name.clone(), v.px)).collect::<Vec<_>>(), "px", None),
    );
    page.paragraph("Verification: each picture in turn was excluded from the fit and then predicted.");
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
