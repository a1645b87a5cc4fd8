//! In: a pinhole camera with its lens. Out: pixels of camera-frame points and viewing rays of pixels (docs/math.md
//! eq. 4 to 8; the paper's eq. 1 with the lens added); the representation in files.
//! Frame and unit: camera frame (x right, y down, z forward), mm; an integer pixel is a pixel centre.

use super::distortion::Distortion;
use crate::fault::{Fault, Result};
use crate::geometry::{Camera as CameraFrame, Ray, Vec2, Vec3};
use nalgebra::Matrix2;

/// Pinhole camera with lens.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "Written", into = "Written")]
pub struct Intrinsics {
    /// Focal length along u: px of u per normalised x.
    pub fx: f64,
    /// Focal length along v: px of v per normalised y.
    pub fy: f64,
    /// Column of the principal point, px; 0 is the middle of the leftmost column.
    pub cx: f64,
    /// Row of the principal point, px; 0 is the middle of the topmost row.
    pub cy: f64,
    /// px of u per normalised y; 0 for a sensor whose rows and columns are perpendicular.
    pub skew: f64,
    /// The lens: fourteen terms in OpenCV's order.
    pub distortion: Distortion,
    /// Columns of the sensor, px.
    pub width: u32,
    /// Rows of the sensor, px.
    pub height: u32,
}

impl Intrinsics {
    /// Refuses numbers that no camera can have.
    pub fn check(&self) -> Result<()> {
        let all = [self.fx, self.fy, self.cx, self.cy, self.skew];
        let finite = all.iter().chain(&self.distortion.0).all(|x| x.is_finite());
        if !finite || self.fx <= 0.0 || self.fy <= 0.0 || self.width == 0 || self.height == 0 {
            return Err(Fault::input(format!(
                "intrinsics fx {} fy {} cx {} cy {} for {}x{} are no camera",
                self.fx, self.fy, self.cx, self.cy, self.width, self.height
            ))
            .cause("a hand-edited calibration file")
            .next("calibrate the camera again"));
        }
        let [.., tau_x, tau_y] = self.distortion.0;
        if tau_x.abs().max(tau_y.abs()) > 1.0 {
            return Err(Fault::input(format!(
                "the sensor is tilted by tau_x {tau_x} and tau_y {tau_y} rad, 1 rad (57 degrees) is the limit"
            ))
            .cause("degrees in the place of radians, or another order of the lens's terms")
            .next("give tau_x and tau_y in rad, last of OpenCV's 14 terms"));
        }
        Ok(())
    }

    /// Longer side of the field of view at a depth, mm; lens distortion is ignored.
    pub fn view_mm(&self, depth: f64) -> f64 {
        depth.abs() * f64::max(f64::from(self.width) / self.fx, f64::from(self.height) / self.fy)
    }

    /// Ideal normalised coordinates to distorted ones.
    pub fn distort(&self, n: &Vec2) -> Vec2 {
        self.distortion.distort(n)
    }

    /// d(distorted)/d(ideal).
    pub fn distort_jacobian(&self, n: &Vec2) -> Matrix2<f64> {
        self.distortion.jacobian(n)
    }

    /// Distorted normalised coordinates to ideal ones. `None` outside the region where the lens model can be inverted.
    pub fn undistort(&self, d: &Vec2) -> Option<Vec2> {
        self.distortion.undistort(d)
    }

    /// Pixel to distorted normalised coordinates (K⁻¹·(u, v, 1)).
    pub fn normalised(&self, px: &Vec2) -> Vec2 {
        let y = (px.y - self.cy) / self.fy;
        Vec2::new((px.x - self.cx - self.skew * y) / self.fx, y)
    }

    /// Pixel of a camera-frame point; `None` behind the camera, or behind a tilted sensor.
    pub fn pixel_from_point(&self, p: &Vec3) -> Option<Vec2> {
        let pixel = (p.z > 0.0).then(|| self.pixel_from_normalised(&Vec2::new(p.x / p.z, p.y / p.z)))?;
        pixel.x.is_finite().then_some(pixel)
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

    /// Where the lens model folds back inside the picture: the pixel nearest to the principal point on its way to one
    /// of the corners and the middles of the sides. `None` if the lens can be inverted at all of these.
    pub fn fold(&self) -> Option<Vec2> {
        const ENDS: [[f64; 2]; 8] =
            [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.5, 0.0], [0.5, 1.0], [0.0, 0.5], [1.0, 0.5]];
        let axis = Vec2::new(self.cx, self.cy);
        let seen = |px: &Vec2| self.normalised_from_pixel(px).is_some();
        let edge = |end: Vec2| {
            let (mut inside, mut beyond) = (axis, end);
            // To a thousandth of a pixel of pictures up to 60000 pixels wide.
            for _ in 0..26 {
                let middle = (inside + beyond) / 2.0;
                if seen(&middle) { inside = middle } else { beyond = middle }
            }
            inside
        };
        ENDS.into_iter()
            .map(|[x, y]| Vec2::new(x * f64::from(self.width) - 0.5, y * f64::from(self.height) - 0.5))
            .filter(|end| !seen(end))
            .map(edge)
            .min_by(|a, b| (a - axis).norm().total_cmp(&(b - axis).norm()))
    }

    /// Viewing ray of a pixel, from the centre of projection.
    pub fn ray_from_pixel(&self, px: &Vec2) -> Option<Ray<CameraFrame>> {
        let n = self.normalised_from_pixel(px)?;
        Ray::new(Vec3::zeros(), Vec3::new(n.x, n.y, 1.0))
    }

    /// The same lens and field of view on a sensor of `width` by `height` pixels; for sensors that bin, or for a
    /// calibration taken at another resolution. The lens's terms, including tilt, act on rays and stay.
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

    /// The same camera with only a part of its sensor read out, starting at pixel (left, top).
    pub fn region(&self, left: f64, top: f64, width: u32, height: u32) -> Intrinsics {
        Intrinsics { cx: self.cx - left, cy: self.cy - top, width, height, ..*self }
    }
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    #[serde(default)]
    skew: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion_k1_k2_p1_p2_k3: Option<[f64; 5]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    distortion_opencv: Option<Vec<f64>>,
    width: u32,
    height: u32,
}

impl From<Intrinsics> for Written {
    fn from(k: Intrinsics) -> Written {
        let d = k.distortion;
        let brown = d.is_brown().then(|| [d[0], d[1], d[2], d[3], d[4]]);
        Written {
            fx: k.fx,
            fy: k.fy,
            cx: k.cx,
            cy: k.cy,
            skew: k.skew,
            distortion_opencv: brown.is_none().then(|| d.to_opencv().to_vec()),
            distortion_k1_k2_p1_p2_k3: brown,
            width: k.width,
            height: k.height,
        }
    }
}

impl TryFrom<Written> for Intrinsics {
    type Error = String;
    fn try_from(w: Written) -> std::result::Result<Intrinsics, String> {
        let distortion = match (w.distortion_k1_k2_p1_p2_k3, w.distortion_opencv) {
            (Some(brown), None) => brown.into(),
            (None, Some(terms)) => Distortion::from_opencv(&terms).ok_or_else(|| {
                format!("distortion_opencv has {} terms; OpenCV's lists have 4, 5, 8, 12 or 14", terms.len())
            })?,
            (None, None) => return Err("neither distortion_k1_k2_p1_p2_k3 nor distortion_opencv is there".into()),
            (Some(_), Some(_)) => {
                return Err("distortion_k1_k2_p1_p2_k3 and distortion_opencv are both there; which is meant?".into());
            }
        };
        let Written { fx, fy, cx, cy, skew, width, height, .. } = w;
        Ok(Intrinsics { fx, fy, cx, cy, skew, distortion, width, height })
    }
}
