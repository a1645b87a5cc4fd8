//! In: a pinhole camera with Brown-Conrady distortion. Out: pixels of camera-frame points and
//! viewing rays of pixels (docs/math.md eq. 4 to 7; the paper's eq. 1 with the lens added).
//! Frame and unit: camera frame (x right, y down, z forward), mm; an integer pixel is a pixel centre.

use crate::fault::{Fault, Result};
use crate::geometry::{Camera as CameraFrame, Ray, Vec2, Vec3};
use nalgebra::Matrix2;

/// Pinhole camera with lens. `distortion` is k1 k2 p1 p2 k3 in OpenCV's order and convention.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
    /// Focal lengths, px.
    pub fx: f64,
    pub fy: f64,
    /// Principal point, px.
    pub cx: f64,
    pub cy: f64,
    /// px of u per normalised y; 0 for every sensor with square rows.
    #[serde(default)]
    pub skew: f64,
    #[serde(rename = "distortion_k1_k2_p1_p2_k3")]
    pub distortion: [f64; 5],
    /// Sensor size, px.
    pub width: u32,
    pub height: u32,
}

impl Intrinsics {
    /// Refuses numbers that no camera has.
    pub fn check(&self) -> Result<()> {
        let all = [self.fx, self.fy, self.cx, self.cy, self.skew];
        let finite = all.iter().chain(&self.distortion).all(|x| x.is_finite());
        if !finite || self.fx <= 0.0 || self.fy <= 0.0 || self.width == 0 || self.height == 0 {
            return Err(Fault::input(format!(
                "intrinsics fx {} fy {} cx {} cy {} for {}x{} are no camera",
                self.fx, self.fy, self.cx, self.cy, self.width, self.height
            ))
            .cause("a hand-edited calibration file")
            .next("calibrate the camera again"));
        }
        Ok(())
    }

    /// Longer side of what is seen at a depth, mm; the lens left out.
    pub fn view_mm(&self, depth: f64) -> f64 {
        depth.abs() * f64::max(f64::from(self.width) / self.fx, f64::from(self.height) / self.fy)
    }

    /// Ideal normalised coordinates to distorted ones.
    pub fn distort(&self, n: &Vec2) -> Vec2 {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (x, y) = (n.x, n.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        Vec2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        )
    }

    /// d(distorted)/d(ideal), row-major 2x2.
    pub fn distort_jacobian(&self, n: &Vec2) -> Matrix2<f64> {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (x, y) = (n.x, n.y);
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let slope = k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2);
        let cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        Matrix2::new(
            radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
            cross,
            cross,
            radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
        )
    }

    /// Distorted normalised coordinates to ideal ones by Newton's method, to 1e-12.
    /// `None` outside the region where the lens model can be inverted.
    pub fn undistort(&self, d: &Vec2) -> Option<Vec2> {
        let mut n = *d;
        for _ in 0..50 {
            let step = self.distort_jacobian(&n).try_inverse()? * (self.distort(&n) - d);
            n -= step;
            if !n.x.is_finite() || !n.y.is_finite() {
                return None;
            }
            if step.norm() < 1e-14 {
                break;
            }
        }
        ((self.distort(&n) - d).norm() < 1e-12 && self.distort_jacobian(&n).determinant() > 0.0).then_some(n)
    }

    /// Pixel to distorted normalised coordinates (K⁻¹·(u, v, 1)).
    pub fn normalised(&self, px: &Vec2) -> Vec2 {
        let y = (px.y - self.cy) / self.fy;
        Vec2::new((px.x - self.cx - self.skew * y) / self.fx, y)
    }

    /// Pixel of a camera-frame point; `None` behind the camera.
    pub fn pixel_from_point(&self, p: &Vec3) -> Option<Vec2> {
        (p.z > 0.0).then(|| self.pixel_from_normalised(&Vec2::new(p.x / p.z, p.y / p.z)))
    }

    /// Pixel of ideal normalised coordinates.
    pub fn pixel_from_normalised(&self, n: &Vec2) -> Vec2 {
        let d = self.distort(n);
        Vec2::new(self.fx * d.x + self.skew * d.y + self.cx, self.fy * d.y + self.cy)
    }

    /// Ideal normalised coordinates (x/z, y/z) of a pixel.
    pub fn normalised_from_pixel(&self, px: &Vec2) -> Option<Vec2> {
        self.undistort(&self.normalised(px))
    }

    /// Viewing ray of a pixel, from the centre of projection.
    pub fn ray_from_pixel(&self, px: &Vec2) -> Option<Ray<CameraFrame>> {
        let n = self.normalised_from_pixel(px)?;
        Ray::new(Vec3::zeros(), Vec3::new(n.x, n.y, 1.0))
    }

    /// The same lens and field of view on a sensor with `width` pixels across; for sensors that
    /// bin or for a calibration taken at another resolution.
    pub fn scaled_to(&self, width: u32, height: u32) -> Intrinsics {
        let (sx, sy) = (f64::from(width) / f64::from(self.width), f64::from(height) / f64::from(self.height));
        Intrinsics {
            fx: self.fx * sx,
            fy: self.fy * sy,
            cx: (self.cx + 0.5) * sx - 0.5,
            cy: (self.cy + 0.5) * sy - 0.5,
            skew: self.skew * sx,
            width,
            height,
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The paper's camera with a lens like the ones of the reference rigs.
    fn paper() -> Intrinsics {
        Intrinsics {
            fx: 611.6,
            fy: 611.6,
            cx: 314.962,
            cy: 232.344,
            skew: 0.0,
            distortion: [-0.118, 0.086, 0.00062, -0.00041, -0.017],
            width: 640,
            height: 480,
        }
    }

    proptest! {
        #[test]
        fn a_ray_projects_back_to_its_pixel(u in -0.5f64..639.5, v in -0.5f64..479.5, z in 50.0f64..500.0) {
            let cam = paper();
            let ray = cam.ray_from_pixel(&Vec2::new(u, v)).unwrap();
            let back = cam.pixel_from_point(&(ray.direction * z)).unwrap();
            prop_assert!((back - Vec2::new(u, v)).norm() < 1e-9);
        }
        #[test]
        fn the_jacobian_is_the_derivative(x in -0.6f64..0.6, y in -0.5f64..0.5) {
            let (cam, n, h) = (paper(), Vec2::new(x, y), 1e-6);
            let j = cam.distort_jacobian(&n);
            for c in 0..2 {
                let mut e = Vec2::zeros();
                e[c] = h;
                let d = (cam.distort(&(n + e)) - cam.distort(&(n - e))) / (2.0 * h);
                prop_assert!((d - j.column(c)).norm() < 1e-8);
            }
        }
    }

    #[test]
    fn scaling_keeps_the_field_of_view() {
        let (a, b) = (paper(), paper().scaled_to(4096, 3072));
        // The outer edge of the first pixel is at -0.5 at any resolution.
        let (ra, rb) =
            (a.ray_from_pixel(&Vec2::new(-0.5, -0.5)).unwrap(), b.ray_from_pixel(&Vec2::new(-0.5, -0.5)).unwrap());
        assert!((ra.direction - rb.direction).norm() < 1e-12);
    }
}
