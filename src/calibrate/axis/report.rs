//! In: the fit of an axis. Out: the verdict with reasons, figures and the next best picture, and the report page; fit
//! and verification are separate.
//! Frame and unit: camera frame; mm, degrees.

use super::fit::{AxisFit, StopResidual};
use crate::calibrate::limits::{Judgement, Limits, rms};
use crate::calibrate::report::{Page, bars, scatter};
use crate::calibrate::scatter::{ENOUGH, overrule};
use crate::geometry::AxisKind;
use crate::rig::{AXIS_SIGMA_DEG, AXIS_SIGMA_MM, Covariance, Kind, Quality, Verdict};
use std::collections::BTreeMap;

/// Relative difference between the lengths of board and axis up to which neither counts as wrong.
const SCALE_TOLERANCE: f64 = 0.01;
/// Largest spread of the stops, as a share of the smallest spread of random permutations, at which the counts count
/// as right.
const BY_CHANCE: f64 = 0.45;
/// Reversed counts within this many times the spread cannot be distinguished from the stated ones.
const TOLD: f64 = 3.0;
/// A table turned by less than this, rad, does not show its bearing all round.
const HALF_TURN: f64 = std::f64::consts::PI;
/// A bow is significant beyond this many of its sigmas.
const BENT: f64 = 4.0;

/// The kind of calibration that this fit belongs to.
pub fn kind(fit: &AxisFit) -> Kind {
    match fit.axis.kind {
        AxisKind::Linear => Kind::LinearAxis,
        AxisKind::Turntable => Kind::Turntable,
    }
}

/// The covariance under the parameter names of the axis' file; includes the camera's uncertainty.
pub fn covariance(fit: &AxisFit) -> Covariance {
    Covariance::new(kind(fit).parameters().0, &fit.covariance)
}

/// What a verdict rests on.
struct Evidence<'a> {
    fit: &'a AxisFit,
    used: Vec<&'a StopResidual>,
    /// Total expected error, its part by direction and pitch, and the camera's share of that part, mm.
    expected: f64,
    own: f64,
    camera_part: f64,
    /// Least and greatest count, and the travel between them, mm or rad.
    counts: [f64; 2],
    way: f64,
}

/// Judges a fit. `board_length` names the source of the board's lengths.
pub fn judge(fit: &AxisFit, limits: &Limits, board_length: &str) -> Quality {
    let evidence = Evidence::of(fit);
    let Evidence { expected, own, way, .. } = evidence;
    let over = match fit.axis.kind {
        AxisKind::Linear => format!("{way:.2} mm of way"),
        AxisKind::Turntable => "a whole turn".into(),
    };
    let mut j = limits.by_error(
        expected,
        format!(
            "a point on the axis is placed to {expected:.4} mm (1 sigma) over {over}; direction and pitch cause \
             {own:.4} mm of it, scatter from stop to stop and bow the rest"
        ),
    );
    contradictions(fit, &mut j);
    order(fit, &mut j);
    evidence.scatter(&mut j);
    j.ended(fit.end);
    bow(fit, limits.tolerance_mm, &mut j);
    pitch(fit, board_length, &mut j);
    evidence.advise(&mut j);
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures: evidence.figures(),
        per_picture: fit.stops.iter().map(|s| (s.name.clone(), s.mm)).collect(),
    }
}

impl Evidence<'_> {
    fn of(fit: &AxisFit) -> Evidence<'_> {
        let [own, expected] = fit.expected_error(&fit.covariance);
        let exact = fit.expected_error(&fit.covariance_camera_exact)[0];
        let (low, high) =
            fit.counts.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), c| (a.min(*c), b.max(*c)));
        Evidence {
            fit,
            used: fit.stops.iter().filter(|s| s.used).collect(),
            expected,
            own,
            camera_part: (own * own - exact * exact).max(0.0).sqrt(),
            counts: [low, high],
            way: fit.axis.pitch.abs() * (high - low),
        }
    }

    /// Checks that there are enough stops, and their scatter.
    fn scatter(&self, j: &mut Judgement) {
        let (fit, used) = (self.fit, self.used.len());
        j.at_best(Verdict::BadlyDetermined, used < 4, || format!("{used} stops leave nothing to check"));
        j.at_best(Verdict::Usable, (4..ENOUGH).contains(&used), || {
            format!("{used} stops, {ENOUGH} are needed to be good")
        });
        if fit.sigma_mm > 0.0 || fit.sigma_rad > 0.0 {
            j.reasons.push(format!(
                "the axis (or its encoder) scatters by {:.4} mm and {:.4} degrees from stop to stop beyond what \
                 pixels explain; every \
                 point's sigma contains it",
                fit.sigma_mm,
                fit.sigma_rad.to_degrees()
            ));
        }
    }

    /// Reasons for the error, and the next best picture.
    fn advise(&self, j: &mut Judgement) {
        let Evidence { camera_part, way, .. } = *self;
        if camera_part > 0.0 {
            j.reasons.push(format!("the camera's own uncertainty makes {camera_part:.4} mm of the error"));
        }
        j.advise(self.used.len() < 8, || "show the board at eight or more stops".into());
        let partly = self.fit.axis.kind == AxisKind::Turntable && way < HALF_TURN;
        let seen = format!("{:.1} degrees", way.to_degrees());
        j.at_best(Verdict::Usable, partly, || {
            format!("the board was seen over {seen} of the turn: farther round the table is taken to run true")
        });
        j.advise(partly, || format!("turn the board by more than {seen}: put it closer to the axis, or tilt it less"));
        j.advise(j.verdict != Verdict::Good && camera_part > 0.7 * self.own, || {
            "calibrate the camera with more pictures first: most of the error comes from it".into()
        });
    }

    fn figures(&self) -> BTreeMap<String, f64> {
        let (fit, used) = (self.fit, &self.used);
        let variance = |i: usize| fit.covariance[(i, i)].max(0.0);
        let way = if fit.axis.kind == AxisKind::Linear { self.way } else { self.way.to_degrees() };
        BTreeMap::from([
            ("expected_error_at_working_distance_mm".to_string(), self.expected),
            ("expected_error_of_direction_and_pitch_mm".into(), self.own),
            ("expected_error_from_camera_mm".into(), self.camera_part),
            (AXIS_SIGMA_MM.into(), fit.sigma_mm),
            (AXIS_SIGMA_DEG.into(), fit.sigma_rad.to_degrees()),
            ("way_mm_or_deg".into(), way),
            ("least_count".into(), self.counts[0]),
            ("greatest_count".into(), self.counts[1]),
            ("pitch_sigma_mm_or_rad".into(), variance(3).sqrt()),
            ("direction_sigma_deg".into(), (0..3).map(variance).sum::<f64>().sqrt().to_degrees()),
            ("bow_mm".into(), fit.bend_mm[0]),
            ("rms_mm".into(), rms(used.iter().map(|s| s.mm))),
            ("holdout_rms_mm".into(), rms(used.iter().map(|s| s.holdout_mm))),
            ("scatter_over_sigma".into(), fit.chi2.sqrt()),
            ("variance_factor".into(), fit.inflation),
            ("pictures_contradicting".into(), (fit.stops.len() - used.len()) as f64),
        ])
    }
}

/// Checks that the travel is straight, or that the table runs true.
fn bow(fit: &AxisFit, tolerance_mm: f64, j: &mut Judgement) {
    let [bow, sigma] = fit.bend_mm;
    let bent = bow > BENT * sigma && bow > 0.25 * tolerance_mm;
    let linear = fit.axis.kind == AxisKind::Linear;
    j.at_best(Verdict::Usable, bent && linear, || {
        format!(
            "the way is bent: {bow:.4} mm from its ends to its middle, {sigma:.4} mm is chance; it is used as straight"
        )
    });
    // The table's error at angles where the board was not seen is unknown.
    j.at_best(Verdict::BadlyDetermined, bent && !linear, || {
        format!(
            "the table does not run true: over the turn seen, the board's place bows by {bow:.4} mm, {sigma:.4} mm \
             is chance"
        )
    });
}

/// Checks that the board's lengths agree with the unit of the axis' counts.
fn pitch(fit: &AxisFit, board_length: &str, j: &mut Judgement) {
    let Some(stated) = fit.axis.unit.stated() else { return };
    let unit = fit.axis.unit.name();
    let ratio = fit.axis.pitch.abs() / stated;
    let sigma = fit.covariance[(3, 3)].max(0.0).sqrt() / stated;
    j.at_best(Verdict::BadlyDetermined, (ratio - 1.0).abs() > (4.0 * sigma).max(SCALE_TOLERANCE), || {
        format!(
            "the board shows {ratio:.4} {unit} for one {unit} of the axis: the axis states another unit, or \
             {board_length} is wrong"
        )
    });
}

/// The stops that contradict the others, and the number that they contradict.
fn contradictions(fit: &AxisFit, j: &mut Judgement) {
    for s in fit.stops.iter().filter(|s| !s.used) {
        j.at_best(Verdict::Usable, true, || {
            format!(
                "{} at count {} was excluded: the board lies {:.3} mm from where the others predict it (it slipped, \
                 or the count is \
                 another picture's)",
                s.name, s.count, s.holdout_mm
            )
        });
    }
    let used = fit.stops.iter().filter(|s| s.used).count();
    overrule(used, fit.stops.len() - used, j);
}

/// Checks that the counts belong to the pictures.
fn order(fit: &AxisFit, j: &mut Judgement) {
    let o = &fit.order;
    j.at_best(Verdict::BadlyDetermined, o.spread_mm > BY_CHANCE * o.dealt_mm, || {
        format!(
            "counts and pictures do not belong together: the stops spread by {:.3} mm about their motion, with \
             counts dealt out at \
             random by {:.3} mm",
            o.spread_mm, o.dealt_mm
        )
    });
    let turned = o.reversed_mm < 0.5 * o.spread_mm;
    j.at_best(Verdict::BadlyDetermined, turned, || {
        format!(
            "the counts fit the pictures in the reverse order: the stops then spread by {:.3} mm, not by {:.3} mm",
            o.reversed_mm, o.spread_mm
        )
    });
    let untold = !turned && o.reversed_mm < TOLD * o.spread_mm;
    j.at_best(Verdict::Usable, untold, || {
        "reversed counts would fit similarly well, because the stops are evenly spaced; the direction is taken from \
         the recording"
            .into()
    });
    j.advise(untold, || {
        "add a stop at an uneven distance from the others: it shows the direction of the counts".into()
    });
}

/// The report page.
pub fn page(fit: &AxisFit, quality: &Quality) -> Page {
    let mut page = Page::new(&format!("Axis calibration: {}", fit.axis.kind.words()));
    page.verdict(quality);
    let (d, p, s) = (fit.axis.direction(), fit.axis.origin(), |i: usize| fit.covariance[(i, i)].max(0.0).sqrt());
    let mut rows: Vec<Vec<String>> = (0..3)
        .map(|i| vec![format!("direction {}", ["x", "y", "z"][i]), format!("{:.7}", d[i]), format!("{:.7}", s(i))])
        .collect();
    let of = if fit.axis.kind == AxisKind::Linear { "mm" } else { "rad" };
    let pitch = format!("pitch, {of} a {}", fit.axis.unit.name());
    rows.push(vec![pitch, format!("{:.9}", fit.axis.pitch), format!("{:.9}", s(3))]);
    if fit.axis.kind == AxisKind::Turntable {
        rows.extend((0..3).map(|i| {
            vec![format!("through {}", ["x", "y", "z"][i]), format!("{:.4} mm", p[i]), format!("{:.4} mm", s(4 + i))]
        }));
    }
    page.table("In the camera frame", &["", "value", "sigma"], &rows);
    let figures: Vec<Vec<String>> = quality.figures.iter().map(|(k, v)| vec![k.clone(), format!("{v:.5}")]).collect();
    page.table("Figures", &["figure (unit in the name)", "value"], &figures);
    page.paragraph(
        "Fit: distance of each board from where the axis puts it. Verification: the same by the axis of the others.",
    );
    let stops: Vec<Vec<String>> = fit
        .stops
        .iter()
        .map(|s| {
            vec![
                s.name.clone(),
                format!("{}", s.count),
                format!("{:.4}", s.mm),
                format!("{:.4}", s.holdout_mm),
                format!("{:.1}", s.surprise.sqrt()),
                if s.used { "used" } else { "excluded" }.into(),
            ]
        })
        .collect();
    page.table(
        "Stops",
        &["picture", "count", "mm", "mm by the others", "sigmas from the others' prediction", ""],
        &stops,
    );
    let held: Vec<(String, f64)> =
        fit.stops.iter().filter(|s| s.holdout_mm.is_finite()).map(|s| (s.name.clone(), s.holdout_mm)).collect();
    page.figure("Distance of each board from where the others predict it, mm", &bars(&held, "mm", None));
    for (i, name) in ["x", "y", "z"].iter().enumerate() {
        let points: Vec<(f64, f64)> = fit.stops.iter().filter(|s| s.used).map(|s| (s.count, s.off[i])).collect();
        let caption = format!(
            "What is left of the board's place along the camera's {name}, over the count: a bow is not a straight axis"
        );
        page.figure(&caption, &scatter(&points, "count", "mm"));
    }
    page
}
