//! In: homographies from a plane to pictures of it. Out: a start value for a pinhole camera (\[zhang00\] section 3.1,
//! docs/math.md, Camera calibration (5) and (6)).
//! Frame and unit: pixels; the plane's unit.

use crate::calibrate::pose::pose_from_homography;
use crate::camera::{Distortion, Intrinsics};
use crate::geometry::{Mat3, Vec2};
use nalgebra::{DMatrix, Matrix5, Vector5};

/// One view of a plane: positions of its points, their pixels, and the homography between them.
pub struct Seen {
    /// Positions in the plane, in its unit.
    pub plane: Vec<Vec2>,
    /// Their pixels in the same order, px.
    pub pixels: Vec<Vec2>,
    /// Maps positions in the plane to pixels, both homogeneous.
    pub homography: Mat3,
}

/// The camera without distortion that fits the views best. Candidates are Zhang's closed form with zero skew and, in
/// case wrong pictures spoil it, a range of focal lengths with the principal point at the centre.
pub fn first_camera(seen: &[Seen], width: u32, height: u32) -> Option<Intrinsics> {
    let (w, h) = (f64::from(width), f64::from(height));
    let pinhole = |fx: f64, fy: f64, cx: f64, cy: f64| Intrinsics {
        fx,
        fy,
        cx,
        cy,
        skew: 0.0,
        distortion: Distortion::default(),
        width,
        height,
    };
    let ladder = (0..16).map(|i| 0.5 * w.max(h) * 1.2f64.powi(i));
    let guesses = ladder.map(|f| pinhole(f, f, (w - 1.0) / 2.0, (h - 1.0) / 2.0));
    let closed = closed_form(seen, w, h).map(|[fx, fy, cx, cy]| pinhole(fx, fy, cx, cy));
    let mut scored: Vec<(f64, Intrinsics)> =
        closed.into_iter().chain(guesses).map(|k| (misfit(seen, &k), k)).filter(|s| s.0.is_finite()).collect();
    scored.sort_by(|a, b| a.0.total_cmp(&b.0));
    scored.first().map(|s| s.1)
}

/// B = K⁻ᵀK⁻¹ from h₁ᵀBh₂ = 0 and h₁ᵀBh₁ = h₂ᵀBh₂ [zhang00 eq. 8, 9], in coordinates of unit size.
fn closed_form(seen: &[Seen], w: f64, h: f64) -> Option<[f64; 4]> {
    let s = (w + h) / 2.0;
    let unit = Mat3::new(1.0 / s, 0.0, -(w - 1.0) / 2.0 / s, 0.0, 1.0 / s, -(h - 1.0) / 2.0 / s, 0.0, 0.0, 1.0);
    let mut m = Matrix5::zeros();
    for view in seen {
        let g = unit * view.homography;
        // Scale each view so that all have equal weight.
        let g = g / (g.column(0).norm() * g.column(1).norm()).sqrt();
        let v = |a: usize, b: usize| {
            let (p, q) = (g.column(a), g.column(b));
            Vector5::new(p[0] * q[0], p[1] * q[1], p[0] * q[2] + p[2] * q[0], p[1] * q[2] + p[2] * q[1], p[2] * q[2])
        };
        for row in [v(0, 1), v(0, 0) - v(1, 1)] {
            m += row * row.transpose();
        }
    }
    let e = DMatrix::from_column_slice(5, 5, m.as_slice()).symmetric_eigen();
    let b = e.eigenvectors.column(e.eigenvalues.imin()).into_owned();
    let (b11, b22, b13, b23, b33) = (b[0], b[1], b[2], b[3], b[4]);
    let (cx, cy) = (-b13 / b11, -b23 / b22);
    let lambda = b33 - b13 * b13 / b11 - b23 * b23 / b22;
    let (fx, fy) = ((lambda / b11).sqrt(), (lambda / b22).sqrt());
    let k = [fx * s, fy * s, cx * s + (w - 1.0) / 2.0, cy * s + (h - 1.0) / 2.0];
    let sane = k.iter().all(|x| x.is_finite()) && k[0] > 0.1 * w && k[1] > 0.1 * h && cx.abs() < 1.0 && cy.abs() < 1.0;
    sane.then_some(k)
}

/// Median over the views of the squared reprojection error with each view's own pose. Half of the views may be wrong.
fn misfit(seen: &[Seen], k: &Intrinsics) -> f64 {
    let to_normalised = Mat3::new(1.0 / k.fx, 0.0, -k.cx / k.fx, 0.0, 1.0 / k.fy, -k.cy / k.fy, 0.0, 0.0, 1.0);
    let mut all: Vec<f64> = seen
        .iter()
        .map(|view| {
            let pose = pose_from_homography(&(to_normalised * view.homography));
            let sum: f64 = view
                .plane
                .iter()
                .zip(&view.pixels)
                .map(|(x, u)| {
                    let p = pose.point(&crate::geometry::Vec3::new(x.x, x.y, 0.0));
                    k.pixel_from_point(&p).map_or(f64::INFINITY, |q| (q - u).norm_squared())
                })
                .sum();
            sum / view.plane.len() as f64
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(f64::INFINITY)
}
