//! In: chosen peaks, the camera, the laser plane, the shot's pose. Out: points with their standard deviation. The stage
//! also makes the last choice: it rejects peaks that are weak beside another. Frame and unit: the frame that the given
//! transform leads to (base or grid), mm. docs/math.md, Stripe peak (7), (8).

use super::choose::{LINE_OF, beside};
use super::optics::{PointFrame, meet};
use crate::camera::Intrinsics;
use crate::geometry::{Camera, Frame, Plane, Rigid, Vec2};
use crate::gpu::Access::*;
use crate::gpu::{Binding, Stage};
use crate::stages::listing;
use crate::stages::peak::SHARED as PEAKS;
use crate::stages::peak::found::{Peak, Reject};
use crate::stages::peak::lanes::{LANES, Lanes};
use glam::Vec3;
use multiversion::multiversion;
use std::array::from_fn;

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

/// CPU twin: one point per peak; peaks without a point get [`Reject::NoPoint`].
pub fn points<To: Frame>(peaks: &mut [Peak], optics: &Optics, to_from_camera: &Rigid<To, Camera>) -> Vec<Point> {
    posed(peaks, optics, &pose_words(to_from_camera))
}

/// The same with the transform in the format of [`pose_words`].
pub fn posed(peaks: &mut [Peak], optics: &Optics, pose: &[f32; 12]) -> Vec<Point> {
    let mut points = vec![Point::NONE; peaks.len()];
    put(peaks, optics, pose, &mut points);
    points
}

/// Writes each peak's point to its place in `points`, which holds [`Point::NONE`] before. Compiled for several
/// instruction sets; all of them round in the same way.
#[multiversion(targets = "simd")]
pub(in crate::stages) fn put(peaks: &mut [Peak], optics: &Optics, pose: &[f32; 12], points: &mut [Point]) {
    let row = |i: usize, [x, y, z]: [Lanes; 3]| {
        let pose: [Lanes; 4] = from_fn(|k| Lanes::all(pose[4 * i + k]));
        (pose[0] * x + pose[1] * y) + (pose[2] * z + pose[3])
    };
    for (peaks, points) in peaks.chunks_mut(LANES).zip(points.chunks_mut(LANES)) {
        let of = |value: fn(&Peak) -> f32| Lanes(from_fn(|lane| peaks.get(lane).map_or(0.0, value)));
        let (place, normal) = ([of(|k| k.u), of(|k| k.v)], [of(|k| k.normal_u), of(|k| k.normal_v)]);
        let met = meet(place, normal, optics);
        let (there, sigma) = (from_fn::<_, 3, _>(|i| row(i, met.at)), met.per_px * of(|k| k.sigma_px));
        for (lane, (k, point)) in peaks.iter_mut().zip(points).enumerate() {
            if !k.kept() {
                continue;
            }
            if met.is[lane] {
                *point = Point { position: there.map(|x| x.0[lane]).into(), sigma_mm: sigma.0[lane] };
            } else {
                k.refuse(Reject::NoPoint);
            }
        }
    }
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
    from_fn(|i| if i % 4 == 3 { t[i / 4] as f32 } else { r[(i / 4, i % 4)] as f32 })
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
        let pose = from_fn(|i| poses[12 * k.shot as usize + i]);
        *spot = Point::NONE;
        put(std::slice::from_mut(k), &optics, &pose, std::slice::from_mut(spot));
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
        let (mut worst, here) = (0f64, Rigid::<Camera, Camera>::identity());
        for v in (150..480).step_by(7) {
            for u in (0..640).step_by(11) {
                let (u, v) = (u as f32 + 0.37, v as f32 + 0.61);
                let p = points(&mut [Peak { u, v, ..Peak::default() }], &optics, &here)[0].position;
                if p.x.is_nan() {
                    continue;
                }
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
