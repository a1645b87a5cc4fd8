//! In: a picture and the start values of an ellipse. Out: the ellipse's centre to a few hundredths of a pixel
//! (docs/math.md, Corners (4) and (5)).
//! Frame and unit: pixels; grey levels.

use super::super::refine::{Grey, erf};
use super::super::sandwich::place_variance;
use crate::geometry::Vec2;
use nalgebra::{Matrix2, SMatrix, SVector};

/// A fitted dot.
#[derive(Clone, Copy, Debug)]
pub struct Dot {
    pub pixel: Vec2,
    /// Standard deviation per axis, px.
    pub sigma_px: f64,
    /// A of the ellipse qᵀAq = 1 along the dot's edge, 1/px².
    pub shape: Matrix2<f64>,
}

const PARAMETERS: usize = 10;

/// Fits a blurred elliptic edge: I = (1 + g·q) (m + c erf(d/√2s)), with d the distance from qᵀAq = 1 to first order.
/// `shape` is the start value of A (1/px²). Pixels up to `reach` radii from the centre are used, and at least 2 px
/// beyond the edge. Any symmetric blur keeps the pattern symmetric about the centre. `None`
/// if the picture shows no such edge.
pub fn dot(grey: &Grey, start: &Vec2, shape: &Matrix2<f64>, reach: f64) -> Option<Dot> {
    let covariance = shape.try_inverse()?;
    let (hx, hy) = (covariance[(0, 0)].sqrt() * reach + 2.0, covariance[(1, 1)].sqrt() * reach + 2.0);
    let (x0, x1) = ((start.x - hx).ceil(), (start.x + hx).floor());
    let (y0, y1) = ((start.y - hy).ceil(), (start.y + hy).floor());
    if !(x0 >= 0.0 && y0 >= 0.0 && x1 < grey.width as f64 && y1 < grey.height as f64) {
        return None;
    }
    let smallest = covariance.symmetric_eigenvalues().min().sqrt();
    let limit = reach.max(1.0 + 2.0 / smallest);
    let mut pixels = Vec::new();
    for y in y0 as usize..=y1 as usize {
        for x in x0 as usize..=x1 as usize {
            let q = Vec2::new(x as f64, y as f64) - start;
            if (shape * q).dot(&q).sqrt() <= limit {
                pixels.push([q.x, q.y, f64::from(grey.levels[y * grey.width + x])]);
            }
        }
    }
    if pixels.len() < 3 * PARAMETERS {
        return None;
    }
    fit(&pixels, shape, smallest).map(|mut d| {
        d.pixel += start;
        d
    })
}

/// Parameters: centre x y, A as xx xy yy, ln blur, mean, contrast, gain slopes.
fn model(p: &[f64; PARAMETERS], x: f64, y: f64, j: &mut [f64; PARAMETERS]) -> f64 {
    let (dx, dy) = (x - p[0], y - p[1]);
    let (gx, gy) = (p[2] * dx + p[3] * dy, p[3] * dx + p[4] * dy);
    let rho = (gx * dx + gy * dy).max(1e-12).sqrt();
    // Slope of rho: |A q| / rho. Near the edge the distance is (rho - 1) divided by this slope.
    let slope = (gx.hypot(gy) / rho).max(1e-9);
    let d = (rho - 1.0) / slope;
    let inv = (-p[5]).exp() * std::f64::consts::FRAC_1_SQRT_2;
    let (e, g) = erf(d * inv);
    let gain = 1.0 + p[8] * x + p[9] * y;
    let by_d = gain * p[7] * g * inv;
    let by_rho = by_d / slope;
    j[0] = -by_rho * gx / rho;
    j[1] = -by_rho * gy / rho;
    j[2] = by_rho * 0.5 * dx * dx / rho;
    j[3] = by_rho * dx * dy / rho;
    j[4] = by_rho * 0.5 * dy * dy / rho;
    j[5] = -by_d * d;
    j[6] = gain;
    j[7] = gain * e;
    let level = p[6] + p[7] * e;
    j[8] = x * level;
    j[9] = y * level;
    gain * level
}

fn fit(pixels: &[[f64; 3]], shape: &Matrix2<f64>, smallest: f64) -> Option<Dot> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    pixels.iter().for_each(|q| (low, high) = (low.min(q[2]), high.max(q[2])));
    let inner = pixels.iter().min_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])))?[2];
    // Dark dots have a positive contrast: brighter outside.
    let sign = if inner < (low + high) / 2.0 { 1.0 } else { -1.0 };
    let (mean, contrast) = ((low + high) / 2.0, sign * (high - low) / 2.0);
    let mut p = [0.0, 0.0, shape[(0, 0)], shape[(0, 1)], shape[(1, 1)], 0.0, mean, contrast, 0.0, 0.0];
    let (mut h, mut g, mut cost) = normal_equations(&p, pixels);
    let mut damping = 1e-3;
    for _ in 0..40 {
        let mut damped = h;
        (0..PARAMETERS).for_each(|i| damped[(i, i)] *= 1.0 + damping);
        let step = damped.cholesky()?.solve(&g);
        let mut next = p;
        (0..PARAMETERS).for_each(|i| next[i] += step[i]);
        next[5] = next[5].clamp(0.2f64.ln(), smallest.max(0.3).ln());
        if next[2] <= 0.0 || next[2] * next[4] <= next[3] * next[3] {
            damping *= 10.0;
            if damping > 1e9 {
                return None;
            }
            continue;
        }
        let (h2, g2, there) = normal_equations(&next, pixels);
        if there <= cost {
            let done = step[0].abs().max(step[1].abs()) < 1e-4 && cost - there < 1e-4 * cost;
            (p, h, g, cost) = (next, h2, g2, there);
            damping = (damping * 0.1).max(1e-9);
            if done {
                break;
            }
        } else {
            damping *= 10.0;
            if damping > 1e9 {
                break;
            }
        }
    }
    let variance = cost / (pixels.len() - PARAMETERS) as f64;
    let c = h.try_inverse()?;
    let good = Vec2::new(p[0], p[1]).norm() < 0.5 * smallest + 1.0 && p[7].abs() > 3.0 * variance.sqrt();
    let scatter = || {
        place_variance(pixels, &c, |q| {
            let mut j = [0.0; PARAMETERS];
            (q[2] - model(&p, q[0], q[1], &mut j), j)
        })
    };
    let shape = Matrix2::new(p[2], p[3], p[3], p[4]);
    good.then(|| Dot { pixel: Vec2::new(p[0], p[1]), sigma_px: scatter().sqrt(), shape })
}

type Normal = (SMatrix<f64, PARAMETERS, PARAMETERS>, SVector<f64, PARAMETERS>, f64);

fn normal_equations(p: &[f64; PARAMETERS], pixels: &[[f64; 3]]) -> Normal {
    let mut h = SMatrix::zeros();
    let mut g = SVector::zeros();
    let mut j = [0.0; PARAMETERS];
    let mut cost = 0.0;
    for q in pixels {
        let r = q[2] - model(p, q[0], q[1], &mut j);
        cost += r * r;
        let row = SVector::<f64, PARAMETERS>::from(j);
        g += row * r;
        h += row * row.transpose();
    }
    (h, g, cost)
}
