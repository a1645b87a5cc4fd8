//! In: heights at points, each with its standard deviation. Out: the straight line or plane through them, with its
//! covariance.
//! Frame and unit: mm. The covariance is that of the coefficients, scaled up if the points scatter more than their
//! standard deviations state.

use sheetlight::geometry::{Mat3, Vec3};

/// z = coefficients · (1, x - x0, y - y0).
pub struct Surface {
    /// Mean of the points, x and y.
    pub middle: [f64; 2],
    /// Height at `middle`, slopes along x and y.
    pub coefficients: Vec3,
    /// Covariance of the coefficients.
    pub covariance: Mat3,
    /// Distance of the points from the surface, rms, along z.
    pub rms: f64,
    /// Number of points used.
    pub places: usize,
}

/// A point: x, y, z and the standard deviation of z.
pub type Place = [f64; 4];

/// Smallest standard deviation that a height is given, mm: prevents a cell that states none from dominating the
/// fit.
const FINEST: f64 = 1e-4;
/// Fraction of the points' extent below which they count as collinear: no slope is fitted across that line.
const FLAT: f64 = 1e-6;

impl Surface {
    /// Weighted least squares; `None` for fewer than 3 points, or if they do not determine a plane. With `line`
    /// only a slope along x is fitted, and 2 points are enough.
    pub fn fit(places: &[Place], line: bool) -> Option<Surface> {
        if places.len() < if line { 2 } else { 3 } {
            return None;
        }
        let n = places.len() as f64;
        let middle = [0, 1].map(|k| places.iter().map(|p| p[k]).sum::<f64>() / n);
        let (mut a, mut b) = (Mat3::zeros(), Vec3::zeros());
        for p in places {
            let (row, w) = (row(p, &middle, line), 1.0 / p[3].max(FINEST).powi(2));
            a += row * row.transpose() * w;
            b += row * (p[2] * w);
        }
        if line {
            a[(2, 2)] = 1.0;
        }
        let scale = a[(0, 0)];
        let wide = a[(1, 1)] / scale > FLAT.powi(2) && (line || a[(2, 2)] / scale > FLAT.powi(2));
        let inverse = a.try_inverse().filter(|i| wide && i.iter().all(|v| v.is_finite()))?;
        let coefficients = inverse * b;
        let residual = |p: &Place| p[2] - row(p, &middle, line).dot(&coefficients);
        let free = n - if line { 2.0 } else { 3.0 };
        let chi: f64 = places.iter().map(|p| (residual(p) / p[3].max(FINEST)).powi(2)).sum();
        // Cells that scatter more than they state enlarge the covariance; cells that scatter less do not reduce it.
        let factor = if free > 0.0 { (chi / free).max(1.0) } else { 1.0 };
        let rms = (places.iter().map(|p| residual(p).powi(2)).sum::<f64>() / n).sqrt();
        let mut covariance = inverse * factor;
        if line {
            covariance[(2, 2)] = 0.0;
        }
        Some(Surface { middle, coefficients, covariance, rms, places: places.len() })
    }

    /// Height of the surface at a point and its standard deviation.
    pub fn at(&self, x: f64, y: f64) -> (f64, f64) {
        let row = Vec3::new(1.0, x - self.middle[0], y - self.middle[1]);
        (row.dot(&self.coefficients), (row.transpose() * self.covariance * row)[0].max(0.0).sqrt())
    }

    /// Unit normal, pointing upwards.
    pub fn normal(&self) -> Vec3 {
        Vec3::new(-self.coefficients[1], -self.coefficients[2], 1.0).normalize()
    }
}

fn row(p: &Place, middle: &[f64; 2], line: bool) -> Vec3 {
    Vec3::new(1.0, p[0] - middle[0], if line { 0.0 } else { p[1] - middle[1] })
}
