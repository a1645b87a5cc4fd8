//! In: places that a rig saw, shot by shot, and how a measurement responds when they move. Out: for each calibration,
//! and for errors that no calibration covers (delay, length of the robot's steps), what an error of each number does to
//! the measurement.
//! Frame and unit: base frame, mm, rad; sizes as shares, the part's axes. docs/math.md, Second look.

use crate::camera::{Intrinsics, NAMES, Parameters, difference_step};
use crate::fault::Result;
use crate::geometry::{Axis, AxisKind, Base, Camera, Plane, Ride, Rigid, Vec3};
use crate::rig::{Covariance, HandEye, JointCovariance, Kind, Rig};
use nalgebra::{DMatrix, Matrix6, SVector};

/// Length of an [`Answer`].
pub const NUMBERS: usize = 9;

/// Response of a measurement to displacements: shift and turn of the part, then its sizes along x and y and its shear.
/// The sizes are 0 for a measurement without sizes.
pub type Answer = SVector<f64, NUMBERS>;

/// Name of the lever of the hand-eye calibration.
pub const HAND_EYE: &str = "hand-eye";
/// Name of the lever of a line-profile sensor's hand-eye calibration.
pub const PROFILE_HAND_EYE: &str = "profile hand-eye";
/// Name of the lever of calibrations that were made jointly.
pub const TOGETHER: &str = "calibrations together";
/// Name of the lever of a linear axis or a turntable.
pub const AXIS: &str = "axis";

/// A place that was scanned.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Position in the camera frame, on the laser plane, mm.
    pub at: Vec3,
    /// The camera's pose at that shot, mm.
    pub base_from_camera: Rigid<Base, Camera>,
    /// Displacement of the place if the next shot's pose were used, base frame, mm.
    pub late: Vec3,
    /// Displacement of the place if the robot's steps were twice as long, base frame, mm.
    pub longer: Vec3,
}

/// The effect of an error of one calibration. Two scans share the error; where their levers differ, they disagree.
#[derive(Clone, Debug)]
pub struct Lever {
    /// The calibration, or a supposed error, e.g. "delay".
    pub name: &'static str,
    /// The calibration's parameters, with units.
    pub parameters: &'static [&'static str],
    /// Change of the [`Answer`] with an error of each parameter: shift and turn in base axes, sizes in the part's; 9 x
    /// n.
    pub jacobian: DMatrix<f64>,
    /// Covariance of the parameters; `None` where it is unknown (imported values).
    pub covariance: Option<DMatrix<f64>>,
    /// True for an error that nothing states: it does not enter sigmas, and may explain why scans disagree. The
    /// covariance is then a typical size of it.
    pub supposed: bool,
}

impl Lever {
    /// Covariance that the calibration adds to the pose, base axes; zero where it is unknown.
    pub fn of_pose(&self) -> Matrix6<f64> {
        match &self.covariance {
            Some(c) if !self.supposed => {
                let j = self.jacobian.rows(0, 6);
                Matrix6::from_iterator((j * c * j.transpose()).iter().copied())
            }
            _ => Matrix6::zeros(),
        }
    }
}

/// The levers of all calibrations of a rig, and of supposed errors. `answer` takes the displacement of each place, base
/// axes.
///
/// # Errors
/// A rig with two axes.
pub fn levers(seen: &[Seen], rig: &Rig, answer: impl Fn(&[Vec3]) -> Answer) -> Result<Vec<Lever>> {
    let lever = |name, parameters: &'static [&'static str], by: &dyn Fn(&Seen, usize) -> Vec3| {
        let columns: Vec<Answer> =
            (0..parameters.len()).map(|k| answer(&seen.iter().map(|s| by(s, k)).collect::<Vec<_>>())).collect();
        let jacobian = DMatrix::from_fn(NUMBERS, columns.len(), |r, c| columns[c][r]);
        Lever { name, parameters, jacobian, covariance: None, supposed: false }
    };
    let supposed = |lever: Lever, sigmas: &[f64]| {
        let variances = nalgebra::DVector::from_iterator(sigmas.len(), sigmas.iter().map(|s| s * s));
        Lever { covariance: Some(DMatrix::from_diagonal(&variances)), supposed: true, ..lever }
    };
    let mut out = Vec::new();
    if let Some(p) = &rig.laser_plane {
        let of = lever("laser plane", &["nx", "ny", "nz", "offset mm"], &|s, k| by_plane(s, &p.value, k));
        out.push(Lever { covariance: square(&p.covariance, 4), ..of });
    }
    let names: &'static [&'static str] = &["tx mm", "ty mm", "tz mm", "rx rad", "ry rad", "rz rad"];
    if let Some(h) = &rig.hand_eye {
        let of = lever(HAND_EYE, names, &|s, k| by_hand_eye(s, &h.value, k));
        out.push(Lever { covariance: square(&h.covariance, 6), ..of });
    }
    if let Some(h) = &rig.profile_hand_eye {
        // The sensor's frame takes the place of the camera's.
        let placed = HandEye::new(h.value.rotation, h.value.translation);
        let of = lever(PROFILE_HAND_EYE, names, &|s, k| by_hand_eye(s, &placed, k));
        out.push(Lever { covariance: square(&h.covariance, 6), ..of });
    }
    if let Some(a) = rig.axis()? {
        let names: &'static [&'static str] = match a.value.kind {
            AxisKind::Linear => &["dx", "dy", "dz", "pitch mm"],
            AxisKind::Turntable => &["dx", "dy", "dz", "pitch rad", "px mm", "py mm", "pz mm"],
        };
        let of = lever(AXIS, names, &|s, k| by_axis(s, &a.value, k));
        out.push(Lever { covariance: square(&a.covariance, names.len()), ..of });
    }
    if let (Some(c), Some(p)) = (&rig.camera, &rig.laser_plane) {
        let of = lever("camera", &["fx px", "fy px", "cx px", "cy px"], &|s, k| by_camera(s, &c.value, &p.value, k));
        out.push(supposed(of, &[1.0; 4]));
    }
    out.push(supposed(lever("delay", &["shots"], &|s, _| s.late), &[1.0]));
    out.push(supposed(lever("robot's steps", &["share"], &|s, _| s.longer), &[0.01]));
    Ok(out)
}

/// The lever of camera, lens, laser plane and hand-eye, calibrated jointly. `None` where the rig lacks one of these.
pub fn together(
    seen: &[Seen],
    rig: &Rig,
    joint: &JointCovariance,
    answer: impl Fn(&[Vec3]) -> Answer,
) -> Option<Lever> {
    let (camera, plane, hand_eye) =
        (rig.camera.as_ref()?.value, rig.laser_plane.as_ref()?.value, rig.hand_eye.as_ref()?.value);
    let (mut at, mut columns) = (Vec::new(), Vec::new());
    for (i, name) in joint.parameters.iter().enumerate() {
        let Some((record, parameter)) = name.split_once('.') else { continue };
        let of = |names: &[&str]| names.iter().position(|n| *n == parameter);
        let by: Box<dyn Fn(&Seen) -> Vec3> = match record {
            r if r == Kind::Camera.name() => {
                let k = of(&NAMES)?;
                Box::new(move |s| by_lens(s, &camera, &plane, k))
            }
            r if r == Kind::LaserPlane.name() => {
                let k = of(Kind::LaserPlane.parameters().0)?;
                Box::new(move |s| by_plane(s, &plane, k))
            }
            r if r == Kind::HandEye.name() => {
                let k = of(Kind::HandEye.parameters().0)?;
                Box::new(move |s| by_hand_eye(s, &hand_eye, k))
            }
            // The pointer does not scan.
            _ => continue,
        };
        at.push(i);
        columns.push(answer(&seen.iter().map(by).collect::<Vec<_>>()));
    }
    let jacobian = DMatrix::from_fn(NUMBERS, columns.len(), |r, c| columns[c][r]);
    let covariance = Some(joint.of_parameters(&at));
    Some(Lever { name: TOGETHER, parameters: &[], jacobian, covariance, supposed: false })
}

/// Displacement when the camera or its lens changes while the pixel stays, by finite differences.
fn by_lens(s: &Seen, camera: &Intrinsics, plane: &Plane<Camera>, k: usize) -> Vec3 {
    let Some(pixel) = camera.pixel_from_point(&s.at) else { return Vec3::zeros() };
    let step = difference_step(k);
    let with = |d: f64| {
        let mut change = Parameters::zeros();
        change[k] = d;
        camera.changed(&change).ray_from_pixel(&pixel)?.meet(plane)
    };
    match (with(step), with(-step)) {
        (Some(a), Some(b)) => s.base_from_camera.direction(&((a - b) / (2.0 * step))),
        _ => Vec3::zeros(),
    }
}

/// P = ray offset / (n ray), so that dP = P (d offset - P dn) / offset.
fn by_plane(s: &Seen, plane: &Plane<Camera>, k: usize) -> Vec3 {
    let change = if k == 3 { 1.0 } else { -s.at[k] };
    s.base_from_camera.direction(&(s.at * (change / plane.normal.dot(&s.at))))
}

/// R = exp(w) R0: a camera point moves by dt + w x (R0 p) in the flange frame.
fn by_hand_eye(s: &Seen, hand_eye: &HandEye, k: usize) -> Vec3 {
    let axis = Vec3::ith(k % 3, 1.0);
    let moved = if k < 3 { axis } else { axis.cross(&(hand_eye.rotation * s.at)) };
    s.base_from_camera.rotation * (hand_eye.rotation.transpose() * moved)
}

/// Displacement of a place by an error of the axis: at the count of its shot, relative to the motion's zero.
fn by_axis(s: &Seen, axis: &Axis, k: usize) -> Vec3 {
    // The cloud's frame is the axis's frame.
    let axis_from_camera: Rigid<Ride, Camera> = Rigid::new(s.base_from_camera.rotation, s.base_from_camera.translation);
    axis.errors(axis.count_of(&axis_from_camera))[k].at(&s.base_from_camera.point(&s.at))
}

/// Displacement when the ray through a pixel turns and meets the plane elsewhere; lens distortion is ignored.
fn by_camera(s: &Seen, camera: &Intrinsics, plane: &Plane<Camera>, k: usize) -> Vec3 {
    let (x, y) = (s.at.x / s.at.z, s.at.y / s.at.z);
    let turned = match k {
        0 => Vec3::x() * (-x / camera.fx),
        1 => Vec3::y() * (-y / camera.fy),
        2 => Vec3::x() * (-1.0 / camera.fx),
        _ => Vec3::y() * (-1.0 / camera.fy),
    } * s.at.z;
    s.base_from_camera.direction(&(turned - s.at * (plane.normal.dot(&turned) / plane.normal.dot(&s.at))))
}

fn square(c: &Covariance, n: usize) -> Option<DMatrix<f64>> {
    (c.matrix.len() == n && c.matrix.iter().all(|r| r.len() == n)).then(|| c.to_matrix())
}
