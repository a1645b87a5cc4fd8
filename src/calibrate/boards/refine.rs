//! In: a picture, a corner to within a pixel or two, the grid's directions there. Out: the corner to a few hundredths
//! of a pixel with its sigma (docs/math.md, Corners (1) to (3)).
//! Frame and unit: pixels; grey levels.

use super::sandwich::place_variance;
use crate::geometry::Vec2;
use nalgebra::{SMatrix, SVector};

/// A grey picture in the form that the fits use.
pub struct Grey {
    /// Columns, px.
    pub width: usize,
    /// Rows, px.
    pub height: usize,
    /// Grey levels of the picture, row by row from the top left.
    pub levels: Vec<f32>,
}

impl Grey {
    /// All pixels of a picture.
    pub fn new(image: &crate::raster::Image) -> Grey {
        Grey { width: image.width as usize, height: image.height as usize, levels: image.to_f32() }
    }
    /// Means of `shrink` x `shrink` pixels.
    pub fn shrunk(&self, shrink: usize) -> Grey {
        let (width, height) = (self.width / shrink, self.height / shrink);
        let mean = |k: usize| {
            let (x, y) = (k % width * shrink, k / width * shrink);
            let rows = (y..y + shrink).map(|y| &self.levels[y * self.width + x..y * self.width + x + shrink]);
            rows.map(|row| row.iter().sum::<f32>()).sum::<f32>() / (shrink * shrink) as f32
        };
        Grey { width, height, levels: (0..width * height).map(mean).collect() }
    }
    /// Bilinear interpolation; `None` outside the picture.
    pub fn at(&self, p: &Vec2) -> Option<f64> {
        let (x, y) = (p.x.floor(), p.y.floor());
        if !(x >= 0.0 && y >= 0.0 && x + 1.0 < self.width as f64 && y + 1.0 < self.height as f64) {
            return None;
        }
        let (fx, fy, i) = (p.x - x, p.y - y, y as usize * self.width + x as usize);
        let g = |k: usize| f64::from(self.levels[i + k]);
        let top = g(0) + fx * (g(1) - g(0));
        let bottom = g(self.width) + fx * (g(self.width + 1) - g(self.width));
        Some(top + fy * (bottom - top))
    }
}

/// A refined corner.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Position, px.
    pub pixel: Vec2,
    /// Standard deviation per axis, px, from the residuals of the pixels.
    pub sigma_px: f64,
    /// Sigma of the edge blur, px.
    pub blur_px: f64,
    /// Half the difference between white and black, grey levels; positive if the quadrant between +u and +v is
    /// bright.
    pub contrast: f64,
}

/// Settings of [`corner`].
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Length of the fit along the edges from the corner, as a share of a square's side; 0.2..0.48.
    pub reach: f64,
    /// Upper limit of this length, px: over a longer one the lens bends the edges measurably.
    pub longest_px: f64,
    /// Distance from the nearer edge, as a share of the square, beyond which pixels are excluded: 1 for plain
    /// squares, the marker's margin for ChArUco.
    pub margin: f64,
}

const PARAMETERS: usize = 9;
/// Corners closer than this to the picture's edge show too little of one of their squares, px.
const RIM: f64 = 5.0;

/// Fits two blurred, crossing edges: I = (1 + g·x) (m + c E(d₁) E(d₂)) with d the signed distances from the edges and
/// E a step blurred by a Gaussian and by the pixel. Any symmetric blur keeps the pattern symmetric about the corner,
/// so an imperfect blur model does not shift the corner. `u` and `v` are the steps to the next corners, px.
pub fn corner(grey: &Grey, start: &Vec2, u: &Vec2, v: &Vec2, window: &Window) -> Option<Corner> {
    let to_grid = nalgebra::Matrix2::from_columns(&[*u, *v]).try_inverse()?;
    let (lu, lv) = (u.norm(), v.norm());
    let (ru, rv) = (window.reach.min(window.longest_px / lu), window.reach.min(window.longest_px / lv));
    // Rows of (x, y, grey) about the start, inside the parallelogram and near an edge.
    let half = u * ru;
    let other = v * rv;
    let (hx, hy) = (half.x.abs() + other.x.abs(), half.y.abs() + other.y.abs());
    // A corner near the picture's edge is fitted to the visible part of its window.
    let (right, bottom) = (grey.width as f64 - 1.0, grey.height as f64 - 1.0);
    let (x0, x1) = ((start.x - hx).ceil().max(0.0), (start.x + hx).floor().min(right));
    let (y0, y1) = ((start.y - hy).ceil().max(0.0), (start.y + hy).floor().min(bottom));
    if !(start.x >= RIM && start.y >= RIM && start.x <= right - RIM && start.y <= bottom - RIM) {
        return None;
    }
    let mut pixels = Vec::with_capacity(((x1 - x0 + 1.0) * (y1 - y0 + 1.0)).max(0.0) as usize);
    for y in y0 as usize..=y1 as usize {
        for x in x0 as usize..=x1 as usize {
            let r = Vec2::new(x as f64, y as f64) - start;
            let q = to_grid * r;
            let near = q.x.abs().min(q.y.abs());
            if q.x.abs() <= ru && q.y.abs() <= rv && near <= window.margin {
                pixels.push([r.x, r.y, f64::from(grey.levels[y * grey.width + x])]);
            }
        }
    }
    if pixels.len() < 3 * PARAMETERS {
        return None;
    }
    fit(&pixels, u, v).map(|mut c| {
        c.pixel += start;
        c
    })
}

/// Model value and derivatives at (x, y); `widths` are the pixel's widths perpendicular to the edges. Parameters:
/// corner x y, angles of edges 1 and 2, ln blur, mean m, contrast c, gain slopes gx gy.
fn model(p: &[f64; PARAMETERS], widths: &[f64; 2], x: f64, y: f64, j: &mut [f64; PARAMETERS]) -> f64 {
    let (dx, dy) = (x - p[0], y - p[1]);
    let (s1, c1) = p[2].sin_cos();
    let (s2, c2) = p[3].sin_cos();
    // Edge i runs along (cos a, sin a); its normal is (-sin a, cos a).
    let (d1, d2) = (-s1 * dx + c1 * dy, -s2 * dx + c2 * dy);
    let blur = p[4].exp();
    let ((e1, g1, t1), (e2, g2, t2)) = (edge(d1, widths[0], blur), edge(d2, widths[1], blur));
    let gain = 1.0 + p[7] * x + p[8] * y;
    let shape = p[5] + p[6] * e1 * e2;
    // Derivatives by d1 and d2.
    let (b1, b2) = (gain * p[6] * g1 * e2, gain * p[6] * e1 * g2);
    j[0] = b1 * s1 + b2 * s2;
    j[1] = -b1 * c1 - b2 * c2;
    j[2] = b1 * (-c1 * dx - s1 * dy);
    j[3] = b2 * (-c2 * dx - s2 * dy);
    j[4] = gain * p[6] * (t1 * e2 + e1 * t2);
    j[5] = gain;
    j[6] = gain * e1 * e2;
    j[7] = x * shape;
    j[8] = y * shape;
    gain * shape
}

fn fit(pixels: &[[f64; 3]], u: &Vec2, v: &Vec2) -> Option<Corner> {
    let n = pixels.len() as f64;
    let mean = pixels.iter().map(|p| p[2]).sum::<f64>() / n;
    // The first edge runs along u, the second along v, so that d1 d2 < 0 in the quadrant between +u and +v.
    let (a1, a2) = (u.y.atan2(u.x), v.y.atan2(v.x));
    // The profile of a square pixel across an edge at angle a is a trapezoid. The longer projected side is modelled
    // as the box; the rest counts as blur.
    let widths = [a1, a2].map(|a: f64| a.sin().abs().max(a.cos().abs()));
    let mut p = [0.0, 0.0, a1, a2, 0.0, mean, 0.0, 0.0, 0.0];
    p[6] = contrast(&p, &widths, pixels, mean);
    if !p[6].is_finite() || p[6] == 0.0 {
        return None;
    }
    let limit = 0.35 * u.norm().min(v.norm());
    let (p, h, cost) = settle(p, &widths, pixels, limit)?;
    let variance = cost / (n - PARAMETERS as f64);
    let c = h.try_inverse()?;
    let moved = Vec2::new(p[0], p[1]);
    let turn = |a: f64, b: f64| (a - b).sin().abs();
    let contrast = -p[6];
    let good = moved.norm() < limit
        && turn(p[2], a1) < 0.35
        && turn(p[3], a2) < 0.35
        && p[6].abs() > 2.0 * variance.sqrt()
        && p[5] > p[6].abs() * 0.5;
    good.then(|| Corner {
        pixel: moved,
        sigma_px: place_variance(pixels, &c, |q| {
            let mut j = [0.0; PARAMETERS];
            (q[2] - model(&p, &widths, q[0], q[1], &mut j), j)
        })
        .sqrt(),
        blur_px: p[4].exp(),
        contrast,
    })
}

/// Contrast by projection on the pattern of the start values.
fn contrast(p: &[f64; PARAMETERS], widths: &[f64; 2], pixels: &[[f64; 3]], mean: f64) -> f64 {
    let mut scratch = [0.0; PARAMETERS];
    let (mut top, mut bottom) = (0.0, 0.0);
    for q in pixels {
        model(p, widths, q[0], q[1], &mut scratch);
        top += scratch[6] * (q[2] - mean);
        bottom += scratch[6] * scratch[6];
    }
    top / bottom
}

/// Least squares from a start: parameters, normal matrix and cost at the end. `limit` is the widest blur, px.
fn settle(
    mut p: [f64; PARAMETERS],
    widths: &[f64; 2],
    pixels: &[[f64; 3]],
    limit: f64,
) -> Option<([f64; PARAMETERS], SMatrix<f64, PARAMETERS, PARAMETERS>, f64)> {
    let (mut cost, mut damping) = (f64::INFINITY, 1e-3);
    let (mut h, mut g) = normal_equations(&p, widths, pixels, &mut cost);
    for _ in 0..30 {
        let mut damped = h;
        for i in 0..PARAMETERS {
            damped[(i, i)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&g);
        let mut next = p;
        for i in 0..PARAMETERS {
            next[i] += step[i];
        }
        // The blur stays between 0.1 px (a sharp lens) and `limit`.
        next[4] = next[4].clamp(0.1f64.ln(), limit.max(0.3).ln());
        let mut there = 0.0;
        let (h2, g2) = normal_equations(&next, widths, pixels, &mut there);
        if there <= cost {
            let done = step[0].abs().max(step[1].abs()) < 1e-4 && (cost - there) < 1e-4 * cost;
            (p, cost, h, g) = (next, there, h2, g2);
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
    Some((p, h, cost))
}

type Normal = (SMatrix<f64, PARAMETERS, PARAMETERS>, SVector<f64, PARAMETERS>);

fn normal_equations(p: &[f64; PARAMETERS], widths: &[f64; 2], pixels: &[[f64; 3]], cost: &mut f64) -> Normal {
    let mut h = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    let mut g = SVector::<f64, PARAMETERS>::zeros();
    let mut j = [0.0; PARAMETERS];
    let mut sum = 0.0;
    for q in pixels {
        let r = q[2] - model(p, widths, q[0], q[1], &mut j);
        sum += r * r;
        for a in 0..PARAMETERS {
            g[a] += j[a] * r;
            for b in 0..=a {
                h[(a, b)] += j[a] * j[b];
            }
        }
    }
    for a in 0..PARAMETERS {
        for b in 0..a {
            h[(b, a)] = h[(a, b)];
        }
    }
    *cost = sum;
    (h, g)
}

/// A step from -1 to 1 blurred by a Gaussian of sigma `s` and a box of width `w`, with its derivatives by d and by ln
/// s.
fn edge(d: f64, w: f64, s: f64) -> (f64, f64, f64) {
    let k = std::f64::consts::SQRT_2 * s;
    let (a, b) = ((d + 0.5 * w) / k, (d - 0.5 * w) / k);
    if a.abs().min(b.abs()) > 4.0 && a * b > 0.0 {
        return (d.signum(), 0.0, 0.0);
    }
    let ((ea, ga), (eb, gb)) = (erf(a), erf(b));
    // The integral of erf is x erf(x) + exp(-x²)/√π, and erf' = 2 exp(-x²)/√π.
    let blurred = k / w * (a * ea + 0.5 * ga - b * eb - 0.5 * gb);
    (blurred, (ea - eb) / w, k / w * 0.5 * (ga - gb))
}

/// erf(x) and its derivative.
pub(super) fn erf(x: f64) -> (f64, f64) {
    (libm::erf(x), std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A corner drawn with 16 x 16 samples per pixel, blurred only by the pixel.
    fn drawn(corner: Vec2, u: Vec2, v: Vec2) -> Grey {
        let m = nalgebra::Matrix2::from_columns(&[u, v]).try_inverse().unwrap();
        let mut levels = vec![0.0; 64 * 64];
        for y in 0..64 {
            for x in 0..64 {
                let mut sum = 0.0;
                for k in 0..256 {
                    let p = Vec2::new(
                        f64::from(x) + (f64::from(k % 16) + 0.5) / 16.0 - 0.5,
                        f64::from(y) + (f64::from(k / 16) + 0.5) / 16.0 - 0.5,
                    );
                    let q = m * (p - corner);
                    let light = if q.x * q.y > 0.0 { 180.0 } else { 20.0 };
                    sum += light * (1.0 + 0.004 * p.x);
                }
                levels[(y * 64 + x) as usize] = (sum / 256.0) as f32;
            }
        }
        Grey { width: 64, height: 64, levels }
    }

    #[test]
    fn a_slanted_corner_in_uneven_light_is_found() {
        let truth = Vec2::new(31.37, 30.81);
        let (u, v) = (Vec2::new(24.0, 7.0), Vec2::new(-4.0, 21.0));
        let window = Window { reach: 0.42, longest_px: 15.0, margin: 1.0 };
        let c = corner(&drawn(truth, u, v), &Vec2::new(32.2, 31.6), &u, &v, &window).unwrap();
        assert!((c.pixel - truth).norm() < 0.004, "{c:?}");
        assert!((c.contrast - 80.0).abs() < 15.0 && c.sigma_px < 0.02, "{c:?}");
    }

    #[test]
    fn an_edges_derivatives_are_derivatives() {
        for (d, w, s) in [(0.3, 1.0, 0.4), (-0.8, 0.8, 0.9), (0.0, 1.0, 0.15), (2.0, 0.7, 1.5)] {
            let (_, by_d, by_s) = edge(d, w, s);
            let h = 1e-3;
            assert!(((edge(d + h, w, s).0 - edge(d - h, w, s).0) / (2.0 * h) - by_d).abs() < 2e-3);
            let (up, down) = (edge(d, w, s * h.exp()).0, edge(d, w, s * (-h).exp()).0);
            assert!(((up - down) / (2.0 * h) - by_s).abs() < 2e-3, "{d} {w} {s}");
        }
    }

    #[test]
    fn flat_grey_holds_no_corner() {
        let grey = Grey { width: 64, height: 64, levels: vec![90.0; 4096] };
        let window = Window { reach: 0.42, longest_px: 15.0, margin: 1.0 };
        let (u, v) = (Vec2::new(20.0, 0.0), Vec2::new(0.0, 20.0));
        assert!(corner(&grey, &Vec2::new(30.0, 30.0), &u, &v, &window).is_none());
    }
}
