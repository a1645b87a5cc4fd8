//! In: intrinsics, a camera-frame point. Out: its pixel and the derivatives by the point and by
//! every intrinsic parameter (docs/math.md, Camera calibration (1) to (3)).
//! Frame and unit: camera frame, mm; pixels. Parameter order: fx fy cx cy k1 k2 p1 p2 k3 skew.

use crate::camera::Intrinsics;
use crate::geometry::{Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3, SMatrix};

/// Number of intrinsic parameters, skew included.
pub const INTRINSICS: usize = 10;
/// Their names with units, in order.
pub const NAMES: [&str; INTRINSICS] = ["fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3", "skew_px"];

/// A pixel with its derivatives.
pub struct Projected {
    pub pixel: Vec2,
    pub by_point: Matrix2x3<f64>,
    pub by_intrinsics: SMatrix<f64, 2, INTRINSICS>,
}

/// `None` for points behind the camera.
pub fn project(k: &Intrinsics, p: &Vec3) -> Option<Projected> {
    if p.z <= 0.0 {
        return None;
    }
    let n = Vec2::new(p.x / p.z, p.y / p.z);
    let d = k.distort(&n);
    let lens = k.distort_jacobian(&n);
    let pinhole = Matrix2::new(k.fx, k.skew, 0.0, k.fy);
    let by_normalised = pinhole * lens;
    let (iz, x, y) = (1.0 / p.z, n.x, n.y);
    let by_point = by_normalised * Matrix2x3::new(iz, 0.0, -x * iz, 0.0, iz, -y * iz);
    let r2 = x * x + y * y;
    // Derivatives of the distorted coordinates by k1 k2 p1 p2 k3.
    let by_lens = SMatrix::<f64, 2, 5>::new(
        x * r2,
        x * r2 * r2,
        2.0 * x * y,
        r2 + 2.0 * x * x,
        x * r2 * r2 * r2,
        y * r2,
        y * r2 * r2,
        r2 + 2.0 * y * y,
        2.0 * x * y,
        y * r2 * r2 * r2,
    );
    let mut by_intrinsics = SMatrix::<f64, 2, INTRINSICS>::zeros();
    by_intrinsics[(0, 0)] = d.x;
    by_intrinsics[(1, 1)] = d.y;
    by_intrinsics[(0, 2)] = 1.0;
    by_intrinsics[(1, 3)] = 1.0;
    by_intrinsics.fixed_view_mut::<2, 5>(0, 4).copy_from(&(pinhole * by_lens));
    by_intrinsics[(0, 9)] = d.y;
    Some(Projected { pixel: k.pixel_from_normalised(&n), by_point, by_intrinsics })
}

/// The parameters in order.
pub fn to_vector(k: &Intrinsics) -> [f64; INTRINSICS] {
    let [k1, k2, p1, p2, k3] = k.distortion;
    [k.fx, k.fy, k.cx, k.cy, k1, k2, p1, p2, k3, k.skew]
}

/// The camera with parameters `v`; size from `like`.
pub fn from_vector(v: &[f64; INTRINSICS], like: &Intrinsics) -> Intrinsics {
    Intrinsics {
        fx: v[0],
        fy: v[1],
        cx: v[2],
        cy: v[3],
        skew: v[9],
        distortion: [v[4], v[5], v[6], v[7], v[8]],
        width: like.width,
        height: like.height,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_derivatives() {
        let k = Intrinsics {
            fx: 611.0,
            fy: 605.0,
            cx: 314.0,
            cy: 232.0,
            skew: 0.7,
            distortion: [-0.12, 0.09, 0.0006, -0.0004, -0.02],
            width: 640,
            height: 480,
        };
        let p = Vec3::new(55.0, -32.0, 160.0);
        let here = project(&k, &p).unwrap();
        for i in 0..3 {
            let mut e = Vec3::zeros();
            e[i] = 1e-4;
            let d = (project(&k, &(p + e)).unwrap().pixel - project(&k, &(p - e)).unwrap().pixel) / 2e-4;
            assert!((d - here.by_point.column(i)).norm() < 1e-6);
        }
        for i in 0..INTRINSICS {
            let (mut up, mut down) = (to_vector(&k), to_vector(&k));
            up[i] += 1e-5;
            down[i] -= 1e-5;
            let at = |v| project(&from_vector(v, &k), &p).unwrap().pixel;
            assert!(((at(&up) - at(&down)) / 2e-5 - here.by_intrinsics.column(i)).norm() < 1e-6, "{}", NAMES[i]);
        }
    }
}
