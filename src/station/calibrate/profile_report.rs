//! In: a line-profile sensor's fit on a ball or a plate. Out: its quality with verdict, and its report page.
//! Frame and unit: flange_from_sensor; mm, rad, degrees.

use crate::calibrate::limits::{Limits, rms};
use crate::calibrate::profile_sensor::ball::options::Side;
use crate::calibrate::profile_sensor::ball::solve::BallFit;
use crate::calibrate::profile_sensor::found::{ProfileResidual, SensorFit};
use crate::calibrate::profile_sensor::plane::solve::PlaneFit;
use crate::calibrate::report::{Page, bars};
use crate::geometry::{Vec3, skew};
use crate::rig::{Quality, Verdict};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// A fit with what only its target can tell.
pub(super) struct Fitted {
    fit: SensorFit,
    words: Words,
}

/// What a target adds to the report.
struct Words {
    title: &'static str,
    /// Why the solution is the right one of several.
    reason: String,
    /// Why the profiles do not agree enough to be believed.
    contradiction: Option<String>,
    advice: String,
    figures: Vec<(&'static str, f64)>,
    fitted: &'static str,
    /// Headings of the points on the target, and of `values`.
    columns: [&'static str; 2],
    /// One number per profile, in words.
    values: Vec<String>,
}

/// Fit, quality and page.
pub(super) struct Told {
    pub fit: SensorFit,
    pub quality: Quality,
    pub page: Page,
}

pub(super) fn of_ball(found: BallFit) -> Fitted {
    let high = found.heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = found.heights.iter().copied().fold(f64::INFINITY, f64::min);
    let words = Words {
        title: "Line-profile sensor: hand-eye calibration on a ball",
        reason: format!(
            "the ball's centre lies on the {} side of the profile plane in most profiles; the other side fits worse by \
             {:.0}",
            if found.side == Side::Plus { "plus" } else { "minus" },
            found.side_margin
        ),
        contradiction: None,
        advice: format!(
            "take more profiles with the flange tilted by 20 degrees and more, the ball's centre {low:.0} to \
                 {high:.0} mm over the profile plane so far"
        ),
        figures: vec![("ball_x_mm", found.ball.x), ("ball_y_mm", found.ball.y), ("ball_z_mm", found.ball.z)],
        fitted: "Fit: the circle of each profile against the fitted ball.",
        columns: ["points on the ball", "ball over the plane, mm"],
        values: found.heights.iter().map(|h| format!("{h:+.2}")).collect(),
    };
    Fitted { fit: found.fit, words }
}

pub(super) fn of_plane(found: PlaneFit) -> Fitted {
    let (n, d) = (found.plane.normal, found.plane.offset);
    let steepest = found.tilts.iter().copied().filter(|t| t.is_finite()).fold(0.0, f64::max).to_degrees();
    let words = Words {
        title: "Line-profile sensor: hand-eye calibration on a plate",
        reason: if found.margin.is_finite() {
            format!("the next best pose of the sensor fits worse by {:.0}", found.margin)
        } else {
            "no other pose of the sensor fits".into()
        },
        contradiction: contradiction(&found.fit.profiles),
        advice: format!(
            "take more profiles, the plate tilted against the sensor by up to {steepest:.0} degrees so far{}",
            found.next
        ),
        figures: vec![
            ("plane_normal_x", n.x),
            ("plane_normal_y", n.y),
            ("plane_normal_z", n.z),
            ("plane_offset_mm", d),
            ("robot_sigma_deg", found.robot_turn.to_degrees()),
        ],
        fitted: "Fit: rms distance of each profile's line from the fitted plate.",
        columns: ["points on the line", "tilt of the plate, degrees"],
        values: found
            .tilts
            .iter()
            .map(|t| if t.is_finite() { format!("{:.1}", t.to_degrees()) } else { String::new() })
            .collect(),
    };
    Fitted { fit: found.fit, words }
}

/// With more than a third of the profiles against the others it is not known which are right.
fn contradiction(profiles: &[ProfileResidual]) -> Option<String> {
    let compared = || profiles.iter().filter(|p| p.why.is_none());
    let (all, against) = (compared().count(), compared().filter(|p| !p.used).count());
    (3 * against > all).then(|| {
        format!("{against} of {all} profiles contradict the others, up to a third may: it is not known who is right")
    })
}

impl Fitted {
    pub(super) fn judged(self, limits: &Limits) -> Told {
        let quality = judge(&self.fit, &self.words, limits);
        let page = page(&self.fit, &self.words, &quality);
        Told { fit: self.fit, quality, page }
    }
}

fn expected(fit: &SensorFit, distance: f64) -> f64 {
    let p = fit.flange_from_sensor.rotation * Vec3::new(0.0, 0.0, distance);
    let mut j = DMatrix::zeros(3, 6);
    j.view_mut((0, 0), (3, 3)).fill_with_identity();
    j.view_mut((0, 3), (3, 3)).copy_from(&-skew(&p));
    (&j * fit.covariance.view((0, 0), (6, 6)) * j.transpose()).trace().max(0.0).sqrt()
}

fn judge(fit: &SensorFit, words: &Words, limits: &Limits) -> Quality {
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
    j.reasons.push(words.reason.clone());
    if let Some(why) = &words.contradiction {
        j.at_best(Verdict::BadlyDetermined, true, || why.clone());
    }
    j.ended(fit.end);
    j.at_best(Verdict::Usable, used.len() < 12, || format!("{} profiles, 12 are needed to be good", used.len()));
    for p in fit.profiles.iter().filter(|p| !p.used) {
        j.at_best(Verdict::Usable, true, || excluded(p));
    }
    j.advise(j.verdict != Verdict::Good, || words.advice.clone());
    let mut figures = BTreeMap::from([
        ("expected_error_at_working_distance_mm".to_string(), expected),
        ("working_distance_mm".into(), limits.middle()),
        ("translation_sigma_mm".into(), (0..3).map(|i| fit.covariance[(i, i)]).sum::<f64>().max(0.0).sqrt()),
        ("rotation_sigma_deg".into(), (3..6).map(|i| fit.covariance[(i, i)]).sum::<f64>().max(0.0).sqrt().to_degrees()),
        ("rms_mm".into(), rms(used.iter().map(|p| p.mm))),
        ("holdout_rms_mm".into(), rms(used.iter().map(|p| p.holdout_mm))),
        ("point_sigma_mm".into(), fit.point_sigma),
        ("robot_sigma_mm".into(), fit.robot_sigma),
        ("profiles_used".into(), used.len() as f64),
        ("chi2_per_freedom".into(), fit.chi2),
    ]);
    figures.extend(words.figures.iter().map(|(name, v)| ((*name).to_string(), *v)));
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures,
        per_picture: fit.profiles.iter().filter(|p| p.mm.is_finite()).map(|p| (p.name.clone(), p.mm)).collect(),
    }
}

/// Why a profile was excluded.
fn excluded(p: &ProfileResidual) -> String {
    match &p.why {
        Some(why) => format!("{} was excluded: {why}", p.name),
        None => format!("{} was excluded: {:.2} mm from what the others predict", p.name, p.mm),
    }
}

fn page(fit: &SensorFit, words: &Words, quality: &Quality) -> Page {
    let mut page = Page::new(words.title);
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
        .zip(&words.values)
        .map(|(p, value)| {
            let fate = if p.used { "used" } else { "excluded" };
            vec![
                p.name.clone(),
                format!("{} of {}", p.points[0], p.points[1]),
                if p.mm.is_finite() { format!("{:.4}", p.mm) } else { String::new() },
                value.clone(),
                fate.into(),
            ]
        })
        .collect();
    page.paragraph(words.fitted);
    page.table("Fit", &["profile", words.columns[0], "mm", words.columns[1], ""], &fits);
    page.paragraph("Verification: each profile in turn was excluded from the fit and then predicted.");
    let held: Vec<(String, f64)> =
        fit.profiles.iter().filter(|p| p.holdout_mm.is_finite()).map(|p| (p.name.clone(), p.holdout_mm)).collect();
    page.figure("Error of each profile predicted by the others, mm", &bars(&held, "mm", None));
    page
}
