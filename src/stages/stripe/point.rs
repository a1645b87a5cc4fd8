//! In: chosen peaks, the camera, the laser plane, the shot's pose. Out: points with their standard deviation. The stage
//! also makes the last choice: it rejects peaks that are weak beside another. Frame and unit: the frame that the given
//! transform leads to (base or grid), mm. docs/math.md, Stripe peak (7), (8).

use super::choose::{LINE_OF, beside};
use super::optics::PointFrame;
use crate::camera::Intrinsics;
use crate::geometry::{Camera, Frame, Plane, Rigid, Vec2};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::listing;
use crate::stages::peak::SHARED as PEAKS;
use crate::stages::peak::found::{Peak, Reject};
use glam::Vec3;

pub use super::optics::{FLAT, Optics};

/// A point of the profile, 4 words; NaN if the peak was rejected.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Point {
    /// Position in the frame that the pose leads to, mm.
    pub position: Vec3,
    /// Standard deviation along the direction in which the point moves with the stripe's centre, mm. It contains the
    /// peak's own noise, not that of calibration or robot.
    pub sigma_mm: f32,
}

impl Point {
    /// Marks "no point": NaN in all four words.
    pub const NONE: Point = Point { position: Vec3::NAN, sigma_mm: f32::NAN };
}

/// 1: the lens has terms beyond Brown-Conrady's five, or its sensor is tilted.
pub const FULL_LENS: &str = "full_lens";

/// Newton steps of the lens inversion. The first error is the distortion itself, at most 0.2, and each step squares it.
/// Five steps therefore leave less than 1e-6 px for every lens whose distortion is monotonic over the picture.
pub(in crate::stages) const NEWTON: u32 = 5;

/// CPU twin: one point per peak; peaks without a point get [`Reject::NoPoint`].
pub fn points<To: Frame>(peaks: &mut [Peak], optics: &Optics, to_from_camera: &Rigid<To, Camera>) -> Vec<Point> {
    posed(peaks, optics, &pose_words(to_from_camera))
}

/// The same with the transform in the format of [`pose_words`].
pub fn posed(peaks: &mut [Peak], optics: &Optics, pose: &[f32; 12]) -> Vec<Point> {
    peaks.iter_mut().map(|k| one(k, optics, pose)).collect()
}

pub(in crate::stages) fn one(k: &mut Peak, optics: &Optics, pose: &[f32; 12]) -> Point {
    if !k.kept() {
        return Point::NONE;
    }
    let Some((p, sigma_mm)) = camera_point(k, optics) else {
        k.refuse(Reject::NoPoint);
        return Point::NONE;
    };
    let row = |i: usize| (pose[4 * i] * p.x + pose[4 * i + 1] * p.y) + (pose[4 * i + 2] * p.z + pose[4 * i + 3]);
    Point { position: Vec3::new(row(0), row(1), row(2)), sigma_mm }
}

/// The intersection of a peak's ray with the laser plane, and its standard deviation; camera frame, mm.
pub fn camera_point(k: &Peak, o: &Optics) -> Option<(Vec3, f32)> {
    let [fx, fy, cx, cy, skew] = o.pinhole;
    let yv = (k.v - cy) / fy;
    let xv = (k.u - cx - skew * yv) / fx;
    // Change of the ray for one pixel along the peak's normal.
    let dv = k.normal_v / fy;
    let du = (k.normal_u - skew * dv) / fx;
    let (x, y, dx, dy) = undistort([xv, yv, du, dv], o)?;
    let Vec3 { x: nx, y: ny, z: nz } = o.normal;
    let slope = nx * x + (ny * y + nz);
    let z = o.offset / slope;
    if !(slope > 1e-6 && z < 1e6) {
        return None;
    }
    // dx and dy come from the ray, dz from the plane.
    let dz = -z * (nx * dx + ny * dy) / slope;
    let (ex, ey) = (dz * x + z * dx, dz * y + z * dy);
    let per_px = (ex * ex + (ey * ey + dz * dz)).sqrt();
    Some((Vec3::new(x * z, y * z, z), per_px * k.sigma_px))
}

/// Inverts the lens by Newton's method, for a place on the sensor and a small move there: the ray, and the move of the
/// ray. `None` where the lens model folds over.
pub fn undistort([xv, yv, du, dv]: [f32; 4], o: &Optics) -> Option<(f32, f32, f32, f32)> {
    let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = o.distortion;
    let full = !o.plain();
    let (mut xd, mut yd, mut dxd, mut dyd) = (xv, yv, du, dv);
    if full {
        let t = &o.untilt;
        let w = t[6] * xv + (t[7] * yv + t[8]);
        xd = (t[0] * xv + (t[1] * yv + t[2])) / w;
        yd = (t[3] * xv + (t[4] * yv + t[5])) / w;
        dxd = ((t[0] - xd * t[6]) * du + (t[1] - xd * t[7]) * dv) / w;
        dyd = ((t[3] - yd * t[6]) * du + (t[4] - yd * t[7]) * dv) / w;
    }
    let (mut x, mut y) = (xd, yd);
    let (mut a, mut b, mut c, mut d, mut det) = (1.0, 0.0, 0.0, 1.0, 1.0);
    for _ in 0..NEWTON {
        let r2 = x * x + y * y;
        let mut radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let mut bend = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2);
        if full {
            let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
            radial /= below;
            bend = (bend - radial * (k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2))) / below;
        }
        let mut ex = (x * radial - xd) + (2.0 * p1 * (x * y) + p2 * (r2 + 2.0 * (x * x)));
        let mut ey = (y * radial - yd) + (p1 * (r2 + 2.0 * (y * y)) + 2.0 * p2 * (x * y));
        a = (radial + 2.0 * (x * x) * bend) + (2.0 * p1 * y + 6.0 * p2 * x);
        b = 2.0 * (x * y) * bend + (2.0 * p1 * x + 2.0 * p2 * y);
        c = b;
        d = (radial + 2.0 * (y * y) * bend) + (6.0 * p1 * y + 2.0 * p2 * x);
        if full {
            let px = 2.0 * (s1 + 2.0 * s2 * r2);
            let py = 2.0 * (s3 + 2.0 * s4 * r2);
            ex += r2 * (s1 + s2 * r2);
            ey += r2 * (s3 + s4 * r2);
            a += px * x;
            b += px * y;
            c += py * x;
            d += py * y;
        }
        det = a * d - b * c;
        x -= (d * ex - b * ey) / det;
        y -= (a * ey - c * ex) / det;
    }
    let (dx, dy) = ((d * dxd - b * dyd) / det, (a * dyd - c * dxd) / det);
    (det > 0.0 && a + d > 0.0 && x.abs() < 1e9 && y.abs() < 1e9).then_some((x, y, dx, dy))
}

/// The last choice of each peak, and its point; one invocation per peak.
pub const STAGE: Stage = Stage {
    name: "point",
    wgsl: include_str!("../../../shaders/point.wgsl"),
    shared: &[PEAKS, LINE_OF, listing::SHARED],
    workgroup: [64, 1, 1],
    bindings: &[
        Binding { name: "frame", access: Uniform },
        Binding { name: "header", access: Read },
        Binding { name: "poses", access: Read },
        Binding { name: "strongest", access: Texels },
        Binding { name: "peaks", access: ReadWrite },
        Binding { name: "points", access: ReadWrite },
    ],
    uniform: crate::stages::frame::uniform_fields!(PointFrame: fx, fy, cx, cy, skew, k1, k2, p1, p2, k3, k4, k5, k6,
        s1, s2, s3, s4, t0, t1, t2, t3, t4, t5, t6, t7, t8,
        normal_x, normal_y, normal_z, offset, none, lines, columns, line_px, echo_reach, echo, cut_width,
            cut_amplitude, reserved_1, reserved_2),
    overrides: &[FULL_LENS],
};

/// The shot's transform in the stage's format: three rows of rotation and translation.
pub fn pose_words<To: Frame>(to_from_camera: &Rigid<To, Camera>) -> [f32; 12] {
    let (r, t) = (&to_from_camera.rotation, &to_from_camera.translation);
    std::array::from_fn(|i| if i % 4 == 3 { t[i / 4] as f32 } else { r[(i / 4, i % 4)] as f32 })
}

pub(crate) fn stage_twin(b: &mut [Vec<u32>], _: &[(&'static str, f64)]) {
    let frame: PointFrame = *bytemuck::from_bytes(bytemuck::cast_slice(&b[0]));
    let (optics, lines) = (frame.optics(), frame.lines());
    let [_, header, poses, strongest, peaks, spots] = b else { unreachable!() };
    let (poses, n): (&[f32], usize) = (bytemuck::cast_slice(poses), header[listing::COUNT] as usize);
    let peaks: &mut [Peak] = bytemuck::cast_slice_mut(peaks);
    let spots: &mut [Point] = bytemuck::cast_slice_mut(spots);
    for (k, spot) in peaks.iter_mut().zip(spots).take(n) {
        let from = (k.shot * lines.lines) as usize;
        beside(k, &strongest[from..from + lines.lines as usize], &lines);
        let pose = std::array::from_fn(|i| poses[12 * k.shot as usize + i]);
        *spot = one(k, &optics, &pose);
    }
}

/// Largest difference of two lists of points in units of 1 um, and of sigma in units of 1 %; flags must be equal. Both
/// sides take the same f32 steps, and no sum has more than five terms. Fused multiply-adds change the result by a few
/// ulps of 500 mm (0.03 um).
pub fn apart(gpu: &[Vec<u32>], twin: &[Vec<u32>]) -> f64 {
    if gpu[4] != twin[4] {
        return f64::INFINITY;
    }
    let (a, b): (&[Point], &[Point]) = (bytemuck::cast_slice(&gpu[5]), bytemuck::cast_slice(&twin[5]));
    a.iter().zip(b).fold(0f64, |worst, (a, b)| {
        if a.sigma_mm.is_nan() && b.sigma_mm.is_nan() {
            return worst;
        }
        let d = (0..3).map(|i| f64::from((a.position[i] - b.position[i]).abs()) / 1e-3).fold(0.0, f64::max);
        let s = f64::from((a.sigma_mm - b.sigma_mm).abs() / (0.01 * b.sigma_mm).max(1e-6));
        if (d + s).is_nan() { f64::INFINITY } else { worst.max(d).max(s) }
    })
}

/// Depth z at which a pixel's ray meets the laser plane, camera frame, mm; `None` if it does not. The laser can only be
/// visible at pixels whose depth lies in the working range.
pub fn plane_in_view(camera: &Intrinsics, laser: &Plane<Camera>, x: u32, y: u32) -> Option<f64> {
    let ray = camera.ray_from_pixel(&Vec2::new(f64::from(x), f64::from(y)))?;
    Some(ray.meet(laser)?.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Distortion;
    use crate::geometry::{Base, Vec3};

    fn camera() -> Intrinsics {
        Intrinsics {
            fx: 611.6,
            fy: 611.6,
            cx: 314.962,
            cy: 232.344,
            skew: 0.0,
            distortion: [-0.118, 0.086, 0.00062, -0.00041, -0.017].into(),
            width: 640,
            height: 480,
        }
    }

    /// Lenses and sensors of all kinds, up to 15 % of barrel distortion and 15 degrees of tilt, each over its complete
    /// picture.
    fn lenses() -> Vec<Intrinsics> {
        let of = |fx: f64, terms: [f64; 14]| Intrinsics { fx, fy: fx, distortion: Distortion(terms), ..camera() };
        let mut all = vec![
            camera(),
            of(520.0, [-0.27, 0.06, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            of(611.6, [0.42, -0.21, 6e-4, -4e-4, 0.013, 0.71, -0.05, 0.027, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            of(611.6, [-0.12, 0.05, 4e-4, 9e-4, 0.01, 0.0, 0.0, 0.0, 0.004, -0.0015, -0.003, 0.0021, 0.0, 0.0]),
            of(2400.0, [-0.3, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.26, -0.1]),
            of(900.0, [0.2, -0.1, 1e-3, 1e-3, 0.0, 0.4, 0.1, 0.02, 0.002, 1e-3, -2e-3, 1e-3, -0.2, 0.26]),
        ];
        all.push(Intrinsics { skew: 1.3, ..all[5] });
        all
    }

    #[test]
    fn every_lens_is_inverted_to_a_millionth_of_a_pixel_and_the_precision_of_the_numbers() {
        let plane = Plane::new(Vec3::new(-0.019, 0.883, 0.469), 72.15).unwrap();
        for (i, camera) in lenses().iter().enumerate() {
            let optics = Optics::new(camera, &plane);
            assert_eq!(optics.plain(), i < 2);
            for v in (0..480).step_by(37) {
                for u in (0..640).step_by(29) {
                    let d = camera.normalised(&Vec2::new(f64::from(u), f64::from(v)));
                    let (x, y, dx, dy) = undistort([d.x as f32, d.y as f32, 1e-3, 2e-3], &optics).unwrap();
                    let back = |d: Vec2| camera.undistort(&d).unwrap();
                    let here = Vec2::new(f64::from(d.x as f32), f64::from(d.y as f32));
                    let exact = back(here);
                    let error_px = (Vec2::new(f64::from(x), f64::from(y)) - exact).norm() * camera.fx;
                    // f32 has a precision of 3e-8 for a ray of 0.5, which is 2e-5 px at 611 px. A few roundings may add
                    // up, and those of the tilt.
                    let roundings = if optics.plain() { 6e-5 } else { 1.2e-4 };
                    assert!(error_px < 1e-6 + roundings * camera.fx / 611.6, "lens {i} at ({u}, {v}): {error_px}");
                    let move_ = back(here + Vec2::new(1e-6, 2e-6)) - exact;
                    assert!((Vec2::new(f64::from(dx), f64::from(dy)) - move_ * 1e3).norm() < 5e-6, "{dx} {dy} {move_}");
                }
            }
        }
    }

    /// The final cost of f32: less than the last bit of a coordinate of the cloud.
    #[test]
    fn points_are_those_of_f64_to_a_twentieth_of_a_micrometre() {
        let (camera, plane) = (camera(), Plane::new(Vec3::new(-0.019, 0.883, 0.469), 72.15).unwrap());
        let optics = Optics::new(&camera, &plane);
        // The f32 values of the rig, computed with in f64: the difference is that of the arithmetic, not of rounding
        // the calibration.
        let [fx, fy, cx, cy, skew] = optics.pinhole.map(f64::from);
        let distortion = Distortion::from_opencv(&optics.distortion.map(f64::from)).unwrap();
        let exact = Intrinsics { fx, fy, cx, cy, skew, distortion, ..camera };
        let [x, y, z] = optics.normal.as_dvec3().to_array();
        let exact_plane = Plane::new(Vec3::new(x, y, z), f64::from(optics.offset)).unwrap();
        let mut worst = 0f64;
        for v in (150..480).step_by(7) {
            for u in (0..640).step_by(11) {
                let (u, v) = (u as f32 + 0.37, v as f32 + 0.61);
                let Some((p, _)) = camera_point(&Peak { u, v, ..Peak::default() }, &optics) else { continue };
                let ray = exact.ray_from_pixel(&Vec2::new(f64::from(u), f64::from(v))).unwrap();
                let truth = ray.meet(&exact_plane).unwrap();
                if truth.z < 320.0 {
                    // Error across the ray: along it, a pixel error of any size can be any length.
                    let d = Vec3::from(p.as_dvec3().to_array()) - truth;
                    worst = worst.max((d - truth.normalize() * truth.normalize().dot(&d)).norm());
                }
            }
        }
        assert!(worst > 0.0 && worst < 5e-5, "{worst} mm");
    }

    #[test]
    fn points_lie_on_the_plane_and_move_as_their_sigma_says() {
        let (camera, plane) = (camera(), Plane::new(Vec3::new(-0.019, 0.883, 0.469), 72.15).unwrap());
        let optics = Optics::new(&camera, &plane);
        let pose: Rigid<Base, Camera> = Rigid::from_vectors(&Vec3::new(0.2, -0.4, 1.1), Vec3::new(400.0, -60.0, 300.0));
        let peak = Peak { u: 200.3, v: 250.7, normal_u: 0.1, normal_v: 0.995, sigma_px: 0.05, ..Peak::default() };
        let at = |p: Peak| points(&mut [p], &optics, &pose)[0];
        let base = at(peak);
        let exact = pose.point(&camera.ray_from_pixel(&Vec2::new(200.3, 250.7)).unwrap().meet(&plane).unwrap());
        assert!((Vec3::from(base.position.as_dvec3().to_array()) - exact).norm() < 2e-4);
        let moved = at(Peak { u: peak.u + 0.1, v: peak.v + 0.995, ..peak });
        let per_px = (Vec3::from(moved.position.as_dvec3().to_array()) - exact).norm();
        assert!((f64::from(base.sigma_mm) / (0.05 * per_px) - 1.0).abs() < 0.005, "{} {per_px}", base.sigma_mm);
    }

    #[test]
    fn a_ray_along_the_plane_has_no_point() {
        let plane = Plane::new(Vec3::new(0.0, 1.0, 0.0), 50.0).unwrap();
        let optics = Optics::new(&camera(), &plane);
        let pose: Rigid<Base, Camera> = Rigid::identity();
        let mut peaks =
            [Peak { u: 315.0, v: 100.0, ..Peak::default() }, Peak { u: 315.0, v: 400.0, ..Peak::default() }];
        let found = points(&mut peaks, &optics, &pose);
        assert!(found[0].sigma_mm.is_nan() && peaks[0].reject() == Reject::NoPoint);
        assert!((found[1].position[1] - 50.0).abs() < 1e-3 && peaks[1].kept());
    }
}
