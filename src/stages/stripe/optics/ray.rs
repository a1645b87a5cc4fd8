//! In: places in a picture side by side, the camera, the laser plane. Out: where their rays meet the plane. Frame and
//! unit: px; camera frame, mm. docs/math.md, Stripe peak (7).

use super::Optics;
use crate::stages::peak::lanes::{LANES, Lanes};
use std::array::from_fn;

/// Newton steps of the lens inversion. The first error is the distortion itself, at most 0.2, and each step squares it.
/// Five steps therefore leave less than 1e-6 px for every lens whose distortion is monotonic over the picture.
pub(in crate::stages) const NEWTON: u32 = 5;

/// The points on the laser plane, and the lanes in which there is one.
pub(in crate::stages::stripe) struct Met {
    pub at: [Lanes; 3],
    /// Way of the point for one pixel along the peak's normal.
    pub per_px: Lanes,
    pub is: [bool; LANES],
}

/// Where the rays of places u, v meet the laser plane; `normal` points along the peaks' normals.
#[inline(always)]
pub(in crate::stages::stripe) fn meet([u, v]: [Lanes; 2], [normal_u, normal_v]: [Lanes; 2], o: &Optics) -> Met {
    let [fx, fy, cx, cy, skew] = o.pinhole.map(Lanes::all);
    let yv = (v - cy) / fy;
    let xv = (u - cx - skew * yv) / fx;
    // Change of the ray for one pixel along the peak's normal.
    let dv = normal_v / fy;
    let du = (normal_u - skew * dv) / fx;
    let ([x, y], [dx, dy], is) = undistort([xv, yv], [du, dv], o);
    let [nx, ny, nz] = o.normal.to_array().map(Lanes::all);
    let slope = nx * x + (ny * y + nz);
    let z = Lanes::all(o.offset) / slope;
    let is = from_fn(|lane| is[lane] && slope.0[lane] > 1e-6 && z.0[lane] < 1e6);
    // dx and dy come from the ray, dz from the plane.
    let dz = -z * (nx * dx + ny * dy) / slope;
    let (ex, ey) = (dz * x + z * dx, dz * y + z * dy);
    let per_px = (ex * ex + (ey * ey + dz * dz)).sqrt();
    Met { at: [x * z, y * z, z], per_px, is }
}

/// Inverts the lens by Newton's method, for places on the sensor and a small move at each: the rays, the moves of the
/// rays, and the lanes in which the lens model does not fold over.
#[inline(always)]
fn undistort([xv, yv]: [Lanes; 2], [du, dv]: [Lanes; 2], o: &Optics) -> ([Lanes; 2], [Lanes; 2], [bool; LANES]) {
    let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = o.distortion.map(Lanes::all);
    let (one, full) = (Lanes::all(1.0), !o.plain());
    let (mut xd, mut yd, mut dxd, mut dyd) = (xv, yv, du, dv);
    if full {
        let t = &o.untilt.map(Lanes::all);
        let w = t[6] * xv + (t[7] * yv + t[8]);
        xd = (t[0] * xv + (t[1] * yv + t[2])) / w;
        yd = (t[3] * xv + (t[4] * yv + t[5])) / w;
        dxd = ((t[0] - xd * t[6]) * du + (t[1] - xd * t[7]) * dv) / w;
        dyd = ((t[3] - yd * t[6]) * du + (t[4] - yd * t[7]) * dv) / w;
    }
    let (mut x, mut y) = (xd, yd);
    let (mut a, mut b, mut c, mut d, mut det) = (one, Lanes::ZERO, Lanes::ZERO, one, one);
    for _ in 0..NEWTON {
        let r2 = x * x + y * y;
        let mut radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let mut bend = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2);
        if full {
            let below = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
            radial = radial / below;
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
            ex = ex + r2 * (s1 + s2 * r2);
            ey = ey + r2 * (s3 + s4 * r2);
            a = a + px * x;
            b = b + px * y;
            c = c + py * x;
            d = d + py * y;
        }
        det = a * d - b * c;
        x = x - (d * ex - b * ey) / det;
        y = y - (a * ey - c * ex) / det;
    }
    let moved = [(d * dxd - b * dyd) / det, (a * dyd - c * dxd) / det];
    let whole = |lane: usize| det.0[lane] > 0.0 && a.0[lane] + d.0[lane] > 0.0;
    let near = |lane: usize| x.0[lane].abs() < 1e9 && y.0[lane].abs() < 1e9;
    ([x, y], moved, from_fn(|lane| whole(lane) && near(lane)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, Intrinsics};
    use crate::geometry::{Plane, Vec2, Vec3};

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
                    let lanes = |x: f64| Lanes::all(x as f32);
                    let (at, moved, is) = undistort([lanes(d.x), lanes(d.y)], [lanes(1e-3), lanes(2e-3)], &optics);
                    assert_eq!(is, [true; LANES]);
                    let ([x, y], [dx, dy]) = (at.map(|x| x.0[7]), moved.map(|x| x.0[7]));
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
}
