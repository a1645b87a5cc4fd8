//! In: intrinsics, a camera-frame point. Out: its pixel and the derivatives by the point and by
//! every intrinsic parameter (docs/math.md, Camera calibration (1) to (3)).
//! Frame and unit: camera frame, mm; pixels. Parameters in the order of `camera::NAMES`.

use crate::camera::{Intrinsics, LENS, PARAMETERS, SKEW, TERMS};
use crate::geometry::{Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3, SMatrix};

/// A pixel with its derivatives.
pub struct Projected {
    /// Pixel at which the point is seen, px.
    pub pixel: Vec2,
    /// px per mm: rows u, v; columns x, y, z of the camera frame.
    pub by_point: Matrix2x3<f64>,
    /// px per unit of each parameter: rows u, v; columns in the order of [`crate::camera::NAMES`].
    pub by_intrinsics: SMatrix<f64, 2, PARAMETERS>,
}

/// `None` for points behind the camera and for points that the lens model cannot project.
pub fn project(k: &Intrinsics, p: &Vec3) -> Option<Projected> {
    if p.z <= 0.0 {
        return None;
    }
    let n = Vec2::new(p.x / p.z, p.y / p.z);
    let d = k.distort(&n);
    let lens = k.distort_jacobian(&n);
    if !(d.x.is_finite() && lens.m11.is_finite()) {
        return None;
    }
    let pinhole = Matrix2::new(k.fx, k.skew, 0.0, k.fy);
    let by_normalised = pinhole * lens;
    let (iz, x, y) = (1.0 / p.z, n.x, n.y);
    let by_point = by_normalised * Matrix2x3::new(iz, 0.0, -x * iz, 0.0, iz, -y * iz);
    let mut by_intrinsics = SMatrix::<f64, 2, PARAMETERS>::zeros();
    by_intrinsics[(0, 0)] = d.x;
    by_intrinsics[(1, 1)] = d.y;
    by_intrinsics[(0, 2)] = 1.0;
    by_intrinsics[(1, 3)] = 1.0;
    by_intrinsics.fixed_view_mut::<2, TERMS>(0, LENS).copy_from(&(pinhole * k.distortion.by_terms(&n)));
    by_intrinsics[(0, SKEW)] = d.y;
    Some(Projected { pixel: k.pixel_from_normalised(&n), by_point, by_intrinsics })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Distortion, NAMES, Parameters};

    #[test]
    fn derivatives_are_derivatives() {
        let k = Intrinsics {
            fx: 611.0,
            fy: 605.0,
            cx: 314.0,
            cy: 232.0,
            skew: 0.7,
            distortion: Distortion([
                0.12, 0.09, 0.0006, -0.0004, -0.02, 0.3, 0.05, 0.01, 0.002, -0.001, 0.003, 0.001, 0.1, -0.2,
            ]),
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
        for (i, name) in NAMES.iter().enumerate() {
            let mut e = Parameters::zeros();
            e[i] = 1e-5;
            let at = |e| project(&k.changed(&e), &p).unwrap().pixel;
            assert!(((at(e) - at(-e)) / 2e-5 - here.by_intrinsics.column(i)).norm() < 1e-6, "{name}");
        }
    }
}
