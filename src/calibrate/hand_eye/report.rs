//! In: a hand-eye fit and its pairs. Out: the verdict with reasons, figures and the next best pose, and the report
//! page; fit and verification are separate.
//! Frame and unit: near = what carries the camera; mm, degrees, px.

use super::camera_belief::ray_error_px;
use super::checks::belongs_to;
use super::closed::{Pair, axis_spread};
use super::expected::{ExpectedError, expected_error};
use super::fit::HandEyeFit;
use crate::calibrate::limits::{Judgement, Limits, rms};
use crate::calibrate::report::{Page, axis_sphere, bars};
use crate::camera::PARAMETERS;
use crate::geometry::{Vec3, log};
use crate::rig::{Covariance, Quality, Verdict};
use std::collections::BTreeMap;

/// Names of the hand-eye covariance's parameters ([`crate::rig::HandEye`]).
pub const HAND_EYE_NAMES: [&str; 6] = ["tx_mm", "ty_mm", "tz_mm", "rx_rad", "ry_rad", "rz_rad"];

/// The covariance as the calibration file stores it.
pub fn covariance(fit: &HandEyeFit) -> Covariance {
    Covariance::new(&HAND_EYE_NAMES, &fit.covariance.view((0, 0), (6, 6)).into_owned())
}

/// Rotation about a second axis, degrees rms, from which a set of poses is usable and good.
const SECOND_AXIS_DEG: [f64; 2] = [8.0, 12.0];

/// What a verdict rests on.
struct Evidence<'a> {
    fit: &'a HandEyeFit,
    pairs: &'a [Pair],
    used: Vec<&'a Pair>,
    /// The axes about which the poses rotate, and the rotation about each, degrees rms.
    spread: [(Vec3, f64); 3],
    error: ExpectedError,
    camera: SolvedCamera,
    /// See [`in_pixels`].
    pixels: bool,
}

/// Judges a fit.
pub fn judge(fit: &HandEyeFit, pairs: &[Pair], limits: &Limits) -> Quality {
    let used: Vec<&Pair> = pairs.iter().zip(&fit.pairs).filter(|(_, r)| r.used).map(|(p, _)| p).collect();
    let evidence = Evidence {
        fit,
        pairs,
        spread: axis_spread(&used).map(|(axis, rad)| (axis, rad.to_degrees())),
        used,
        error: expected_error(fit, limits.middle()),
        camera: SolvedCamera::of(fit),
        pixels: in_pixels(pairs),
    };
    let mut j = limits.by_error(
        evidence.error.whole,
        format!(
            "a point at {} mm is placed in the flange frame to {:.3} mm (1 sigma); depths: {}",
            limits.working.depth(limits.middle()),
            evidence.error.whole,
            limits.working.from
        ),
    );
    evidence.determined(&mut j);
    evidence.left_out(&mut j);
    evidence.scatter(&mut j);
    evidence.camera.judge(&mut j);
    evidence.advise(&mut j);
    Quality {
        verdict: j.verdict,
        reasons: j.reasons,
        advice: j.advice,
        figures: evidence.figures(limits.middle()),
        per_picture: fit.pairs.iter().map(|p| (p.name.clone(), if evidence.pixels { p.px } else { p.mm })).collect(),
    }
}

impl Evidence<'_> {
    /// Checks that the poses rotate about two axes and are numerous enough.
    fn determined(&self, j: &mut Judgement) {
        let (second, used) = (self.spread[1].1, self.used.len());
        let [usable, good] = SECOND_AXIS_DEG;
        j.at_best(Verdict::BadlyDetermined, second < usable, || {
            format!("rotation about a second axis is {second:.1} degrees rms, {usable} are needed to be usable")
        });
        j.at_best(Verdict::Usable, (usable..good).contains(&second), || {
            format!("rotation about a second axis is {second:.1} degrees rms, {good} are needed to be good")
        });
        j.at_best(Verdict::Usable, used < 8, || format!("{used} pairs are in the fit, 8 are needed to be good"));
        j.at_best(Verdict::BadlyDetermined, used < 5, || "fewer than 5 pairs leave nothing to check".into());
        j.ended(self.fit.end);
    }

    fn left_out(&self, j: &mut Judgement) {
        for (i, r) in self.fit.pairs.iter().enumerate().filter(|(_, r)| !r.used) {
            let whose = belongs_to(self.pairs, self.fit, i);
            let whose = whose.map_or(String::new(), |n| format!("; its picture fits the pose of {n}"));
            j.at_best(Verdict::Usable, true, || {
                format!("{} was excluded: its pose and picture disagree by {:.2} mm{whose}", r.name, r.mm)
            });
        }
        j.reasons.extend(self.fit.left_out_fit.clone());
    }

    /// Contributions of the robot's poses, the camera and the boards' poses to the error.
    fn scatter(&self, j: &mut Judgement) {
        let (among, camera) = if self.pixels {
            ("", format!("; the camera's own uncertainty makes {:.3} mm of the error", self.error.from_camera))
        } else {
            (", with what the boards' places scatter beyond what is stated,", String::new())
        };
        j.reasons.push(format!(
            "the robot's poses{among} scatter by {:.3} mm and {:.4} degrees per axis{camera}",
            self.fit.noise.robot_mm,
            self.fit.noise.robot_rad.to_degrees()
        ));
        if self.pixels {
            let boards = rms(self.used.iter().map(|p| p.seen.rms_px));
            j.reasons.push(format!("each board fits its own picture to {boards:.3} px rms, whatever the robot says"));
        }
    }

    /// Advises on the next best pose or picture.
    fn advise(&self, j: &mut Judgement) {
        let ExpectedError { whole, from_camera, .. } = self.error;
        let good = SECOND_AXIS_DEG[1];
        // The third axis is requested only if the rotation about the second one suffices.
        let (axis, weak) = if self.spread[1].1 < good { self.spread[1] } else { self.spread[2] };
        j.advise(weak < good, || {
            format!(
                "turn the flange by 20 degrees or more, both ways, about its axis ({:.2}, {:.2}, {:.2}): the poses \
                 turn by only {weak:.1} degrees rms about it",
                axis.x, axis.y, axis.z
            )
        });
        j.advise(j.verdict != Verdict::Good && weak >= good && from_camera < 0.7 * whole, || {
            format!(
                "take {} more pictures spread over the same tilts: the error falls with the root of their number",
                self.used.len()
            )
        });
        j.advise(from_camera >= 0.7 * whole && j.verdict != Verdict::Good, || {
            "calibrate the camera with more pictures first: most of the error comes from it".into()
        });
    }

    fn figures(&self, working_mm: f64) -> BTreeMap<String, f64> {
        let (fit, error) = (self.fit, &self.error);
        let [first, second, third] = self.spread.map(|s| s.1);
        let variance = |i: usize| fit.covariance[(i, i)].max(0.0).sqrt().powi(2);
        let used = || fit.pairs.iter().filter(|p| p.used);
        let t = fit.chain.far_from_board.translation;
        let mut figures = BTreeMap::from([
            ("expected_error_at_working_distance_mm".to_string(), error.whole),
            ("expected_error_from_camera_mm".into(), error.from_camera),
            ("expected_error_with_joint_camera_mm".into(), error.with_joint_camera),
            ("working_distance_mm".into(), working_mm),
            ("rms_mm".into(), rms(used().map(|p| p.mm))),
            ("holdout_rms_mm".into(), rms(used().map(|p| p.holdout_mm))),
            (crate::rig::ROBOT_SIGMA_MM.into(), fit.noise.robot_mm),
            (crate::rig::ROBOT_SIGMA_DEG.into(), fit.noise.robot_rad.to_degrees()),
            ("translation_sigma_mm".into(), (0..3).map(variance).sum::<f64>().sqrt()),
            ("rotation_sigma_deg".into(), (3..6).map(variance).sum::<f64>().sqrt().to_degrees()),
            ("first_axis_rms_deg".into(), first),
            ("second_axis_rms_deg".into(), second),
            ("third_axis_rms_deg".into(), third),
            ("pairs".into(), self.pairs.len() as f64),
            ("pairs_used".into(), self.used.len() as f64),
            ("chi2_per_freedom".into(), fit.chi2),
            ("board_x_mm".into(), t.x),
            ("board_y_mm".into(), t.y),
            ("board_z_mm".into(), t.z),
        ]);
        if self.pixels {
            figures.insert("rms_px".into(), rms(used().map(|p| p.px)));
            figures.insert("holdout_rms_px".into(), rms(used().map(|p| p.holdout_px)));
            figures.insert("board_rms_px".into(), rms(self.used.iter().map(|p| p.seen.rms_px)));
        }
        figures.extend(self.camera.figures());
        figures
    }
}

/// Change of the camera's parameters, which are fitted too, with their calibration as the prior.
struct SolvedCamera {
    /// Change of its viewing rays, and their uncertainty before and after, px.
    moved: f64,
    before: f64,
    after: f64,
    /// Squared distance of the solved parameters from the calibrated ones, and its expected value.
    surprise: f64,
    freedom: f64,
}

impl SolvedCamera {
    fn of(fit: &HandEyeFit) -> SolvedCamera {
        let change = fit.joint_camera.parameters() - fit.camera.parameters();
        let joint = fit.joint_covariance.fixed_view::<PARAMETERS, PARAMETERS>(12, 12).into();
        let (surprise, freedom) = fit.camera_surprise;
        SolvedCamera {
            moved: ray_error_px(&fit.camera, &(change * change.transpose())),
            before: ray_error_px(&fit.camera, &fit.given.covariance()),
            after: ray_error_px(&fit.camera, &joint),
            surprise,
            freedom,
        }
    }

    /// True if the calibrated camera was not taken as exact.
    fn is_free(&self) -> bool {
        self.before > 0.0
    }

    /// Whether the pictures contradict the calibrated camera: one good set in several thousand does by chance
    /// \[wilson31\]. The cube root of a chi-square variable over its degrees of freedom is nearly normal.
    fn is_another(&self) -> bool {
        let SolvedCamera { surprise, freedom, .. } = *self;
        freedom > 0.0
            && ((surprise / freedom).cbrt() - 1.0 + 2.0 / (9.0 * freedom)) / (2.0 / (9.0 * freedom)).sqrt() > 3.7
    }

    fn judge(&self, j: &mut Judgement) {
        let SolvedCamera { moved, before, after, surprise, freedom } = *self;
        if self.is_free() {
            j.reasons.push(
                "the camera was estimated together with the hand-eye, with its calibration as prior; the station's \
                 camera calibration is unchanged"
                    .into(),
            );
            j.reasons.push(format!(
                "the camera's viewing rays moved by {moved:.3} px; their uncertainty was {before:.3} px and is now \
                 {after:.3} px"
            ));
        }
        j.at_best(Verdict::Usable, self.is_another(), || {
            format!(
                "the camera is not the one that was calibrated: the boards in these pictures want another, squared \
                 distance {surprise:.0}, \
                 {freedom:.0} expected; focus, zoom or the board's description changed"
            )
        });
        j.advise(self.is_another(), || {
            "calibrate the camera again with its present focus, and compare the boards' descriptions".into()
        });
    }

    /// Figures of the camera; empty if it was taken as exact.
    fn figures(&self) -> impl Iterator<Item = (String, f64)> {
        let all = [
            ("camera_change_px", self.moved),
            ("camera_known_before_px", self.before),
            ("camera_known_after_px", self.after),
            ("camera_surprise", self.surprise),
            ("camera_surprise_expected", self.freedom),
        ];
        let free = self.is_free();
        all.into_iter().filter(move |_| free).map(|(name, value)| (name.to_string(), value))
    }
}

/// True if the boards were seen in pictures; false if their poses were given, so that nothing is known in px.
fn in_pixels(pairs: &[Pair]) -> bool {
    pairs.iter().all(|p| p.seen.rms_px.is_finite())
}

/// The report page: the result, its fit, and its prediction of excluded pictures.
pub fn page(fit: &HandEyeFit, pairs: &[Pair], quality: &Quality, carrier: &str) -> Page {
    let mut page = Page::new("Hand-eye calibration");
    page.verdict(quality);
    page.table(&format!("The camera on the {carrier}"), &["", "value", "sigma"], &chain_rows(fit, carrier));
    let figures: Vec<Vec<String>> = quality.figures.iter().map(|(k, v)| vec![k.clone(), format!("{v:.5}")]).collect();
    page.table("Figures", &["figure (unit in the name)", "value"], &figures);
    let pixels = in_pixels(pairs);
    let fits: Vec<Vec<String>> = fit
        .pairs
        .iter()
        .zip(pairs)
        .map(|(p, pair)| {
            let fate = if p.used { "used" } else { "excluded" };
            let in_px = |px: f64| if pixels { format!("{px:.3}") } else { "-".into() };
            vec![
                p.name.clone(),
                in_px(pair.seen.rms_px),
                in_px(p.px),
                format!("{:.4}", p.mm),
                format!("{:.1}", p.distance2),
                fate.into(),
            ]
        })
        .collect();
    page.paragraph(
        "Fit: how the pictures agree with the chain that was fitted to them. A small residual does not \
                    prove a small error. The board's own px: how its corners fit a flat board in that picture, the \
                    robot aside.",
    );
    page.table("Fit", &["picture", "the board's own px", "px", "mm", "distance² (6 expected)", ""], &fits);
    let bar = |f: &dyn Fn(&crate::calibrate::hand_eye::fit::PairResidual) -> f64| -> Vec<(String, f64)> {
        fit.pairs.iter().map(|p| (p.name.clone(), f(p))).filter(|(_, v)| v.is_finite()).collect()
    };
    page.figure("Residual of each pose in the fit, mm at the board's corners", &bars(&bar(&|p| p.mm), "mm", None));
    page.paragraph(
        "Verification: each pose in turn was excluded from the fit and then predicted. This is the error \
                    to expect, the robot's own scatter included.",
    );
    page.figure(
        "Error of each pose predicted by the others, mm at the board's corners",
        &bars(&bar(&|p| p.holdout_mm), "mm", None),
    );
    page.figure(
        &format!(
            "Axes that the {carrier} turned about from each pose to the next ({carrier} frame): a good set \
                  fills the disc"
        ),
        &axis_sphere(&turn_axes(fit, pairs)),
    );
    page
}

/// The camera's position and orientation with their sigmas.
fn chain_rows(fit: &HandEyeFit, carrier: &str) -> Vec<Vec<String>> {
    let x = &fit.chain.near_from_camera;
    let [rz, ry, rx] = crate::robot::zyx_of(&x.rotation);
    let sigma = |i: usize| fit.covariance[(i, i)].max(0.0).sqrt();
    let row = |what: &str, value: String, s: String| vec![what.to_string(), value, s];
    let mut rows: Vec<Vec<String>> = (0..3)
        .map(|i| {
            row(
                &format!("{} of the camera", ["x", "y", "z"][i]),
                format!("{:.4} mm", x.translation[i]),
                format!("{:.4} mm", sigma(i)),
            )
        })
        .collect();
    for (i, (name, value)) in [("RX", rx), ("RY", ry), ("RZ", rz)].into_iter().enumerate() {
        rows.push(row(
            &format!("{name} (R = Rz·Ry·Rx)"),
            format!("{value:.4}°"),
            format!("{:.4}° about the {carrier}'s {}", sigma(3 + i).to_degrees(), ["x", "y", "z"][i]),
        ));
    }
    rows
}

/// Axes of the rotations from each used pose to the next.
fn turn_axes(fit: &HandEyeFit, pairs: &[Pair]) -> Vec<(Vec3, String)> {
    let mut axes = Vec::new();
    let used: Vec<(usize, &Pair)> = pairs.iter().enumerate().filter(|(i, _)| fit.pairs[*i].used).collect();
    for w in used.windows(2) {
        let turn = log(&(w[1].1.near_from_far * w[0].1.near_from_far.inverse()).rotation);
        if turn.norm() > 0.02 {
            axes.push((turn.normalize(), w[1].0.to_string()));
        }
    }
    axes
}
