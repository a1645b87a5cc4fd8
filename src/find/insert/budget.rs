//! In: a measured pose with its covariance, the calibrations of the rig, the robot's repeatability.
//! Out: the error budget: what each of them adds to the insertion pose, and the sum
//! (docs/math.md, Insertion (5)). Frame and unit: the part's own axes; mm, degrees; one standard deviation.

use super::recipe::Recipe;
use crate::fault::Result;
use crate::find::look::levers::{AXIS, HAND_EYE, Lever, PROFILE_HAND_EYE, TOGETHER};
use crate::find::look::part_seen::PartSeen;
use crate::find::measure::construct::Built;
use crate::find::measure::points::Ordered;
use crate::find::measure::pose::Measured;
use crate::find::measure::shape::Shape;
use crate::geometry::{Base, Camera, Mat3, Rigid};
use crate::rig::Rig;
use nalgebra::Matrix6;

/// One line of the budget.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Term {
    /// Source of the uncertainty, e.g. "laser plane".
    pub name: &'static str,
    /// x, y, z of the part, mm; `None` where the source's uncertainty is unknown.
    pub sigma_mm: Option<[f64; 3]>,
    /// Turns about x, y, z of the part, degrees; `None` where the source's uncertainty is unknown.
    pub sigma_deg: Option<[f64; 3]>,
    /// Where the number comes from, or why there is none.
    pub note: String,
}

/// The budget and its sum over the terms that are known.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Budget {
    /// One term a source. "peak noise" is contained in "match" and is not added again. Single calibrations are not
    /// added where one term states them together.
    pub terms: Vec<Term>,
    /// One standard deviation along x, y, z of the part, mm.
    pub sigma_mm: [f64; 3],
    /// One standard deviation of the turns about x, y, z of the part, degrees.
    pub sigma_deg: [f64; 3],
    /// False where a term is unknown: the sum is then a lower bound.
    pub complete: bool,
    /// Covariance of the pose, 6 x 6 over x y z rx ry rz along the part's own axes, mm and rad.
    #[serde(skip)]
    pub covariance: Matrix6<f64>,
    /// The share of the covariance that this scan alone contributes: match and robot; along the part's axes.
    #[serde(skip)]
    pub own: Matrix6<f64>,
    /// Errors that all scans of this rig share; empty where the scan does not fit the rig.
    #[serde(skip)]
    pub levers: Vec<Lever>,
    /// Sizes compared with the drawing, from this scan alone.
    #[serde(skip)]
    pub shape: Option<Shape>,
    /// How the part was seen, and the camera's pose over its middle.
    #[serde(skip)]
    pub seen: Option<PartSeen>,
    /// The camera's pose over the part's middle, mm; `None` where the scan does not fit the rig.
    #[serde(skip)]
    pub base_from_camera: Option<Rigid<Base, Camera>>,
}

impl Budget {
    /// Adds the uncertainty of a construction: the pose that it gives is known no better than the few shapes in it.
    pub(in crate::find) fn built(&mut self, b: &Built) {
        let v = b.measured.sigma_mm.powi(2);
        let c = Matrix6::from_diagonal(&nalgebra::Vector6::new(v, v, 0.0, 0.0, 0.0, 0.0));
        self.terms.push(term("construction", &c, format!("'{}', of {} measured shapes", b.name, b.shapes)));
        self.own += c;
        self.covariance += c;
        [self.sigma_mm, self.sigma_deg] = sigmas(&self.covariance);
    }

    /// The budget of a scan of which only its own covariance is known (along the base axes, or the part's where it is
    /// turned).
    pub(in crate::find) fn of_look(own: Matrix6<f64>) -> Budget {
        let [sigma_mm, sigma_deg] = sigmas(&own);
        Budget {
            terms: Vec::new(),
            sigma_mm,
            sigma_deg,
            complete: true,
            covariance: own,
            own,
            levers: Vec::new(),
            shape: None,
            seen: None,
            base_from_camera: None,
        }
    }
}

/// Adds up the budget. `rig` may be missing or have imported values of unknown uncertainty.
///
/// # Errors
/// A rig with two axes.
pub fn budget(points: &Ordered, measured: &Measured, rig: Option<&Rig>, recipe: &Recipe) -> Result<Budget> {
    let robot = &recipe.robot;
    let (p, r) = (robot.sigma_mm.powi(2), robot.sigma_deg.to_radians().powi(2));
    let repeatability = Matrix6::from_diagonal(&nalgebra::Vector6::new(p, p, p, r, r, r));
    let own = measured.covariance + repeatability;
    let mut covariance = own;
    let mut terms = vec![
        peak_noise(points, measured),
        term("match", &measured.covariance, "edges and surfaces of the part, peak noise included".into()),
    ];
    let mut complete = true;
    let seen = rig.and_then(|_| PartSeen::new(points, &recipe.drawing(), measured, &recipe.measure));
    let levers = seen.as_ref().zip(rig).map_or(Ok(Vec::new()), |(seen, rig)| seen.levers(rig))?;
    let on_axis = rig.map_or(Ok(None), Rig::axis)?.is_some();
    let into_part = both(&measured.base_from_part.rotation.transpose());
    let (together, aside) =
        seen.as_ref().zip(rig).filter(|_| !on_axis).map_or((None, None), |(seen, rig)| at_once(seen, rig));
    let on_profiles = rig.is_some_and(|rig| rig.profile_hand_eye.is_some());
    let (names, eye): (&[&'static str], &str) = match () {
        () if on_profiles => (&[PROFILE_HAND_EYE], "sensor"),
        () if rig.is_some_and(|rig| rig.records().is_empty()) => (&[TRAVEL], "sensor"),
        () if on_axis => (&["laser plane", AXIS], "camera"),
        () => (&["laser plane", HAND_EYE], "camera"),
    };
    for &name in names {
        let known = levers.iter().find(|l| l.name == name);
        match (known.filter(|l| l.covariance.is_some()), &seen) {
            (Some(lever), Some(seen)) => {
                let c = lever.of_pose();
                let shift = c.fixed_view::<3, 3>(0, 0).trace().max(0.0).sqrt();
                let c = into_part * c * into_part.transpose();
                let mut note = format!("{shift:.4} mm at {:.0} mm from the {eye}", seen.target().norm());
                if together.is_some() {
                    note += &format!("; contained in '{TOGETHER}'");
                } else {
                    covariance += c;
                    aside.iter().for_each(|why| note += &format!("; as if independent: {why}"));
                }
                terms.push(term(name, &c, note));
            }
            _ => {
                complete = false;
                let note = match known {
                    Some(_) => NO_COVARIANCE,
                    None if name == TRAVEL => "unknown: the way of a count was stated without an uncertainty",
                    None => NO_GEOMETRY,
                };
                let note = note.into();
                terms.push(Term { name, sigma_mm: None, sigma_deg: None, note });
            }
        }
    }
    if let Some(lever) = together {
        let c = into_part * lever.of_pose() * into_part.transpose();
        covariance += c;
        terms.push(term(TOGETHER, &c, "camera, laser plane and hand-eye, from joint.json".into()));
    }
    terms.push(term("robot", &repeatability, "repeatability, from the recipe".into()));
    let [sigma_mm, sigma_deg] = sigmas(&covariance);
    let base_from_camera = seen.as_ref().map(PartSeen::base_from_camera);
    let shape = measured.shape;
    Ok(Budget { terms, sigma_mm, sigma_deg, complete, covariance, own, levers, shape, seen, base_from_camera })
}

/// The lever of calibrations that were made jointly; otherwise the reason why a stated joint result is not used.
fn at_once(seen: &PartSeen, rig: &Rig) -> (Option<Lever>, Option<String>) {
    match rig.joint() {
        None => (None, None),
        Some(Err(why)) => (None, Some(why)),
        Some(Ok(joint)) => (seen.together(rig, joint), None),
    }
}

/// Standard deviations of a pose's covariance: x y z in mm, turns about them in degrees.
pub(in crate::find) fn sigmas(c: &Matrix6<f64>) -> [[f64; 3]; 2] {
    let sd = |k: usize| c[(k, k)].max(0.0).sqrt();
    [[sd(0), sd(1), sd(2)], [sd(3), sd(4), sd(5)].map(f64::to_degrees)]
}

fn term(name: &'static str, c: &Matrix6<f64>, note: String) -> Term {
    let [mm, deg] = sigmas(c);
    Term { name, sigma_mm: Some(mm), sigma_deg: Some(deg), note }
}

/// What the peaks' own sigmas alone would give. This is part of the match, and is shown for comparison.
fn peak_noise(points: &Ordered, measured: &Measured) -> Term {
    let mut s: Vec<f32> = points.sigma.iter().copied().filter(|s| s.is_finite() && *s > 0.0).collect();
    if s.is_empty() {
        return Term { name: "peak noise", sigma_mm: None, sigma_deg: None, note: "the cloud holds no sigma".into() };
    }
    let middle = s.len() / 2;
    let one = f64::from(*s.select_nth_unstable_by(middle, f32::total_cmp).1);
    let (edge, surface) = (one / (measured.edges as f64).sqrt(), one / (measured.surface_points as f64).sqrt());
    Term {
        name: "peak noise",
        sigma_mm: Some([edge, edge, surface]),
        sigma_deg: None,
        note: format!("median {one:.4} mm a point; contained in the match"),
    }
}

/// The matrix that turns both halves of a pose's covariance or motion by the same rotation.
pub(in crate::find) fn both(r: &Mat3) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(r);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(r);
    out
}

/// Name of the term of an axis that no calibration describes.
const TRAVEL: &str = "travel";
const NO_GEOMETRY: &str = "unknown: the scan does not fit the station's calibration, or none was given";
const NO_COVARIANCE: &str = "unknown: the calibration has no covariance (imported values)";
