//! In: a joint solve. Out: the covariance of each of its records, their joint covariance, and the verdict.
//! Frame and unit: as in calibration files: mm, rad, px.

use super::limits::{Systematic, by_part};
use super::shots::Part;
use super::solve::JointFit;
use super::unknowns::Layout;
use super::volume::expected;
use crate::calibrate::hand_eye::report::HAND_EYE_NAMES;
use crate::calibrate::laser_plane::report::PLANE_NAMES;
use crate::calibrate::laser_plane::terms::basis as plane_basis;
use crate::calibrate::limits::{Judgement, Limits};
use crate::calibrate::pointer::beam::{BEAM_NAMES, basis as beam_basis};
use crate::camera::{ALWAYS_NAMED, CameraCovariance, NAMES, PARAMETERS};
use crate::geometry::{Camera, Plane};
use crate::rig::{Covariance, JointCovariance, Kind, Quality, Verdict};
use nalgebra::DMatrix;
use std::collections::BTreeMap;

/// Names of one record's parameters, and their derivatives by the shared unknowns.
struct Follows {
    kind: Kind,
    names: Vec<&'static str>,
    by: DMatrix<f64>,
}

fn camera(l: &Layout) -> Follows {
    let kept: Vec<usize> = (0..PARAMETERS).filter(|i| *i < ALWAYS_NAMED || l.camera.contains(i)).collect();
    let by = DMatrix::from_fn(kept.len(), l.shared(), |i, j| f64::from(u8::from(l.camera.get(j) == Some(&kept[i]))));
    Follows { kind: Kind::Camera, names: kept.iter().map(|&i| NAMES[i]).collect(), by }
}

fn part(kind: Kind, names: &[&'static str], l: &Layout, at: usize, basis: &DMatrix<f64>) -> Follows {
    let mut by = DMatrix::zeros(names.len(), l.shared());
    by.view_mut((0, at), basis.shape()).copy_from(basis);
    Follows { kind, names: names.to_vec(), by }
}

/// The records that the data determines; the hand-eye record has the kind `hand_eye`.
fn follows(fit: &JointFit, hand_eye: Kind) -> Vec<Follows> {
    let l = &fit.layout;
    let mut all = vec![camera(l)];
    if fit.has(Part::Stripe) {
        all.push(part(Kind::LaserPlane, &PLANE_NAMES, l, l.plane(), &plane_basis(&fit.state.plane)));
    }
    if fit.has(Part::Spot) {
        all.push(part(Kind::Pointer, &BEAM_NAMES, l, l.beam(), &beam_basis(&fit.state.beam)));
    }
    if fit.has(Part::RobotPlace) {
        all.push(part(hand_eye, &HAND_EYE_NAMES, l, l.hand_eye(), &DMatrix::identity(6, 6)));
    }
    all
}

/// The covariance of each record. The pointer's includes the camera's parameters, as in its file.
pub fn covariances(fit: &JointFit, hand_eye: Kind) -> BTreeMap<Kind, Covariance> {
    let all = follows(fit, hand_eye);
    let of = |f: &Follows| {
        let (names, by) = match f.kind {
            Kind::Pointer => {
                let camera = &all[0];
                let mut by = DMatrix::zeros(f.names.len() + camera.names.len(), fit.layout.shared());
                by.rows_mut(0, f.names.len()).copy_from(&f.by);
                by.rows_mut(f.names.len(), camera.names.len()).copy_from(&camera.by);
                ([f.names.clone(), camera.names.clone()].concat(), by)
            }
            _ => (f.names.clone(), f.by.clone()),
        };
        (f.kind, Covariance::new(&names, &symmetric(&by * &fit.covariance * by.transpose())))
    };
    all.iter().map(of).collect()
}

fn symmetric(m: DMatrix<f64>) -> DMatrix<f64> {
    (&m + m.transpose()) * 0.5
}

/// The joint covariance of all records; `of` states the contents of each.
pub fn together(fit: &JointFit, hand_eye: Kind, of: BTreeMap<Kind, String>) -> JointCovariance {
    let all = follows(fit, hand_eye);
    let rows: usize = all.iter().map(|f| f.names.len()).sum();
    let mut by = DMatrix::zeros(rows, fit.layout.shared());
    let (mut parameters, mut at) = (Vec::new(), 0);
    for f in &all {
        by.rows_mut(at, f.names.len()).copy_from(&f.by);
        at += f.names.len();
        parameters.extend(f.names.iter().map(|n| format!("{}.{n}", f.kind.name())));
    }
    let c = symmetric(&by * &fit.covariance * by.transpose());
    let matrix = c.row_iter().map(|r| r.iter().copied().collect()).collect();
    JointCovariance { format: 1, of, parameters, matrix }
}

/// The covariance of the shared unknowns as separate calibrations state it: block by block, without correlations
/// between the blocks.
pub fn separately(
    l: &Layout,
    camera: &CameraCovariance,
    hand_eye: Option<&DMatrix<f64>>,
    plane: Option<(&Plane<Camera>, &DMatrix<f64>)>,
) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(l.shared(), l.shared());
    for (i, &a) in l.camera.iter().enumerate() {
        for (j, &b) in l.camera.iter().enumerate() {
            out[(i, j)] = camera[(a, b)];
        }
    }
    if let Some(c) = hand_eye {
        out.view_mut((l.hand_eye(), l.hand_eye()), (6, 6)).copy_from(&c.view((0, 0), (6, 6)));
    }
    if let Some((plane, c)) = plane {
        // The columns of the basis are orthonormal.
        let basis = plane_basis(plane);
        out.view_mut((l.plane(), l.plane()), (3, 3)).copy_from(&(basis.transpose() * c * basis));
    }
    out
}

/// Smallest redundancy that determines a scatter: 6 give it to about 30 %.
const LEAST_NUMBERS: i64 = 6;

/// Additional information for the report besides the fit.
pub struct Beside {
    /// Expected error of a scanned point by separate calibrations of the same pictures, rms, mm; and distance of
    /// their points from the joint ones, rms, mm.
    pub separate: Option<[f64; 2]>,
    /// The test whether the arm's misfits follow its pose.
    pub systematic: Option<Systematic>,
    /// Smallest and largest depth of a laser-lit position on a board, mm.
    pub lit: [f64; 2],
    /// What was excluded before the solve.
    pub missing: Vec<(String, String)>,
}

/// Judges a solve by the error of a scanned point in the working volume; `weights` as in [`super::volume::weights`].
pub fn judge(fit: &JointFit, weights: &DMatrix<f64>, beside: &Beside, limits: &Limits) -> Quality {
    let mm = expected(weights, &fit.covariance);
    let robot = fit.has(Part::RobotPlace);
    let frame = if robot { "in the robot's frame" } else { "in the camera's frame" };
    let mut j = limits.by_error(
        mm,
        format!(
            "a scanned point between {} is placed {frame} to {mm:.4} mm (1 sigma, three axes together); depths: {}",
            limits.working.words(),
            limits.working.from
        ),
    );
    if let Some([separate, apart]) = beside.separate {
        j.reasons.push(format!(
            "separate calibrations of the same pictures state {separate:.4} mm, added up as if they were \
             independent; their points lie {apart:.4} mm from these (rms)"
        ));
    }
    let parts: Vec<String> = by_part(fit, weights)
        .iter()
        .filter(|(_, e)| *e > 0.05 * mm)
        .map(|(p, e)| format!("{} {e:.4} mm", p.words()))
        .collect();
    j.reasons.push(format!("what makes it: {}", parts.join(", ")));
    if robot {
        let [robot_mm, robot_deg] = robot_scatter(fit);
        j.reasons.push(format!("the robot's poses scatter by {robot_mm:.4} mm and {robot_deg:.4} degrees per axis"));
    }
    by_arm(beside.systematic.as_ref(), &mut j);
    j.ended(fit.end);
    let names = |shots: usize| format!("{shots} pictures of boards");
    j.at_best(Verdict::Usable, fit.shots.len() < 8, || format!("{}, 8 are needed to be good", names(fit.shots.len())));
    if robot {
        by_stops(fit, &mut j);
    }
    for l in &fit.left_out {
        j.at_best(Verdict::Usable, true, || format!("{}: {} was excluded: {}", l.name, l.part.words(), l.why));
    }
    j.reasons.extend(beside.missing.iter().map(|(name, why)| format!("{name} was not used: {why}")));
    let figures = figures(fit, mm, beside);
    Quality { verdict: j.verdict, reasons: j.reasons, advice: j.advice, figures, per_picture: Vec::new() }
}

/// Scatter of the robot's pose per axis, mm and degrees.
fn robot_scatter(fit: &JointFit) -> [f64; 2] {
    [fit.noise.robot_mm, fit.noise.robot_rad.to_degrees()]
}

/// An arm whose misfits follow its pose limits the accuracy of any solve.
fn by_arm(systematic: Option<&Systematic>, j: &mut Judgement) {
    if let Some(s) = systematic.filter(|s| s.found()) {
        j.at_best(Verdict::Usable, true, || {
            format!(
                "the arm limits this accuracy: the other poses predict {:.0} % of its squared misfit at an excluded \
                 pose (by chance: {:.0} %); its link lengths or joint zeros differ from its controller's values",
                100.0 * s.predicted,
                100.0 * s.by_chance.max(0.0)
            )
        });
        j.advise(true, || {
            "have the arm calibrated by its maker, or calibrate in the volume in which it works: points are good \
             there only"
                .into()
        });
    }
}

/// Checks that the stops determine the robot's scatter.
fn by_stops(fit: &JointFit, j: &mut Judgement) {
    // Each stop contributes three numbers of the arm's position; hand-eye and boards take six of them.
    let beyond = 3 * fit.shots.iter().filter(|s| s.robot.is_some()).count() as i64 - 6;
    j.at_best(Verdict::BadlyDetermined, beyond < LEAST_NUMBERS, || {
        format!("{} degrees of freedom determine the robot's scatter, {LEAST_NUMBERS} are needed", beyond.max(0))
    });
    // An arm that scatters far less than the measured boards has little redundancy of its own. It hardly affects
    // scanned points, but its scatter is then poorly known.
    let told = fit.freedom[3];
    j.at_best(Verdict::Usable, beyond >= LEAST_NUMBERS && told < LEAST_NUMBERS as f64, || {
        format!(
            "the robot's scatter is small against that of the boards: only {told:.1} of {beyond} degrees of freedom \
             determine it"
        )
    });
}

/// The solve in numbers; `mm` is the expected error of a point.
fn figures(fit: &JointFit, mm: f64, beside: &Beside) -> BTreeMap<String, f64> {
    let mut figures: BTreeMap<String, f64> = [
        ("expected_error_mm", mm),
        ("separate_expected_error_mm", beside.separate.map_or(f64::NAN, |s| s[0])),
        ("apart_from_separate_mm", beside.separate.map_or(f64::NAN, |s| s[1])),
        ("board_rms_px", fit.features_rms_px),
        ("stops", fit.shots.len() as f64),
        ("nearest_board_mm", beside.lit[0]),
        ("farthest_board_mm", beside.lit[1]),
    ]
    .map(|(k, v)| (k.to_owned(), v))
    .into();
    if fit.has(Part::RobotPlace) {
        let [robot_mm, robot_deg] = robot_scatter(fit);
        figures.insert(crate::rig::ROBOT_SIGMA_MM.into(), robot_mm);
        figures.insert(crate::rig::ROBOT_SIGMA_DEG.into(), robot_deg);
    }
    figures
}
