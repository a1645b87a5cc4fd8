//! In: pairs of plane points and image points. Out: the homography between them
//! (docs/math.md, Camera calibration (4)).
//! Frame and unit: none; whatever the two planes use.

use crate::geometry::{Mat3, Vec2, Vec3};
use nalgebra::{DMatrix, SMatrix};

/// Least-squares homography `to ~ H from` by the normalised direct linear transform [hartley04, alg. 4.2]. `None`
/// for fewer than four points or for points on one line.
pub fn homography(from: &[Vec2], to: &[Vec2]) -> Option<Mat3> {
    assert_eq!(from.len(), to.len());
    if from.len() < 4 {
        return None;
    }
    let (tf, tt) = (normaliser(from)?, normaliser(to)?);
    // The 9 x 9 matrix AᵀA of the 2n x 9 system is accurate enough because the coordinates are normalised.
    let mut m = SMatrix::<f64, 9, 9>::zeros();
    for (f, t) in from.iter().zip(to) {
        let (f, t) = (apply_affine(&tf, f), apply_affine(&tt, t));
        let rows = [
            [f.x, f.y, 1.0, 0.0, 0.0, 0.0, -t.x * f.x, -t.x * f.y, -t.x],
            [0.0, 0.0, 0.0, f.x, f.y, 1.0, -t.y * f.x, -t.y * f.y, -t.y],
        ];
        for row in rows {
            let r = SMatrix::<f64, 9, 1>::from(row);
            m += r * r.transpose();
        }
    }
    let e = DMatrix::from_column_slice(9, 9, m.as_slice()).symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|a, b| e.eigenvalues[*a].total_cmp(&e.eigenvalues[*b]));
    // A second null direction means that the points do not determine a homography.
    if e.eigenvalues[order[1]] < 1e-11 * e.eigenvalues[order[8]] {
        return None;
    }
    let h = e.eigenvectors.column(order[0]);
    let h = Mat3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    let h = tt.try_inverse()? * h * tf;
    let scale = h[(2, 2)];
    (scale.abs() > 1e-12 * h.norm()).then(|| h / scale)
}

/// The image of a point; not finite for points on the horizon.
pub fn apply(h: &Mat3, p: &Vec2) -> Vec2 {
    let q = h * Vec3::new(p.x, p.y, 1.0);
    Vec2::new(q.x / q.z, q.y / q.z)
}

fn apply_affine(t: &Mat3, p: &Vec2) -> Vec2 {
    Vec2::new(t[(0, 0)] * p.x + t[(0, 2)], t[(1, 1)] * p.y + t[(1, 2)])
}

/// Similarity that moves the centroid to the origin and scales the mean distance to sqrt(2).
fn normaliser(points: &[Vec2]) -> Option<Mat3> {
    let n = points.len() as f64;
    let c = points.iter().sum::<Vec2>() / n;
    let spread = points.iter().map(|p| (p - c).norm()).sum::<f64>() / n;
    let s = std::f64::consts::SQRT_2 / spread;
    s.is_finite().then(|| Mat3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homography_is_recovered_and_a_line_refused() {
        let h = Mat3::new(1.1, 0.2, 30.0, -0.1, 0.9, 12.0, 1e-3, -4e-4, 1.0);
        let from: Vec<Vec2> = (0..30).map(|i| Vec2::new(f64::from(i % 6) * 15.0, f64::from(i / 6) * 15.0)).collect();
        let to: Vec<Vec2> = from.iter().map(|p| apply(&h, p)).collect();
        assert!((homography(&from, &to).unwrap() - h).norm() < 1e-8);
        assert!(homography(&from[..6], &to[..6]).is_none());
    }
}
