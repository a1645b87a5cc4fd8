//! In: a measured pose with its covariance, the calibrations of the rig, the robot's repeatability.
//! Out: the error budget: what each of them adds to the insertion pose, and the sum
//! (docs/math.md, Insertion (5)). Frame and unit: the part's own axes; mm, degrees; one standard deviation.

use super::recipe::RobotSpec;
use crate::find::measure::points::Ordered;
use crate::find::measure::pose::Measured;
use crate::geometry::{Base, Camera, Mat3, Rigid, Vec2, Vec3};
use crate::rig::{Covariance, Rig};
use nalgebra::{DMatrix, Matrix6};

/// One line of the budget.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Term {
    pub name: &'static str,
    /// x, y, z of the part, mm; `None` where the source does not know its uncertainty.
    pub sigma_mm: Option<[f64; 3]>,
    pub sigma_deg: Option<[f64; 3]>,
    /// Where the number comes from, or why there is none.
    pub note: String,
}

/// What an error of one calibration does to the pose. Two looks share the error; where their levers differ, they disagree.
#[derive(Clone, Debug)]
pub struct Lever {
    pub name: &'static str,
    /// The calibration's parameters, with units.
    pub parameters: &'static [&'static str],
    /// Motion of the part over an error of each parameter, base axes: shift of the part's origin, mm, then turn, rad; 6 x n.
    pub jacobian: DMatrix<f64>,
    /// Of the parameters; `None` where the calibration does not know it (imported values).
    pub covariance: Option<DMatrix<f64>>,
}

impl Lever {
    /// Covariance that the calibration adds to the pose, base axes; zero where it is unknown.
    pub fn of_pose(&self) -> Matrix6<f64> {
        match &self.covariance {
            Some(c) => Matrix6::from_iterator((&self.jacobian * c * self.jacobian.transpose()).iter().copied()),
            None => Matrix6::zeros(),
        }
    }
}

/// The budget and its sum over the terms that are known.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Budget {
    pub terms: Vec<Term>,
    pub sigma_mm: [f64; 3],
    pub sigma_deg: [f64; 3],
    /// False where a term is unknown: the sum is then a lower bound.
    pub complete: bool,
    #[serde(skip)]
    pub covariance: Matrix6<f64>,
    /// What belongs to this look alone: match and robot, the part's axes.
    #[serde(skip)]
    pub own: Matrix6<f64>,
    /// What all looks of this rig share; none where the scan does not fit the rig.
    #[serde(skip)]
    pub levers: Vec<Lever>,
    /// How the camera stood over the middle of the part.
    #[serde(skip)]
    pub base_from_camera: Option<Rigid<Base, Camera>>,
}

/// Adds up the budget. `rig` may be missing or have imported values of unknown uncertainty.
pub fn budget(points: &Ordered, measured: &Measured, rig: Option<&Rig>, robot: &RobotSpec) -> Budget {
    let (p, r) = (robot.sigma_mm.powi(2), robot.sigma_deg.to_radians().powi(2));
    let repeatability = Matrix6::from_diagonal(&nalgebra::Vector6::new(p, p, p, r, r, r));
    let own = measured.covariance + repeatability;
    let mut covariance = own;
    let mut terms = vec![
        peak_noise(points, measured),
        term("match", &measured.covariance, "edges and surfaces of the part, peak noise included".into()),
    ];
    let mut complete = true;
    let geometry = rig.and_then(|r| Geometry::at(points, measured, r));
    let levers = geometry.as_ref().zip(rig).map_or(Vec::new(), |(g, rig)| levers(&g.base_from_camera, &g.target, rig));
    for name in ["laser plane", "hand-eye"] {
        let known = levers.iter().find(|l| l.name == name);
        match (known.filter(|l| l.covariance.is_some()), &geometry) {
            (Some(lever), Some(g)) => {
                let c = lever.of_pose();
                let shift = c.fixed_view::<3, 3>(0, 0).trace().max(0.0).sqrt();
                let c = g.in_part(&c);
                covariance += c;
                terms.push(term(name, &c, format!("{shift:.4} mm at {:.0} mm from the camera", g.target.norm())));
            }
            _ => {
                complete = false;
                let note = if known.is_some() { NO_COVARIANCE } else { NO_GEOMETRY }.into();
                terms.push(Term { name, sigma_mm: None, sigma_deg: None, note });
            }
        }
    }
    terms.push(term("robot", &repeatability, "repeatability, from the recipe".into()));
    let [sigma_mm, sigma_deg] = sigmas(&covariance);
    let base_from_camera = geometry.map(|g| g.base_from_camera);
    Budget { terms, sigma_mm, sigma_deg, complete, covariance, own, levers, base_from_camera }
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

/// What the peaks' own sigmas alone would give; part of the match, shown beside it.
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

/// How the camera stood when the middle of the part was scanned.
struct Geometry {
    base_from_camera: Rigid<Base, Camera>,
    /// Middle of the part in the camera frame.
    target: Vec3,
    part_from_base: Mat3,
}

impl Geometry {
    /// From the points of the shot through the part's middle: seen in the camera by their pixels and
    /// the laser plane, and in the base frame by the scan.
    fn at(points: &Ordered, measured: &Measured, rig: &Rig) -> Option<Geometry> {
        let origin = measured.base_from_part.translation;
        let nearest = (0..points.points.len())
            .min_by(|&a, &b| (points.points[a] - origin).norm().total_cmp(&(points.points[b] - origin).norm()))?;
        let base_from_camera = camera_at(points, points.row[nearest], rig)?;
        Some(Geometry {
            target: base_from_camera.inverse().point(&origin),
            base_from_camera,
            part_from_base: measured.base_from_part.rotation.transpose(),
        })
    }
    /// Rotates a covariance given over (translation, rotation) in base axes into part axes.
    fn in_part(&self, c: &Matrix6<f64>) -> Matrix6<f64> {
        let mut r = Matrix6::zeros();
        r.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.part_from_base);
        r.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.part_from_base);
        r * c * r.transpose()
    }
}

/// Where the camera stood for one row of points.
fn camera_at(points: &Ordered, row: u32, rig: &Rig) -> Option<Rigid<Base, Camera>> {
    let (camera, plane) = (rig.camera.as_ref()?.value, rig.laser_plane.as_ref()?.value);
    let (mut seen, mut known) = (vec![], vec![]);
    for i in (0..points.points.len()).filter(|&i| points.row[i] == row) {
        let px = Vec2::new(f64::from(points.pixel[i][0]), f64::from(points.pixel[i][1]));
        if let Some(p) = camera.ray_from_pixel(&px).and_then(|r| r.meet(&plane)) {
            seen.push(p);
            known.push(points.points[i]);
        }
    }
    align(&seen, &known)
}

/// Direction towards the camera during the scan, base frame; `None` where the rig does not fit the scan.
pub fn towards_camera(points: &Ordered, rig: &Rig) -> Option<Vec3> {
    let middle = points.row[points.row.len() / 2];
    camera_at(points, middle, rig).map(|c| -c.direction(&Vec3::z()))
}

/// The rotation and translation that bring `from` to `to`; `None` where they do not determine it.
fn align(from: &[Vec3], to: &[Vec3]) -> Option<Rigid<Base, Camera>> {
    if from.len() < 10 {
        return None;
    }
    let mean = |v: &[Vec3]| v.iter().sum::<Vec3>() / v.len() as f64;
    let (a, b) = (mean(from), mean(to));
    let m = from.iter().zip(to).map(|(p, q)| (q - b) * (p - a).transpose()).sum::<Mat3>();
    let s = m.singular_values();
    // Points on one line leave a turn about it open.
    if s[1] < 1e-6 * s[0] {
        return None;
    }
    // Points of one shot lie in a plane: the third axis follows from the other two.
    let svd = m.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    let d = (u * vt).determinant().signum();
    let rotation = u * Mat3::from_diagonal(&Vec3::new(1.0, 1.0, d)) * vt;
    let t = Rigid::new(rotation, b - rotation * a);
    let rms =
        (from.iter().zip(to).map(|(p, q)| (t.point(p) - q).norm_squared()).sum::<f64>() / from.len() as f64).sqrt();
    // The cloud was made with these very values; more than float rounding means another calibration.
    (rms < 0.2).then_some(t)
}

const NO_GEOMETRY: &str = "unknown: the scan does not fit the station's calibration, or none was given";
const NO_COVARIANCE: &str = "unknown: the calibration has no covariance (imported values)";

/// The levers of the calibrations that a rig has, for a camera that sees the part's origin at `target` (camera frame).
pub(in crate::find) fn levers(base_from_camera: &Rigid<Base, Camera>, target: &Vec3, rig: &Rig) -> Vec<Lever> {
    let plane = rig
        .laser_plane
        .as_ref()
        .map(|p| Lever { covariance: square(&p.covariance, 4), ..plane_lever(base_from_camera, target, &p.value) });
    let hand_eye = rig
        .hand_eye
        .as_ref()
        .map(|h| Lever { covariance: square(&h.covariance, 6), ..hand_eye_lever(base_from_camera, target, &h.value) });
    plane.into_iter().chain(hand_eye).collect()
}

/// How the part at `target` (camera frame) moves with the laser plane: P = ray offset / (n ray), so that
/// dP = ray (d offset - P dn) / (n ray).
pub(in crate::find) fn plane_lever(
    base_from_camera: &Rigid<Base, Camera>,
    target: &Vec3,
    plane: &crate::geometry::Plane<Camera>,
) -> Lever {
    let n = plane.normal;
    let ray = target.normalize();
    let slope = n.dot(&ray);
    let mut jacobian = DMatrix::zeros(6, 4);
    let direction = base_from_camera.direction(&ray) / slope;
    for k in 0..3 {
        jacobian.fixed_view_mut::<3, 1>(0, k).copy_from(&(direction * -target[k]));
    }
    jacobian.fixed_view_mut::<3, 1>(0, 3).copy_from(&direction);
    // A tilt of the plane by dn tilts what is scanned by up to |dn| / |slope| about n x dn.
    for k in 0..3 {
        let mut e = Vec3::zeros();
        e[k] = 1.0;
        jacobian.fixed_view_mut::<3, 1>(3, k).copy_from(&base_from_camera.direction(&n.cross(&e)));
    }
    Lever { name: "laser plane", parameters: &["nx", "ny", "nz", "offset mm"], jacobian, covariance: None }
}

/// How the part at `target` (camera frame) moves with the hand-eye transform: R = exp(w) R0, so a camera point moves by
/// dt + w x (R0 p) in the flange frame.
pub(in crate::find) fn hand_eye_lever(
    base_from_camera: &Rigid<Base, Camera>,
    target: &Vec3,
    hand_eye: &crate::rig::HandEye,
) -> Lever {
    let base_from_flange = base_from_camera.rotation * hand_eye.rotation.transpose();
    let arm = crate::geometry::skew(&(hand_eye.rotation * target));
    let mut jacobian = DMatrix::zeros(6, 6);
    jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(&base_from_flange);
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(base_from_flange * -arm));
    jacobian.fixed_view_mut::<3, 3>(3, 3).copy_from(&base_from_flange);
    let parameters = &["tx mm", "ty mm", "tz mm", "rx rad", "ry rad", "rz rad"];
    Lever { name: "hand-eye", parameters, jacobian, covariance: None }
}

fn square(c: &Covariance, n: usize) -> Option<DMatrix<f64>> {
    (c.matrix.len() == n && c.matrix.iter().all(|r| r.len() == n)).then(|| c.to_matrix())
}
