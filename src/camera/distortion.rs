//! In: a lens's fourteen terms in OpenCV's order. Out: where a ray lands on the sensor, the derivatives, and the
//! inverse mapping (docs/math.md, Camera (5) to (8)).
//! Frame and unit: ideal normalised image coordinates (x/z, y/z), and those after distortion by the lens and a
//! tilted sensor; tau in rad.

use crate::geometry::{Mat3, Vec2, Vec3};
use nalgebra::{Matrix2, SMatrix};

/// Number of terms.
pub const TERMS: usize = 14;

/// k1 k2 p1 p2 k3 (Brown-Conrady), k4 k5 k6 (rational), s1 s2 s3 s4 (thin prism), tau_x tau_y (tilted sensor) in
/// OpenCV's order, signs and units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion(pub [f64; TERMS]);

impl From<[f64; 5]> for Distortion {
    /// From k1 k2 p1 p2 k3; the other terms are zero.
    fn from(brown: [f64; 5]) -> Distortion {
        Distortion(std::array::from_fn(|i| brown.get(i).copied().unwrap_or(0.0)))
    }
}

impl std::ops::Index<usize> for Distortion {
    type Output = f64;
    fn index(&self, term: usize) -> &f64 {
        &self.0[term]
    }
}

/// The radial factor N / D and its derivative with respect to r².
struct Radial {
    factor: f64,
    slope: f64,
    denominator: f64,
}

impl Distortion {
    /// From a list as OpenCV writes it: 4, 5, 8, 12 or 14 terms.
    pub fn from_opencv(terms: &[f64]) -> Option<Distortion> {
        let known = matches!(terms.len(), 4 | 5 | 8 | 12 | 14);
        known.then(|| Distortion(std::array::from_fn(|i| terms.get(i).copied().unwrap_or(0.0))))
    }

    /// The shortest list that OpenCV reads (5, 8, 12, 14) and that contains all nonzero terms.
    pub fn to_opencv(&self) -> &[f64] {
        let used = self.0.iter().rposition(|t| *t != 0.0).map_or(0, |i| i + 1);
        let length = [5, 8, 12, 14].into_iter().find(|n| *n >= used).unwrap_or(TERMS);
        &self.0[..length]
    }

    /// Whether only k1 k2 p1 p2 k3 distort a ray.
    pub fn is_brown(&self) -> bool {
        self.to_opencv().len() == 5
    }

    fn radial(&self, r2: f64) -> Radial {
        let [k1, k2, _, _, k3, k4, k5, k6, ..] = self.0;
        let denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
        // Beyond a pole the lens forms no image. NaN keeps a solver that tries such a lens from accepting it.
        let numerator = if denominator > 0.0 { 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)) } else { f64::NAN };
        let factor = numerator / denominator;
        let falls = k4 + r2 * (2.0 * k5 + 3.0 * k6 * r2);
        let slope = (k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2) - factor * falls) / denominator;
        Radial { factor, slope, denominator }
    }

    /// The distortion of the lens without the sensor's tilt; NaN beyond a pole of the rational factor.
    fn bent(&self, n: &Vec2) -> Vec2 {
        let [_, _, p1, p2, _, _, _, _, s1, s2, s3, s4, ..] = self.0;
        let (x, y) = (n.x, n.y);
        let r2 = x * x + y * y;
        let l = self.radial(r2).factor;
        Vec2::new(
            x * l + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + s2 * r2),
            y * l + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + s4 * r2),
        )
    }

    /// d(bent)/d(ideal); NaN beyond a pole of the rational factor.
    fn bent_jacobian(&self, n: &Vec2) -> Matrix2<f64> {
        let [_, _, p1, p2, _, _, _, _, s1, s2, s3, s4, ..] = self.0;
        let (x, y) = (n.x, n.y);
        let r2 = x * x + y * y;
        let Radial { factor, slope, .. } = self.radial(r2);
        let cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let (px, py) = (2.0 * (s1 + 2.0 * s2 * r2), 2.0 * (s3 + 2.0 * s4 * r2));
        Matrix2::new(
            factor + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x + px * x,
            cross + px * y,
            cross + py * x,
            factor + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x + py * y,
        )
    }

    /// Mapping from the untilted image plane to the tilted sensor, and its derivatives with respect to tau_x and
    /// tau_y.
    pub fn tilt(&self) -> Option<[Mat3; 3]> {
        let [.., tau_x, tau_y] = self.0;
        if tau_x == 0.0 && tau_y == 0.0 {
            return None;
        }
        Some(tilt(tau_x, tau_y))
    }

    /// Ideal normalised coordinates to those on the sensor.
    pub fn distort(&self, n: &Vec2) -> Vec2 {
        let bent = self.bent(n);
        self.tilt().map_or(bent, |t| projected(&t[0], &bent))
    }

    /// d(distorted)/d(ideal).
    pub fn jacobian(&self, n: &Vec2) -> Matrix2<f64> {
        let bent = self.bent_jacobian(n);
        self.tilt().map_or(bent, |t| projected_jacobian(&t[0], &self.bent(n)) * bent)
    }

    /// d(distorted)/d(terms).
    pub fn by_terms(&self, n: &Vec2) -> SMatrix<f64, 2, TERMS> {
        let (x, y) = (n.x, n.y);
        let r2 = x * x + y * y;
        let Radial { factor, denominator, .. } = self.radial(r2);
        let mut by = SMatrix::<f64, 2, TERMS>::zeros();
        let radial = |power: i32| r2.powi(power) / denominator;
        let columns = [(0, radial(1)), (1, radial(2)), (4, radial(3))];
        let below = [(5, -factor * radial(1)), (6, -factor * radial(2)), (7, -factor * radial(3))];
        for (term, d) in columns.into_iter().chain(below) {
            by.set_column(term, &Vec2::new(x * d, y * d));
        }
        by.set_column(2, &Vec2::new(2.0 * x * y, r2 + 2.0 * y * y));
        by.set_column(3, &Vec2::new(r2 + 2.0 * x * x, 2.0 * x * y));
        (by[(0, 8)], by[(0, 9)], by[(1, 10)], by[(1, 11)]) = (r2, r2 * r2, r2, r2 * r2);
        let bent = self.bent(n);
        let [whole, by_x, by_y] = tilt(self.0[12], self.0[13]);
        by = projected_jacobian(&whole, &bent) * by;
        let (v, at) = (whole * Vec3::new(bent.x, bent.y, 1.0), projected(&whole, &bent));
        for (term, d) in [(12, by_x), (13, by_y)] {
            let dv = d * Vec3::new(bent.x, bent.y, 1.0);
            by.set_column(term, &((dv.xy() - at * dv.z) / v.z));
        }
        by
    }

    /// Sensor coordinates to ideal ones, to 1e-12. `None` outside the region around the axis in which the mapping is
    /// one to one.
    pub fn undistort(&self, d: &Vec2) -> Option<Vec2> {
        let flat = match self.tilt() {
            Some([t, ..]) => Some(projected(&t.try_inverse()?, d)).filter(|p| p.x.is_finite() && p.y.is_finite())?,
            None => *d,
        };
        self.newton(&flat, flat).filter(|n| self.connected(n)).or_else(|| self.walk(&flat))
    }

    /// Whether the mapping is one to one between the axis and n.
    pub fn connected(&self, n: &Vec2) -> bool {
        [0.25, 0.5, 0.75, 1.0].iter().all(|t| upright(&self.bent_jacobian(&(n * *t))))
    }

    fn newton(&self, flat: &Vec2, start: Vec2) -> Option<Vec2> {
        let mut n = start;
        for _ in 0..50 {
            let step = self.bent_jacobian(&n).try_inverse()? * (self.bent(&n) - flat);
            n -= step;
            if !n.x.is_finite() || !n.y.is_finite() {
                return None;
            }
            if step.norm() < 1e-14 {
                break;
            }
        }
        ((self.bent(&n) - flat).norm() < 1e-12 && upright(&self.bent_jacobian(&n))).then_some(n)
    }

    /// Solves in steps from the axis outwards: Newton's method started at the distorted point jumps over a fold of a
    /// strong lens.
    fn walk(&self, flat: &Vec2) -> Option<Vec2> {
        let (mut n, mut done, mut step) = (Vec2::zeros(), 0.0, 0.25);
        while done < 1.0 {
            let to = f64::min(done + step, 1.0);
            match self.newton(&(flat * to), n).filter(|m| (m - n).norm() < 4.0 * step * flat.norm().max(1e-3)) {
                Some(m) => (n, done, step) = (m, to, 2.0 * step),
                None if step < 1e-3 => return None,
                None => step /= 4.0,
            }
        }
        self.connected(&n).then_some(n)
    }
}

/// Whether the mapping is not folded. Beyond two folds the determinant is positive again, with the image rotated by
/// 180 degrees; the trace detects that.
fn upright(j: &Matrix2<f64>) -> bool {
    j.determinant() > 0.0 && j.trace() > 0.0
}

fn projected(t: &Mat3, p: &Vec2) -> Vec2 {
    let v = t * Vec3::new(p.x, p.y, 1.0);
    // A ray from behind a strongly tilted sensor forms no image.
    if v.z > 0.0 { v.xy() / v.z } else { Vec2::repeat(f64::NAN) }
}

fn projected_jacobian(t: &Mat3, p: &Vec2) -> Matrix2<f64> {
    let (v, at) = (t * Vec3::new(p.x, p.y, 1.0), projected(t, p));
    (t.fixed_view::<2, 2>(0, 0) - at * t.fixed_view::<1, 2>(2, 0)) / v.z
}

/// P(R) R with R = R_y(tau_y) R_x(tau_x), where P projects along the axis back onto the tilted plane; and the
/// derivatives with respect to both angles.
fn tilt(tau_x: f64, tau_y: f64) -> [Mat3; 3] {
    let ((sx, cx), (sy, cy)) = (tau_x.sin_cos(), tau_y.sin_cos());
    let about_x = Mat3::new(1.0, 0.0, 0.0, 0.0, cx, sx, 0.0, -sx, cx);
    let about_y = Mat3::new(cy, 0.0, -sy, 0.0, 1.0, 0.0, sy, 0.0, cy);
    let by_x = about_y * Mat3::new(0.0, 0.0, 0.0, 0.0, -sx, cx, 0.0, -cx, -sx);
    let by_y = Mat3::new(-sy, 0.0, -cy, 0.0, 0.0, 0.0, cy, 0.0, -sy) * about_x;
    let r = about_y * about_x;
    let back = |r: &Mat3, one: f64| Mat3::new(r.m33, 0.0, -r.m13, 0.0, r.m33, -r.m23, 0.0, 0.0, one);
    let derivative = |d: &Mat3| back(d, 0.0) * r + back(&r, 1.0) * d;
    [back(&r, 1.0) * r, derivative(&by_x), derivative(&by_y)]
}
