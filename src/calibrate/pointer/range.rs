//! In: a spot's centre, the camera, the beam and their joint covariance. Out: distance and point with their sigmas;
//! from three or more points the surface's normal and a tool pose perpendicular to it.
//! Frame and unit: camera and base frame, mm, rad (docs/math.md, Pointer (6) to (9); the paper's eq. 3, 4).

use super::beam::BEAM_NAMES;
use crate::camera::{Intrinsics, NAMES, PARAMETERS, difference_step};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Camera, Flange, Mat3, Ray, Rigid, Tool, Vec2, Vec3, fit_plane, skew};
use nalgebra::{Matrix2, SMatrix, SVector};

/// Number of parameters that a point is computed from: the beam's six and the camera's.
pub const RIG: usize = 6 + PARAMETERS;
/// The same plus the six of the hand-eye transform.
pub const SHARED: usize = RIG + 6;
/// Derivatives of a point by the parameters that it was computed from.
pub type ByRig = SMatrix<f64, 3, RIG>;
/// Covariance; rows and columns: the beam's ox oy oz (mm) dx dy dz, then the camera's ([`NAMES`]).
pub type RigCovariance = SMatrix<f64, RIG, RIG>;
/// The same, followed by the hand-eye transform's tx ty tz (mm) rx ry rz (rad).
pub type SharedCovariance = SMatrix<f64, SHARED, SHARED>;

/// A point measured with the pointer.
#[derive(Clone, Debug)]
pub struct Ranged {
    /// Distance from the beam's origin along the beam, mm.
    pub along_beam: f64,
    /// Its standard deviation, mm.
    pub along_beam_sigma: f64,
    /// Distance from the camera along its optical axis, mm.
    pub along_axis: f64,
    /// Its standard deviation, mm.
    pub along_axis_sigma: f64,
    /// Position, camera frame, mm.
    pub point: Vec3,
    /// Total covariance by spot, beam and camera, mm².
    pub covariance: Mat3,
    /// The part of the covariance that comes from this spot alone, mm².
    pub covariance_spot: Mat3,
    /// Derivatives of the point by the parameters of beam and camera, which all points share.
    pub by_rig: ByRig,
    /// Distance of the spot from the beam's image, px.
    pub off_beam_px: f64,
    /// Distance of the spot from the beam's image, in sigmas.
    pub off_beam_sigmas: f64,
}

/// The point of the beam whose pixel is closest to the spot's, in units of the spot's sigma: the viewing ray and the
/// beam meet only up to noise. `joint` comes from [`joint_covariance`].
pub fn range(
    pixel: &Vec2,
    covariance: &Matrix2<f64>,
    camera: &Intrinsics,
    beam: &Ray<Camera>,
    joint: &RigCovariance,
) -> Result<Ranged> {
    let lost = || {
        Fault::refused(format!("the spot at {:.1} {:.1} px has no point on the beam", pixel.x, pixel.y))
            .cause("a reflection, or the pointer was moved since it was calibrated")
            .next("calibrate the pointer again, or exclude this picture")
    };
    let whitener = covariance.cholesky().and_then(|c| c.l().try_inverse()).ok_or_else(|| {
        Fault::input(format!("the spot's covariance {covariance} is invalid")).next("measure the spot again")
    })?;
    let s = nearest(pixel, &whitener, camera, beam).ok_or_else(lost)?;
    // Derivatives of the solution by all its inputs, by differences of the solution.
    let at = |p: &Vec2, d: &SVector<f64, RIG>| -> Option<(f64, Vec3)> {
        let camera = camera.changed(&d.fixed_rows::<PARAMETERS>(6).into_owned());
        let beam = Ray::new(beam.origin + Vec3::new(d[0], d[1], d[2]), beam.direction + Vec3::new(d[3], d[4], d[5]))?;
        let s = nearest(p, &whitener, &camera, &beam)?;
        Some((s, beam.at(s)))
    };
    let zero = SVector::<f64, RIG>::zeros();
    let mut by_spot = SMatrix::<f64, 4, 2>::zeros();
    for c in 0..2 {
        let mut e = Vec2::zeros();
        e[c] = 1e-3;
        let (a, b) = (at(&(pixel + e), &zero).ok_or_else(lost)?, at(&(pixel - e), &zero).ok_or_else(lost)?);
        by_spot.set_column(c, &(stack(&a) - stack(&b)).scale(1.0 / 2e-3));
    }
    let mut by_rig = SMatrix::<f64, 4, RIG>::zeros();
    for c in (0..RIG).filter(|&c| joint[(c, c)] != 0.0) {
        let h = match c {
            0..=2 => 1e-3,
            3..=5 => 1e-6,
            _ => 0.2 * difference_step(c - 6),
        };
        let mut d = zero;
        d[c] = h;
        let (a, b) = (at(pixel, &d).ok_or_else(lost)?, at(pixel, &-d).ok_or_else(lost)?);
        by_rig.set_column(c, &(stack(&a) - stack(&b)).scale(1.0 / (2.0 * h)));
    }
    let own = by_spot * covariance * by_spot.transpose();
    let all = own + by_rig * joint * by_rig.transpose();
    let point = beam.at(s);
    let off = camera.pixel_from_point(&point).ok_or_else(lost)? - pixel;
    Ok(Ranged {
        along_beam: s,
        along_beam_sigma: all[(0, 0)].max(0.0).sqrt(),
        along_axis: point.z,
        along_axis_sigma: all[(3, 3)].max(0.0).sqrt(),
        point,
        covariance: all.fixed_view::<3, 3>(1, 1).into(),
        covariance_spot: own.fixed_view::<3, 3>(1, 1).into(),
        by_rig: by_rig.fixed_view::<3, RIG>(1, 0).into(),
        off_beam_px: off.norm(),
        off_beam_sigmas: (whitener * off).norm(),
    })
}

fn stack((s, p): &(f64, Vec3)) -> SVector<f64, 4> {
    SVector::from([*s, p.x, p.y, p.z])
}

/// Gauss-Newton along the beam from the closed-form triangulation.
fn nearest(pixel: &Vec2, whitener: &Matrix2<f64>, camera: &Intrinsics, beam: &Ray<Camera>) -> Option<f64> {
    // Closest approach of viewing ray and beam in space.
    let v = camera.ray_from_pixel(pixel)?.direction;
    let (d, o) = (beam.direction, beam.origin);
    let (b, c, e) = (d.dot(&v), d.dot(&o), v.dot(&o));
    let mut s = (b * e - c) / (1.0 - b * b);
    for _ in 0..30 {
        let p = beam.at(s);
        let at = crate::calibrate::projection::project(camera, &p)?;
        let r = whitener * (at.pixel - pixel);
        let j = whitener * at.by_point * d;
        let step = -j.dot(&r) / j.norm_squared();
        if !step.is_finite() {
            return None;
        }
        s += step;
        if step.abs() < 1e-10 {
            break;
        }
    }
    (beam.at(s).z > 0.0).then_some(s)
}

/// A measured point in the base frame, with the uncertainty that it shares with other points kept separate.
#[derive(Clone, Debug)]
pub struct BasePoint {
    /// Position, base frame, mm.
    pub point: Vec3,
    /// Total covariance, mm².
    pub covariance: Mat3,
    /// The part that comes from this measurement alone, by spot and robot, mm².
    pub own: Mat3,
    /// Derivatives by the parameters of beam, camera and hand-eye, which all points share.
    pub shared: SMatrix<f64, 3, SHARED>,
    /// Position of the camera; it shows which side of the surface is outside.
    pub camera: Vec3,
}

/// The robot's noise per axis, which an error budget takes from the hand-eye calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RobotNoise {
    /// Position, 1 sigma per axis, mm.
    pub mm: f64,
    /// Orientation, 1 sigma per axis, rad.
    pub rad: f64,
}

/// The paper's eq. 4: the point in the base frame, with the hand-eye's and the robot's uncertainty.
/// `shared` is the covariance of beam, camera and hand-eye.
pub fn to_base(
    ranged: &Ranged,
    base_from_flange: &Rigid<Base, Flange>,
    flange_from_camera: &Rigid<Flange, Camera>,
    shared: &SharedCovariance,
    robot: &RobotNoise,
) -> BasePoint {
    let turned = flange_from_camera.rotation * ranged.point;
    let in_flange = turned + flange_from_camera.translation;
    let base_from_camera = *base_from_flange * *flange_from_camera;
    let r = base_from_camera.rotation;
    let mut j = SMatrix::<f64, 3, SHARED>::zeros();
    j.fixed_view_mut::<3, RIG>(0, 0).copy_from(&(r * ranged.by_rig));
    j.fixed_view_mut::<3, 3>(0, RIG).copy_from(&base_from_flange.rotation);
    j.fixed_view_mut::<3, 3>(0, RIG + 3).copy_from(&(-base_from_flange.rotation * skew(&turned)));
    let arm = skew(&(base_from_flange.rotation * in_flange));
    let own = r * ranged.covariance_spot * r.transpose()
        + Mat3::identity() * robot.mm.powi(2)
        + arm * arm.transpose() * robot.rad.powi(2);
    BasePoint {
        point: base_from_camera.point(&ranged.point),
        covariance: own + j * shared * j.transpose(),
        own,
        shared: j,
        camera: base_from_camera.translation,
    }
}

/// A plane through measured points.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Normal of unit length, towards the camera; base frame.
    pub normal: Vec3,
    /// Mean of the points, mm.
    pub centre: Vec3,
    /// Uncertainty of the normal's direction: the axes of the error ellipse, rad, the larger one first.
    pub tilt_sigma: [f64; 2],
    /// Uncertainty of the height at the centre, mm.
    pub height_sigma: f64,
    /// rms distance of the points from the plane, mm; 0 for three points.
    pub rms: f64,
    /// The tool perpendicular to the surface: z out of the surface, x along the flange's x as far as possible, origin
    /// at the centre.
    pub base_from_tool: Rigid<Base, Tool>,
    /// Squared distances from the plane relative to those that the points' own noise explains; 0 for three points.
    pub misfit: f64,
    /// Index of the point that was excluded because it did not lie on the plane of the others.
    pub left_out: Option<usize>,
}

/// The plane through three or more points, weighted by their own noise; the uncertainty that they share is propagated
/// and added. `x`: requested direction of the tool's x axis (base frame).
pub fn surface(points: &[BasePoint], shared: &SharedCovariance, x: &Vec3) -> Result<Surface> {
    let whole = plane_of(points, shared, x)?;
    let freedom = points.len() as f64 - 3.0;
    if points.len() < 5 || whole.misfit * freedom < GROSS {
        return Ok(whole);
    }
    // One spot across an edge or on another surface spoils the normal. At least four others must agree without it.
    let without = |i: usize| {
        let others: Vec<BasePoint> =
            points.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, p)| p.clone()).collect();
        plane_of(&others, shared, x).ok().map(|s| Surface { left_out: Some(i), ..s })
    };
    let explains =
        |b: &Surface| whole.misfit * freedom - b.misfit * (freedom - 1.0) >= GROSS && b.misfit <= even(freedom - 1.0);
    let mut found = (0..points.len()).filter_map(without).filter(explains);
    // If the exclusion of any of several points would do, the wrong one is unknown; the sigma then covers it.
    Ok(found.next().filter(|_| found.next().is_none()).unwrap_or(whole))
}

/// A spot is excluded if the sum of squared distances falls by at least this without it: five sigmas.
const GROSS: f64 = 25.0;

/// Misfit up to which points count as lying on a plane: three sigmas above 1.
fn even(freedom: f64) -> f64 {
    1.0 + 3.0 * (2.0 / freedom).sqrt()
}

fn weak(what: String) -> Fault {
    Fault::refused(what)
        .cause("a surface's tilt needs three spots that do not lie on a line")
        .next("touch three places of the surface that are as far apart as the part allows")
}

/// A plane through the points' mean.
struct Leaning {
    normal: Vec3,
    /// Covariance of the slopes along two directions in the plane, and of the height.
    covariance: Mat3,
    /// Distances of the points from it, mm.
    residuals: Vec<f64>,
    misfit: f64,
}

/// Least squares of the points' heights over the plane perpendicular to `normal`.
fn lean(points: &[BasePoint], centre: &Vec3, normal: &Vec3, shared: &SharedCovariance) -> Result<Leaning> {
    let n = points.len();
    let axis = if normal.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() };
    let a = normal.cross(&axis).normalize();
    let b = normal.cross(&a);
    // Height = h + p·a-coordinate + q·b-coordinate.
    let (mut h, mut g) = (Mat3::zeros(), Vec3::zeros());
    let rows: Vec<Vec3> =
        points.iter().map(|p| Vec3::new((p.point - centre).dot(&a), (p.point - centre).dot(&b), 1.0)).collect();
    let weights: Vec<f64> = points.iter().map(|p| 1.0 / (normal.transpose() * p.own * normal)[0].max(1e-12)).collect();
    for i in 0..n {
        let z = (points[i].point - centre).dot(normal);
        h += rows[i] * rows[i].transpose() * weights[i];
        g += rows[i] * (z * weights[i]);
    }
    let inverse = h.try_inverse().ok_or_else(|| weak("the points lie on a line".into()))?;
    let s = inverse * g;
    let residuals: Vec<f64> = (0..n).map(|i| (points[i].point - centre).dot(normal) - rows[i].dot(&s)).collect();
    // Derivatives of the three numbers by the shared parameters.
    let mut j = SMatrix::<f64, 3, SHARED>::zeros();
    for i in 0..n {
        j += rows[i] * weights[i] * (normal.transpose() * points[i].shared);
    }
    let j = inverse * j;
    let freedom = n as f64 - 3.0;
    let mut misfit = 0.0;
    if freedom > 0.0 {
        misfit = residuals.iter().zip(&weights).map(|(r, w)| r * r * w).sum::<f64>() / freedom;
    }
    // The normal of an uneven surface is less certain than the noise of the spots alone implies.
    let uneven = if freedom > 0.0 && misfit > even(freedom) { misfit } else { 1.0 };
    let covariance = inverse * uneven + j * shared * j.transpose();
    let normal = (normal - a * s.x - b * s.y).normalize();
    Ok(Leaning { normal, covariance, residuals, misfit })
}

fn plane_of(points: &[BasePoint], shared: &SharedCovariance, x: &Vec3) -> Result<Surface> {
    let n = points.len();
    if n < 3 {
        return Err(weak(format!("{n} points, 3 are needed")));
    }
    let at: Vec<Vec3> = points.iter().map(|p| p.point).collect();
    let centre = at.iter().sum::<Vec3>() / n as f64;
    let plane = fit_plane::<Base>(&at).ok_or_else(|| weak("the points lie on a line".into()))?.0;
    let mut normal = plane.normal;
    let outside = points.iter().map(|p| p.camera).sum::<Vec3>() / n as f64 - centre;
    if normal.dot(&outside) < 0.0 {
        normal = -normal;
    }
    // The weights depend on the normal.
    let mut leaning = Leaning { normal, covariance: Mat3::zeros(), residuals: vec![0.0; n], misfit: 0.0 };
    for _ in 0..3 {
        leaning = lean(points, &centre, &leaning.normal, shared)?;
    }
    let Leaning { normal, covariance, residuals, misfit } = leaning;
    let tilt: Matrix2<f64> = covariance.fixed_view::<2, 2>(0, 0).into();
    let e = tilt.symmetric_eigenvalues();
    let along = x - normal * normal.dot(x);
    let x = if along.norm() > 1e-6 { along.normalize() } else { normal.cross(&Vec3::y()).normalize() };
    let rotation = Mat3::from_columns(&[x, normal.cross(&x), normal]);
    Ok(Surface {
        normal,
        centre,
        tilt_sigma: [e.max().max(0.0).sqrt(), e.min().max(0.0).sqrt()],
        height_sigma: covariance[(2, 2)].max(0.0).sqrt(),
        misfit,
        left_out: None,
        rms: (residuals.iter().map(|r| r * r).sum::<f64>() / n as f64).sqrt(),
        base_from_tool: Rigid::new(rotation, centre),
    })
}

/// The joint covariance of beam and camera from a pointer's calibration file. If the file states only the beam's
/// covariance (imported values), the camera's part is zero.
pub fn joint_covariance(covariance: &crate::rig::Covariance) -> RigCovariance {
    covariance.of::<RIG>(std::array::from_fn(|i| if i < 6 { BEAM_NAMES[i] } else { NAMES[i - 6] }))
}
